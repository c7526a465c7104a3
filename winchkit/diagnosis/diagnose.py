"""Diagnosis of a winch: data, stepwise selection, verdict and the next motion programmes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from winchkit.diagnosis.compare import initial_hypothesis
from winchkit.diagnosis.data.dataset import Dataset, prepare
from winchkit.diagnosis.data.sanity import caveats
from winchkit.diagnosis.design.detectability import DetectionThreshold, detectable
from winchkit.diagnosis.design.discrimination import next_runs
from winchkit.diagnosis.design.excitation import missing_excitation
from winchkit.diagnosis.regression.exclusion import without_impacts
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import Spread, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.run_offsets import run_offsets, with_run_offsets
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import (
    MOST_PLACES,
    Attribution,
    attributions,
    harmonics,
)
from winchkit.diagnosis.residuals.traces import Trace, trace_columns, traces_of
from winchkit.diagnosis.results import Diagnosis, NextRun, OutputFit, Step
from winchkit.diagnosis.selection.acceptance import predicts_better
from winchkit.diagnosis.selection.contribution import ordered_by_contribution
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import (
    SelectionResult,
    initial_result,
    stepwise_selection,
)
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.selection.transitions import scanned_transitions, with_fitted_transitions
from winchkit.diagnosis.selection.weighting import reweighted
from winchkit.diagnosis.steps import (
    Standing,
    candidates_of,
    is_small,
    standing_of,
    steps_of,
    with_standing,
)
from winchkit.diagnosis.verdict.decision import (
    MOSTLY,
    Measured,
    measured,
    output_fits,
    remaining_share,
    verdict_of,
)
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet, equivalence_set, pairs_of
from winchkit.diagnosis.verdict.fit_statistics import fit_statistics
from winchkit.diagnosis.verdict.laws import simplified, with_first_members
from winchkit.diagnosis.verdict.open_law import better_curve, predictable_share
from winchkit.diagnosis.verdict.profile_values import file_model, refitted_steps
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.location import located
from winchkit.effects.term import Term
from winchkit.effects.transition import with_transitions
from winchkit.rendering import Plotted
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.tabular import Columns, Tabular

_PREDICTED = 0.1
"""Share of a residual that a curve or an order must predict for it to be a missing effect."""
_REPEAT = "record the same motion again: without repeats the noise is not known"


Found = TypeVar("Found")
ProgressCallback = Callable[[str, float], None]
"""Called with the present step and the share of the work done, 0 to 1."""

_USUAL_TRIALS = 7.0
"""Candidates after whose fits the progress bar has covered 63 % of a step; measured: a search of
the timing benchmark fits 7, 7, 7 and 8 candidates (four hidden effects)."""
_SEARCH = (0.4, 0.8)
"""Part of the progress bar for the search; measured: the search of these four begins at 36 to 40 %
of the processor time and ends at 79 to 86 %."""
_NAMING = (0.8, 1.0)
"""The same for the equivalence sets; measured: the rest."""


class Answer(Plotted, Tabular):
    """A diagnosis with everything that it was derived from, for reports and plans.

    Parameters
    ----------
    engine
        Engine of the last selection.
    result
        Result of the selection, without withheld additions.
    diagnosis
        What is printed.
    sets
        Equivalence set of every addition.
    pairs
        Effects that a next run should distinguish.
    """

    engine: SelectionEngine

    def __init__(
        self,
        engine: SelectionEngine,
        result: SelectionResult,
        diagnosis: Diagnosis,
        sets: Sequence[EquivalenceSet] = (),
        pairs: Sequence[tuple[Term, Term]] = (),
    ) -> None:
        self.engine = engine
        self.result = result
        self.diagnosis = diagnosis
        self.sets = tuple(sets)
        self.pairs = tuple(pairs)

    def fit_report(self) -> str:
        """Return the report of the fit; see :meth:`Diagnosis.fit_report`."""
        return self.diagnosis.fit_report()

    def _columns(self) -> Columns:
        return trace_columns(self.diagnosis.traces)

    @property
    def threshold(self) -> DetectionThreshold:
        """Reduction of χ² that an effect needs to be named."""
        return DetectionThreshold(self.engine.penalty_per_parameter, self.result.threshold)

    @property
    def file_engine(self) -> SelectionEngine:
        """Engine with the profile at its file values; a robot's geometry may be free later."""
        return self.engine


class WinchAnswer(Answer):
    """A diagnosis of a winch's runs with everything that it was derived from."""

    engine: TimeSeriesSelection

    def __init__(
        self,
        engine: TimeSeriesSelection,
        result: SelectionResult,
        diagnosis: Diagnosis,
        sets: Sequence[EquivalenceSet] = (),
        pairs: Sequence[tuple[Term, Term]] = (),
    ) -> None:
        super().__init__(engine, result, diagnosis, sets, pairs)


def no_progress(what: str, share: float) -> None:
    """Progress callback that does nothing."""


def diagnose(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    decimate: bool = True,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> WinchAnswer:
    """Find the effects that a winch's profile lacks on its runs.

    Parameters
    ----------
    runs
        Recorded runs.
    profile
        The winch.
    catalogue
        Effects; by default all that are installed.
    band
        Cut-off frequency of the torque's low-pass filter, Hz; by default chosen from the sampling.
    decimate
        Decimate long runs as far as their signals allow.
    as_recorded
        Look for effects although a sign or unit looks wrong.
    progress
        Called with the present step and the share of the work done, 0 to 1. How many candidates
        will be fitted is not known: the share approaches that of the step as they are.
    interrupted
        Called when a KeyboardInterrupt ends the search, with the errors of the profile and the
        scores of the candidates, and before the exception goes on.

    Returns
    -------
    WinchAnswer
        The diagnosis with everything that it was derived from.

    Raises
    ------
    RunError
        With every fault of every run.
    FileError
        For effects that do not bind.
    """
    catalogue = catalogue or load_catalogue()
    progress("reading the signals", 0.0)
    dataset = prepare(runs, profile, band, decimate=decimate, fast=True, catalogue=catalogue)
    return diagnose_prepared(
        dataset, catalogue, as_recorded=as_recorded, progress=progress, interrupted=interrupted
    )


def diagnose_prepared(
    dataset: Dataset,
    catalogue: Catalogue,
    *,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> WinchAnswer:
    """The same as :func:`diagnose` on a prepared data set."""
    progress("computing the signatures of the candidates", 0.1)
    engine = selection_engine(dataset, catalogue)
    if caveats(dataset.sanity) and not as_recorded:
        return _unsearched(engine)
    file = engine.initial_model
    known: list[SelectionResult] = []
    try:
        result, rounded = _searched(engine, catalogue, _Trials(progress, "fitting"), known.append)
        engine, catalogue = rounded or (engine, catalogue)

        def searched(offset: Dataset) -> tuple[TimeSeriesSelection, SelectionResult]:
            other = selection_engine(offset, catalogue)
            other.on_trial = _Trials(progress, "with an offset per run, fitting")
            return other, stepwise_selection(other)

        dataset, (engine, result) = with_offsets_where_better(
            dataset,
            (engine, result),
            searched,
            lambda found: (found[0], found[1].final, found[1].noise),
        )
        reduced = without_impacts(dataset, result.final.hypothesis)
        if reduced is not None:
            engine = selection_engine(reduced, catalogue)
            engine.on_trial = _Trials(progress, "without impacts, fitting")
            result = stepwise_selection(engine)
        engine.on_trial = _Trials(progress, "naming, compared with", _NAMING)
        return _answer(*_with_plain_laws(engine, result, catalogue), file)
    except KeyboardInterrupt:
        if interrupted is not None and known:
            interrupted(_known_at_interrupt(engine, known[0]))
        raise


def _searched(
    engine: TimeSeriesSelection,
    catalogue: Catalogue,
    trials: Callable[[str], None],
    known: Callable[[SelectionResult], None],
) -> tuple[SelectionResult, tuple[TimeSeriesSelection, Catalogue] | None]:
    """Result of the search, and engine and catalogue where reversals of friction are rounded.

    As soon as a friction that was found fits better with a transition, the search begins again with
    it in every law of friction.
    """
    transitions: dict[str, float] = {}

    def is_rounded(present: Fit, noise: Noise) -> bool:
        transitions.update(scanned_transitions(engine, present, noise))
        return bool(transitions)

    engine.on_trial, engine.on_step = trials, is_rounded
    result = stepwise_selection(engine, known)
    if not transitions:
        return result, None
    rounded = Catalogue(with_transitions(effect, transitions) for effect in catalogue)
    again = selection_engine(engine.regression.dataset, rounded)
    again.on_trial = trials
    return stepwise_selection(again), (again, rounded)


def _with_plain_laws(
    engine: TimeSeriesSelection, result: SelectionResult, catalogue: Catalogue
) -> tuple[TimeSeriesSelection, SelectionResult]:
    """The result with its simplest laws and fitted transitions.

    A law with a degenerate shape may have imitated another effect (presliding over a whole turn is
    a spring). Where its replacement loses by 2 %, the search is repeated without such laws.
    """
    plain = _simplified(engine, result)
    before = (engine, result.final, result.noise)
    left = {term.effect.id for term in plain.final.hypothesis.terms}
    degenerate = {
        term.effect.id
        for term in result.final.hypothesis.terms[engine.n_initial_terms :]
        if term.effect.reduces_to and term.effect.id not in left
    }
    if not degenerate or not predicts_better(before, (engine, plain.final, plain.noise)):
        return engine, plain
    others = [effect for effect in catalogue if effect.id not in degenerate]
    again = selection_engine(engine.regression.dataset, catalogue, others)
    again.on_trial = engine.on_trial
    found = _simplified(again, stepwise_selection(again))
    now, was = (again, found.final, found.noise), (engine, plain.final, plain.noise)
    return (again, found) if predicts_better(now, was) else (engine, plain)


def _simplified(engine: TimeSeriesSelection, result: SelectionResult) -> SelectionResult:
    """The result with its simplest laws, the transitions of friction fitted before and after."""

    def settled(fitted: Fit) -> Fit:
        return with_fitted_transitions(engine, fitted, result.noise)

    final, noise = simplified(engine, settled(result.final), result.noise, settled)
    return replace(result, final=with_fitted_transitions(engine, final, noise), noise=noise)


def with_offsets_where_better(
    dataset: Dataset,
    found: Found,
    again: Callable[[Dataset], Found],
    final: Callable[[Found], tuple[TimeSeriesSelection, Fit, Noise]],
) -> tuple[Dataset, Found]:
    """Result with an offset per run, where one is found that predicts held-out blocks better.

    Returns: data set and result, the given ones where offsets are not needed.
    """
    engine, fitted, noise = final(found)
    offset = with_run_offsets(dataset, engine.regression, fitted)
    if offset is None:
        return dataset, found
    other = again(offset)
    better = predicts_better(final(other), (engine, fitted, noise))
    return (offset, other) if better else (dataset, found)


class _Trials:
    """Reports the progress of a step by the number of candidates that were fitted."""

    def __init__(
        self, progress: ProgressCallback, what: str, ends: tuple[float, float] = _SEARCH
    ) -> None:
        self._progress, self._what, self._ends, self._count = progress, what, ends, 0
        progress(what.partition(",")[0], ends[0])

    def __call__(self, effect: str) -> None:
        low, high = self._ends
        self._count += 1
        left = np.exp(-self._count / _USUAL_TRIALS)
        self._progress(f"{self._what} {effect}", float(high - (high - low) * left))


def _known_at_interrupt(engine: TimeSeriesSelection, start: SelectionResult) -> WinchAnswer:
    """Errors of the profile and scores of the candidates, without a verdict."""
    before = start.initial_model, start.initial_noise
    diagnosis = Diagnosis(
        verdict="unknown",
        outputs=output_fits(engine, before, before),
        steps=(),
        candidates=candidates_of(engine, start),
        detectable=(),
        unexplained_share=float("nan"),
        where=(),
        next_runs=(),
        notes=engine.regression.dataset.notes,
        sanity=engine.regression.dataset.sanity,
        used_share=engine.regression.dataset.used_share,
        removed=engine.regression.dataset.removed,
        caveats=engine.regression.dataset.caveats,
        interrupted=True,
        traces=_traces(engine, start, named=False),
    )
    return WinchAnswer(engine, start, diagnosis)


def _unsearched(engine: TimeSeriesSelection) -> WinchAnswer:
    """Verdict ``unknown`` for runs with a wrong sign or unit: no effect must explain that."""
    result = initial_result(engine)
    dataset, model = engine.regression.dataset, (result.initial_model, result.initial_noise)
    diagnosis = Diagnosis(
        verdict="unknown",
        outputs=output_fits(engine, model, model),
        steps=(),
        candidates=(),
        detectable=(),
        unexplained_share=1.0,
        where=(),
        next_runs=(),
        notes=dataset.notes,
        sanity=dataset.sanity,
        used_share=dataset.used_share,
        removed=dataset.removed,
        caveats=dataset.caveats,
        traces=_traces(engine, result, named=False),
    )
    return WinchAnswer(engine, result, diagnosis)


def _answer(engine: TimeSeriesSelection, result: SelectionResult, file: Hypothesis) -> WinchAnswer:
    """Steps of the final model with their doubts, the verdict, and the next programmes.

    ``file`` are the effects of the profile at their file values.
    """
    regression, dataset = engine.regression, engine.regression.dataset
    best = reweighted(engine, result.final, result.noise)
    found = replace(result, final=best.fit, noise=best.noise)
    found = ordered_by_contribution(engine, found)
    final, noise = found.final, found.noise
    added = range(engine.n_initial_terms, len(final.hypothesis.terms))
    sets = [equivalence_set(engine, final, noise, index) for index in added]
    final, sets = with_first_members(engine, final, noise, sets)
    final = with_fitted_transitions(engine, final, noise)
    if not final.converged:
        final = engine.refit(final.hypothesis, noise)
    found = replace(found, initial_model=file_model(engine, file, noise), final=final)
    outputs = output_fits(engine, (found.initial_model, noise), (final, noise))
    size = {name: output.noise_rms for name, output in outputs.items()}
    spread = _spread(engine, found)
    known = measured(regression, found.initial_model, final, noise, outputs)
    steps = (
        *refitted_steps(engine, found, file, outputs, spread),
        *_steps(engine, found, sets, outputs, known=known, spread=spread),
    )
    where = _where(regression, found)
    verdict = verdict_of(
        outputs,
        steps=len(steps),
        noise_known=noise.from_repeats,
        deciding=known.deciding,
        refuted=known.refuted,
        predictable=lambda: (
            any(w.order is not None and w.share >= _PREDICTED for w in where)
            or predictable_share(engine, final, noise, size) >= _PREDICTED
        ),
    )
    pairs = pairs_of(sets)
    repeat = [NextRun((), _REPEAT)] if verdict == "undecided" else []
    diagnosis = Diagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, found),
        detectable=detectable(
            result.scores, DetectionThreshold(engine.penalty_per_parameter, result.threshold)
        ),
        unexplained_share=0.0
        if verdict == "adequate"
        else remaining_share(
            {name: output for name, output in outputs.items() if name in known.deciding}
        ),
        where=where if verdict != "adequate" else (),
        next_runs=(*repeat, *next_runs(regression, pairs, noise.rms)),
        notes=(
            *dataset.notes,
            *missing_excitation(regression),
            *best.notes,
        ),
        sanity=dataset.sanity,
        used_share=dataset.used_share,
        removed=dataset.removed,
        caveats=dataset.caveats,
        fit=fit_statistics(
            regression, found.initial_model, final, noise, spread, profile=dataset.profile
        ),
        traces=_traces(engine, found, named=bool(steps)),
        run_offsets=run_offsets(regression, final, spread),
    )
    return WinchAnswer(engine, found, diagnosis, sets, pairs)


def _steps(
    engine: TimeSeriesSelection,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    outputs: Mapping[str, OutputFit],
    *,
    known: Measured,
    spread: Spread,
) -> Iterator[Step]:
    """Every addition with its share, law and doubts."""
    if not sets:
        return
    final, noise = result.final, result.noise
    folds, first = engine.folds(final, noise), engine.n_initial_terms
    standings: list[Standing] = []
    counted = {name: output for name, output in outputs.items() if name in known.deciding}
    mostly = remaining_share(counted) <= MOSTLY
    acts = [frozenset(term.effect.outputs) for term in final.hypothesis.terms[first:]]
    for place, own in enumerate(acts):
        without = engine.refit(final.hypothesis.without(first + place), noise)
        errors = engine.held_out_errors(without, noise, folds)
        standing = standing_of(errors, outputs, sorted(own))
        trusted = bool(known.deciding & own) and not known.refuted & own
        standings.append(replace(standing, certain=standing.certain and trusted and mostly))
    for place, step in enumerate(steps_of(engine, result, sets, engine.regression.dataset, spread)):
        beside = [one for one, there in zip(standings, acts, strict=True) if there & acts[place]]
        yield with_standing(
            engine,
            result,
            step,
            index=first + place,
            standing=standings[place],
            curve=better_curve(engine, final, noise, first + place),
            small=is_small(standings[place], beside),
        )


def _traces(
    engine: TimeSeriesSelection, result: SelectionResult, *, named: bool
) -> tuple[Trace, ...]:
    """Measured and predicted outputs; by the profile too where effects were named."""
    before = result.initial_model.residual
    if not named:
        return traces_of(engine.regression, before)
    return traces_of(engine.regression, result.final.residual, before)


def _spread(engine: SelectionEngine, result: SelectionResult) -> Spread:
    """Uncertainty of the unknowns of the final model."""
    return spread_of(engine.regression, result.final, result.noise, engine.regression.blocks)


def selection_engine(
    dataset: Dataset, catalogue: Catalogue, candidates: Iterable[Effect] | None = None
) -> TimeSeriesSelection:
    """Selection engine whose initial model is the profile's own effects.

    Candidates are all effects of the catalogue, or those that are given.
    """
    regression = TimeSeriesRegression(dataset)
    initial_model = initial_hypothesis(dataset.profile, catalogue, regression)
    chosen = catalogue if candidates is None else candidates
    absent = [located(effect, dataset.motions) for effect in chosen]
    return TimeSeriesSelection(regression, initial_model, absent)


def _where(regression: TimeSeriesRegression, result: SelectionResult) -> tuple[Attribution, ...]:
    """Variables and orders with the largest shares of the final model's residual."""
    residual = result.final.residual
    out = [*harmonics(regression, residual), *attributions(regression, residual)]
    return tuple(sorted(out, key=lambda w: -w.share)[:MOST_PLACES])
