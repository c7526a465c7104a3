"""The diagnosis: compare, search, name what can be named, and say what cannot be known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise, zip_longest

import numpy as np

from winchkit.diagnosis.compare import begin_hypothesis
from winchkit.diagnosis.data.dataset import Dataset, prepare
from winchkit.diagnosis.design.detectability import Bar, detectable
from winchkit.diagnosis.design.discrimination import next_runs
from winchkit.diagnosis.design.excitation import what_runs_cannot_show
from winchkit.diagnosis.regression.cross_validation import held_out
from winchkit.diagnosis.regression.exclusion import calmed
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.time_series import Problem
from winchkit.diagnosis.residuals.attribution import follows, harmonics
from winchkit.diagnosis.results import (
    Candidate,
    Diagnosis,
    Estimate,
    Step,
    Where,
)
from winchkit.diagnosis.selection.engine import Inquiry
from winchkit.diagnosis.selection.stepwise import Found, search
from winchkit.diagnosis.verdict.decision import Judgement, by_best_weights
from winchkit.diagnosis.verdict.equivalence import Confusion, confusion_of, pairs_of
from winchkit.diagnosis.verdict.specification_test import judge_and_doubt
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["Answer", "Told", "candidates_of", "diagnose", "inquire", "silent", "steps_of"]

_WHERE = 6
_LOCATED = ("unknown", "partly")


Told = Callable[[str, float], None]
"""Hears what is begun, and the share of the work that is done."""


class Answer:
    """A diagnosis with everything behind it, for reports and for adding effects."""

    def __init__(
        self,
        inquiry: Inquiry,
        found: Found,
        diagnosis: Diagnosis,
        sets: Sequence[Confusion] = (),
        pairs: Sequence[tuple[Term, Term]] = (),
    ) -> None:
        self.inquiry = inquiry
        self.found = found
        self.sets = tuple(sets)
        """What cannot be told apart, a set for each effect that was found."""
        self.pairs = tuple(pairs)
        """Effects to be told apart by a next run, of these sets or of what came closest."""
        self.diagnosis = diagnosis

    @property
    def bar(self) -> Bar:
        """What an effect had to bring to be named."""
        return Bar(self.inquiry.price, self.found.threshold)

    @property
    def filed(self) -> Inquiry:
        """The inquiry into the profile as it was filed; a robot's geometry may have been let go."""
        return self.inquiry


def silent(what: str, share: float) -> None:
    """Tells nobody."""


def diagnose(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    thin: bool = True,
    told: Told = silent,
) -> Answer:
    """Find which effect of the catalogue the profile lacks on these runs.

    ``thin`` lets long runs be thinned out as far as their signals allow; ``told`` hears what is
    begun and which share (0 to 1) of the work is about done. Raises RunError with every fault of
    every run, FileError for effects that do not bind.
    """
    catalogue = catalogue or load_catalogue()
    told("reading the signals", 0.0)
    dataset = prepare(runs, profile, band, thin=thin)
    told("drawing the candidates", 0.2)
    inquiry = inquire(dataset, catalogue)
    told("searching", 0.4)
    found = search(inquiry)
    calm = calmed(dataset, found.reached)
    if calm is not None:
        told("searching again without the jerks", 0.6)
        inquiry = inquire(calm, catalogue)
        found = search(inquiry)
    told("naming", 0.8)
    return _answer(inquiry, found)


def _answer(inquiry: Inquiry, found: Found) -> Answer:
    """Everything that is said of what a search found."""
    judgement = judge_and_doubt(inquiry, found)
    shown = judgement.shown
    added = range(inquiry.given, len(shown.final.hypothesis.terms))
    sets = [confusion_of(inquiry, shown.final, shown.noise, index) for index in added]
    pairs = pairs_of(sets or _closest(inquiry, found, judgement))
    if sets:
        judgement = by_best_weights(inquiry, judgement)
        shown = judgement.shown
    diagnosis = Diagnosis(
        verdict=judgement.verdict,
        outputs=judgement.outputs,
        steps=steps_of(inquiry, shown, sets) if sets else (),
        candidates=candidates_of(inquiry, found),
        detectable=detectable(found.scores, Bar(inquiry.price, found.threshold)),
        unexplained_share=judgement.share,
        where=_where(inquiry.problem, found) if judgement.verdict in _LOCATED else (),
        next_runs=next_runs(inquiry.problem, pairs, found.noise.rms),
        notes=(
            *inquiry.problem.dataset.notes,
            *what_runs_cannot_show(inquiry.problem),
            *judgement.notes,
        ),
    )
    return Answer(inquiry, shown, diagnosis, sets, pairs)


def _closest(inquiry: Inquiry, found: Found, judgement: Judgement) -> list[Confusion]:
    """What came closest and may not be named yet, with its rivals: a next run can begin there.

    Not for an unknown: what resembles something outside the catalogue leads astray.
    """
    if judgement.verdict != "partly":
        return []
    added = range(inquiry.given, len(found.final.hypothesis.terms))
    return [confusion_of(inquiry, found.final, found.noise, index) for index in added]


def inquire(dataset: Dataset, catalogue: Catalogue) -> Inquiry:
    """An inquiry that begins with the effects that the profile already has."""
    problem = Problem(dataset)
    begin = begin_hypothesis(dataset.profile, catalogue, problem)
    return Inquiry(problem, begin, catalogue)


def steps_of(inquiry: Inquiry, found: Found, sets: Sequence[Confusion]) -> tuple[Step, ...]:
    """Every addition with its confusion set, values and held-out gain."""
    final, noise = found.final, found.noise
    gains = _gains(inquiry, final, noise)
    spread = spread_of(inquiry.problem, final, noise, inquiry.blocks)
    own = estimates(inquiry.problem, final, spread)
    out = []
    for confusion, gain, (term, values) in zip(sets, gains, own[inquiry.given :], strict=True):
        parameters = {term.effect.id: values} | {
            rival.effect.id: _values_only(rival.effect.id, confusion)
            for rival in confusion.terms
            if rival.effect.id != term.effect.id
        }
        ordered = {effect: parameters[effect] for effect in confusion.effects}
        out.append(Step(confusion.effects, ordered, gain, confusion.angles))
    return tuple(out)


def _values_only(effect_id: str, confusion: Confusion) -> dict[str, Estimate]:
    """Values of a rival; how sure they are is not worked out for it."""
    term = next(t for t in confusion.terms if t.effect.id == effect_id)
    names = {
        p.name for p in (*Coordinates(term.effect).amplitudes, *Coordinates(term.effect).shapes)
    }
    return {
        p.name: Estimate(term.values[p.name], float("nan"), p.unit)
        for p in term.effect.parameters
        if p.name in names or p.whole
    }


def _gains(inquiry: Inquiry, final: Fit, noise: Noise) -> list[float]:
    """Held-out gain of each step in the order in which the model grew."""
    hypothesis = final.hypothesis
    squares, folds = [], inquiry.folds(final, noise)
    for count in range(inquiry.given, len(hypothesis.terms) + 1):
        partial = Hypothesis(
            hypothesis.terms[:count], hypothesis.nuisances, hypothesis.starts[:count]
        )
        fitted = final if count == len(hypothesis.terms) else inquiry.refit(partial, noise)
        squares.append(float(np.sum(held_out(inquiry.problem, fitted, noise, folds))))
    return [1 - after / before for before, after in pairwise(squares)]


def candidates_of(inquiry: Inquiry, found: Found) -> tuple[Candidate, ...]:
    """Every candidate with its score, the strongest with what it would leave held out."""
    out = []
    folds = inquiry.folds(found.final, found.noise)
    for item, fitted in zip_longest(found.scores, found.tried):
        rms: dict[str, float] = {}
        if fitted is not None:
            rms = inquiry.held_out_errors(fitted, found.begin_noise, folds)
        out.append(Candidate(item.atom.effect.id, item.value, rms))
    return tuple(out)


def _where(problem: Problem, found: Found) -> tuple[Where, ...]:
    """Where the rest lives: angles with an order, other variables, and the loudest band.

    The rest beside what came closest; where that left nothing, yet may not be named, all of it.
    """
    fitted, presence = found.final, found.presence
    if not found.still:
        fitted, presence = found.begin, found.begin_presence
    places = [*harmonics(problem, fitted.residual), *follows(problem, fitted.residual)]
    out = [Where(f.output, f.variable, f.share, f.order) for f in places]
    excess = presence.excess
    if excess.size and excess.max() > 0:
        loudest = int(np.argmax(excess))
        output, low, high = problem.bands[loudest]
        middle = low if not np.isfinite(high) else (low + high) / 2
        share = float(excess[loudest] / np.sum(np.maximum(excess, 0)))
        out.append(Where(output, "time", share, frequency=middle))
    return tuple(sorted(out, key=lambda w: -w.share)[:_WHERE])
