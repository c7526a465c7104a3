"""Selection engine: a regression, its candidates, and the operations of stepwise selection.

The engine fits, scores and compares hypotheses of any regression. How the noise is estimated,
how lack of fit is tested and which folds are held out depends on the data: the implementations
are :class:`~winchkit.diagnosis.selection.time_series.TimeSeriesSelection` for a winch's runs and
:class:`~winchkit.robot.diagnosis.engine.PoseSelection` for a robot's poses.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Coarse, Folds, Regression
from winchkit.diagnosis.regression.gls import CoarseProblem, Fit, RequiredChiSquare, fit, fit_from
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import LackOfFitTest
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.selection.admissible import admissible, best_of_each
from winchkit.diagnosis.selection.pairs import Pair, screened_pairs
from winchkit.diagnosis.selection.scores import Projected, Score, score
from winchkit.diagnosis.selection.signatures import Signatures, signatures, updated_signatures
from winchkit.diagnosis.selection.starting_values import (
    shape_at_bound,
    starting_values,
    truncated_series,
)
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.series import harmonic_series
from winchkit.effects.term import Term
from winchkit.schema.profiles.winch import WinchProfile

Kept = TypeVar("Kept")


class LastValue(Generic[Kept]):
    """Value computed for a fit and a noise, kept until another fit or noise is given."""

    def __init__(self) -> None:
        self._kept: tuple[Fit, BandNoise, Kept] | None = None

    def of(self, fit: Fit, noise: BandNoise, compute: Callable[[], Kept]) -> Kept:
        """The kept value, or a new one where the fit or the noise is another object."""
        if self._kept is None or self._kept[0] is not fit or self._kept[1] is not noise:
            self._kept = fit, noise, compute()
        return self._kept[2]


_TOLERANCE = 1e-6
"""Share of χ² beyond the number of rows at which a fit with its noise stops, where that is more
than 0.02; computing cost: far below the lack of fit."""
_KEPT_REFITS = 4
"""Fits of models without one of their effects, which elimination and exchange have in common."""


@dataclass(frozen=True)
class FittedCandidate:
    """A candidate fitted beside the present effects, all refitted; ``criterion`` is χ² + k ln n, k
    being the number of added parameters.
    """

    fit: Fit
    criterion: float


class SelectionEngine(ABC):
    """Candidates, signatures and comparisons that stay the same through a selection.

    ``on_trial`` is called with the id of every candidate before its fit; ``on_step`` with the model
    and its noise after each addition, and the search ends where it returns true.
    """

    regression: Regression

    def __init__(
        self, regression: Regression, initial_model: Hypothesis, candidates: Iterable[Effect]
    ) -> None:
        self.regression = regression
        self.initial_model = initial_model
        self.n_initial_terms = len(initial_model.terms)
        self._candidates = tuple(candidates)
        self._last_folds: LastValue[Folds] = LastValue()
        self._last_lack_of_fit_test: LastValue[LackOfFitTest] = LastValue()
        self._last_projected: LastValue[Projected] = LastValue()
        self.on_trial: Callable[[str], None] = lambda effect: None
        self.on_step: Callable[[Fit, BandNoise], bool] = lambda fitted, noise: False
        self.delays_wait = False
        self._refits: list[tuple[Hypothesis, BandNoise, float, Fit]] = []
        self._extend_grids(initial_model)
        self.signatures = self._signatures(initial_model)

    @abstractmethod
    def noise(self, residual: Array, jacobian: Array, states: int = 0) -> BandNoise:
        """Noise estimate beside a fitted model; the initial states are the last unknowns."""

    @abstractmethod
    def held_out_errors(self, fitted: Fit, noise: BandNoise, folds: Folds) -> dict[str, float]:
        """Held-out rms error of every output that a user reads, SI."""

    @abstractmethod
    def _choose_folds(self, fitted: Fit, noise: BandNoise) -> Folds:
        """Folds for leave-group-out cross-validation of a fit."""

    @abstractmethod
    def _test_lack_of_fit(self, present: Fit, noise: BandNoise) -> LackOfFitTest:
        """F test of the residual against the noise, band by band."""

    def discretization_power(self, fitted: Fit, noise: BandNoise) -> dict[str, float]:
        """Mean square of what the discretisation error explains of each output; zero by default."""
        return dict.fromkeys(noise.rms, 0.0)

    @property
    def coarse(self) -> Coarse | None:
        """Coarse regression; None where there is none."""
        return None

    def coarse_problem(self, noise: BandNoise) -> CoarseProblem | None:
        """Coarse regression for first fits; None where there is none."""
        return None

    def _coarse_problem(
        self, starts: Sequence[Hypothesis], noise: BandNoise
    ) -> CoarseProblem | None:
        """The coarse regression where a fit from these starting values takes many iterations."""
        nonlinear = any(
            term.effect.memory or term.effect.probes or Coordinates(term.effect).shapes
            for term in starts[0].terms
        )
        return self.coarse_problem(noise) if nonlinear or len(starts) > 1 else None

    def folds(self, fitted: Fit, noise: BandNoise) -> Folds:
        """Folds for leave-group-out cross-validation of a fit; the last result is kept."""
        return self._last_folds.of(fitted, noise, lambda: self._choose_folds(fitted, noise))

    def lack_of_fit_test(self, present: Fit, noise: BandNoise) -> LackOfFitTest:
        """Lack-of-fit test of a fit; the last result is kept."""
        return self._last_lack_of_fit_test.of(
            present, noise, lambda: self._test_lack_of_fit(present, noise)
        )

    @property
    def profile(self) -> WinchProfile | None:
        """Profile of the winch, for plausible ranges relative to one of its numbers."""
        return None

    @property
    def penalty_per_parameter(self) -> float:
        """Reduction of χ² required per parameter: ln n, as in the BIC."""
        return float(np.log(self.regression.n_observations))

    def place_in_catalogue(self, effect_id: str) -> int:
        """Number of a candidate in the order of the catalogue, delays last; after them another."""
        ids = [effect.id for effect in sorted(self._candidates, key=lambda one: one.is_delay)]
        return ids.index(effect_id) if effect_id in ids else len(ids)

    def grouped(self, folds: Folds) -> bool:
        """Whether folds are the groups of programme and load, of which there are two at least."""
        return folds is self.regression.groups and len(set(self.regression.group_of_run)) > 1

    def _signatures(self, present: Hypothesis) -> Signatures:
        return signatures(self.regression, present, self._absent(), self.coarse)

    def _absent(self) -> list[Effect]:
        """Candidates that the initial model lacks."""
        there = {t.effect.id for t in self.initial_model.terms if not t.effect.repeatable}
        return [effect for effect in self._candidates if effect.id not in there]

    def _extend_grids(self, present: Hypothesis) -> bool:
        """Extend the grids of candidates by what the residual shows; False where nothing is new."""
        return False

    def further_orders(self, fitted: Fit, effect: Effect, noise: BandNoise) -> tuple[Term, ...]:
        """Further orders of a fit's last effect that its residual contains; none by default."""
        return ()

    def update_signatures(self, present: Hypothesis) -> None:
        """Compute the signatures beside another model: those of effects that act one after another,
        such as a lag, depend on it.
        """
        self._last_projected = LastValue()
        effects = self._absent() if self._extend_grids(present) else []
        updated = updated_signatures(
            self.regression, present, self.signatures, effects, self.coarse
        )
        if updated is None:
            del self.signatures  # Both together would double the peak memory.
            updated = self._signatures(present)
        self.signatures = updated

    def fit_with_noise(
        self, start: Hypothesis, noise: BandNoise | None = None
    ) -> tuple[Fit, BandNoise]:
        """Fit a hypothesis twice: the noise of the first fit's residual weights the second one. By
        default the first weights are those of the residual at the starting values.
        """
        states = sum(len(own) for own in start.starts)
        if noise is None:
            vector = self.regression.vector(start)
            jacobian = self.regression.jacobian(vector, start)
            noise = self.noise(self.regression.residual(start), jacobian, states)
        inverse_sigma = noise.inverse_sigma(self.regression)
        first = fit(self.regression, start, inverse_sigma, tolerance=_TOLERANCE)
        noise = self.noise(first.residual, first.jacobian, states)
        inverse_sigma = noise.inverse_sigma(self.regression)
        second = fit(self.regression, first.hypothesis, inverse_sigma, tolerance=_TOLERANCE)
        return second, noise

    def projected(self, present: Fit, noise: BandNoise) -> Projected:
        """Signatures with the unknowns of a fit partialled out; the last result is kept."""

        def compute() -> Projected:
            return Projected(self.regression, self.signatures, present.jacobian, noise)

        return self._last_projected.of(present, noise, compute)

    def scores(self, present: Fit, noise: BandNoise) -> list[Score]:
        """Scores of all candidates that the model lacks, one per effect, best first."""
        return best_of_each(self.scores_at_all_points(present, noise))

    def scores_at_all_points(self, present: Fit, noise: BandNoise) -> list[Score]:
        """Scores of all candidates at every point of their shape grids, best first."""
        ranked = score(
            self.projected(present, noise), present.residual, self.regression.n_observations
        )
        if self.delays_wait:
            ranked = [item for item in ranked if not item.candidate.effect.is_delay]
        return admissible(ranked, present.hypothesis, self.regression.n_observations)

    def pairs(self, present: Fit, noise: BandNoise) -> list[Pair]:
        """Pairs of candidates with a positive net gain, best first."""
        scores = self.scores_at_all_points(present, noise)
        return screened_pairs(
            self.projected(present, noise), present.residual, scores, self.penalty_per_parameter
        )

    def criterion(self, fitted: Fit) -> float:
        """Bayesian information criterion of a fit up to a constant (Schwarz 1978): χ² + k ln n,
        where k counts the parameters and initial states of the added effects.
        """
        return fitted.chi_square + self.penalty(fitted.hypothesis)

    def penalty(self, hypothesis: Hypothesis) -> float:
        """Penalty k ln n of the criterion."""
        added = hypothesis.terms[self.n_initial_terms :]
        n_parameters = sum(Coordinates(term.effect).n_parameters for term in added)
        states = sum(len(start) for start in hypothesis.starts[self.n_initial_terms :])
        return self.penalty_per_parameter * (n_parameters + states)

    def trial(
        self,
        present: Fit,
        item: Score,
        noise: BandNoise,
        *,
        target: float | None = None,
        aim: float | None = None,
    ) -> FittedCandidate:
        """Fit a candidate beside the present effects, without those that it contains.

        Of a series law one coefficient after another is added as long as the criterion decreases.
        The trial is abandoned where the χ² ``target`` is out of reach, and its fit ends where the
        smaller ``aim`` is.
        """
        goal = None if target is None else RequiredChiSquare(target, present.chi_square)
        self.on_trial(item.candidate.effect.id)
        effect, inverse_sigma = item.candidate.effect, noise.inverse_sigma(self.regression)
        hypothesis = present.hypothesis
        for index in reversed(range(self.n_initial_terms, len(hypothesis.terms))):
            if hypothesis.terms[index].effect.id in effect.contains:
                hypothesis = hypothesis.without(index)
        best: FittedCandidate | None = None
        for law in truncated_series(effect):
            if best is None:
                own = replace(item, candidate=item.candidate.with_law(law))
                starts = self._starts(hypothesis, own)
            else:
                starts = [best.fit.hypothesis.with_law(law)]
            fitted = fit_from(
                self.regression,
                starts,
                inverse_sigma,
                self._coarse_problem(starts, noise),
                goal,
                aim=aim,
            )
            longer = FittedCandidate(fitted, self._criterion_of_trial(fitted))
            if best is not None and not longer.criterion < best.criterion:
                break
            best = longer if np.isfinite(longer.criterion) else best
        return self._with_further_orders(best or longer, present, noise)

    def _with_further_orders(
        self, trial: FittedCandidate, present: Fit, noise: BandNoise
    ) -> FittedCandidate:
        """The trial with all orders of its effect as one series, where its criterion is lower."""
        hypothesis = trial.fit.hypothesis
        own = hypothesis.terms[-1]
        if not own.effect.repeatable or not trial.criterion < self.criterion(present):
            return trial
        added = range(self.n_initial_terms, len(hypothesis.terms))
        same = [i for i in added if hypothesis.terms[i].effect.id == own.effect.id]
        further = self.further_orders(trial.fit, own.effect, noise)
        if len(same) + len(further) < 2:
            return trial
        series = harmonic_series([*(hypothesis.terms[i] for i in same), *further])
        for index in reversed(same):
            hypothesis = hypothesis.without(index)
        hypothesis = hypothesis.with_term(series, self.regression.n_runs)
        fitted = self.refit(hypothesis, noise)
        longer = FittedCandidate(fitted, self.criterion(fitted))
        return min(trial, longer, key=lambda one: one.criterion)

    def _starts(self, hypothesis: Hypothesis, item: Score) -> list[Hypothesis]:
        """Starting values of a hypothesis with a candidate added."""
        terms = [Term(item.candidate.effect, values) for values in starting_values(item)]
        return [hypothesis.with_term(term, self.regression.n_runs) for term in terms]

    def _criterion_of_trial(self, fitted: Fit) -> float:
        """Criterion of a trial; infinite where its last effect has degenerated to another."""
        if not fitted.abandoned and shape_at_bound(fitted.hypothesis.terms[-1]):
            return np.inf
        return self.criterion(fitted)

    def refit(self, hypothesis: Hypothesis, noise: BandNoise, aim: float = np.inf) -> Fit:
        """Fit a hypothesis under a given noise; it ends where the χ² ``aim`` is out of reach."""
        for known, under, aimed, fitted in self._refits:
            if under is noise and known == hypothesis and aimed == aim:
                return fitted
        inverse_sigma = noise.inverse_sigma(self.regression)
        problem = self._coarse_problem([hypothesis], noise)
        fitted = fit_from(self.regression, [hypothesis], inverse_sigma, problem, aim=aim)
        self._refits = [(hypothesis, noise, aim, fitted), *self._refits[: _KEPT_REFITS - 1]]
        return fitted

    def fixed(self, hypothesis: Hypothesis, noise: BandNoise) -> Fit:
        """A hypothesis at its values, with residual and Jacobian but without iteration."""
        return fit(self.regression, hypothesis, noise.inverse_sigma(self.regression), 0)
