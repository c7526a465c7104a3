"""The diagnosis: compare, search, name what can be named, and say what cannot be known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from winchkit.diagnosis.admit import OUTPUT_UNITS
from winchkit.diagnosis.compare import begin_hypothesis, signal_rms
from winchkit.diagnosis.confusion import Confusion, confusion_of
from winchkit.diagnosis.dataset import Dataset, prepare
from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.follows import follows, harmonics
from winchkit.diagnosis.gate import held_out, held_out_rms
from winchkit.diagnosis.inquiry import Inquiry
from winchkit.diagnosis.limits import what_runs_cannot_show
from winchkit.diagnosis.next_run import next_runs
from winchkit.diagnosis.noise import Noise
from winchkit.diagnosis.power import detectable
from winchkit.diagnosis.problem import Hypothesis, Problem
from winchkit.diagnosis.result import (
    Candidate,
    Diagnosis,
    Estimate,
    OutputFit,
    Step,
    Verdict,
    Where,
)
from winchkit.diagnosis.search import Found, search
from winchkit.diagnosis.uncertainty import estimates, unknown_std
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.coordinates import Coordinates
from winchkit.runs.run import Run
from winchkit.schema.winch import WinchProfile

__all__ = ["Answer", "diagnose", "inquire", "output_fits"]

_CANDIDATES_FITTED = 5
_NEGLIGIBLE = 0.02
_AT_NOISE = 1.1
_TRACE = 0.25
_GENERALISES = 0.15
_NAMED_BESIDE = 0.15
_HALF = 0.5
_WHERE = 6


class Answer:
    """A diagnosis with everything behind it, for reports and for adding effects."""

    def __init__(self, inquiry: Inquiry, found: Found, diagnosis: Diagnosis) -> None:
        self.inquiry = inquiry
        self.found = found
        self.diagnosis = diagnosis


def diagnose(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Answer:
    """Find which effect of the catalogue the profile lacks on these runs.

    Raises RunError with every fault of every run, FileError for effects that do not bind.
    """
    catalogue = catalogue or load_catalogue()
    inquiry = inquire(prepare(runs, profile, band), catalogue)
    found = search(inquiry)
    share = _unexplained(inquiry, found)
    outputs = output_fits(inquiry, (found.begin, found.begin_noise), (found.final, found.noise))
    verdict = _verdict(found, outputs, share)
    # While much is still unexplained a name would be a guess: it stays among the candidates.
    named = verdict == "explained" or (verdict == "partly" and share < _NAMED_BESIDE)
    added = range(inquiry.given, len(found.final.hypothesis.terms) if named else inquiry.given)
    sets = [confusion_of(inquiry, found.final, found.noise, index) for index in added]
    pairs = [(c.term, rival) for c in sets for rival in c.terms if rival is not c.term]
    notes = (*inquiry.problem.dataset.notes, *what_runs_cannot_show(inquiry.problem))
    diagnosis = Diagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=_steps(inquiry, found, sets) if sets else (),
        candidates=_candidates(inquiry, found),
        detectable=detectable(found.scores, inquiry.price, found.threshold),
        unexplained_share=share,
        where=_where(inquiry, found, found.final if named else found.begin)
        if verdict in {"unknown", "partly"}
        else (),
        next_runs=next_runs(inquiry.problem.dataset, pairs, found.noise.rms),
        notes=notes,
    )
    return Answer(inquiry, found, diagnosis)


def inquire(dataset: Dataset, catalogue: Catalogue) -> Inquiry:
    """An inquiry that begins with the effects that the profile already has."""
    problem = Problem(dataset)
    begin = begin_hypothesis(dataset.profile, catalogue, problem)
    return Inquiry(problem, begin, catalogue)


def _unexplained(inquiry: Inquiry, found: Found) -> float:
    """Share of the excess over the noise that the final model leaves, in sample or held out."""
    if not found.alarmed:
        return 0.0
    held = [
        held_out_rms(inquiry.problem, fitted, found.noise, inquiry.groups)
        for fitted in (found.begin, found.final)
    ]
    squares = [
        sum(max(0.0, (rms[o] / noise) ** 2 - 1) for o, noise in found.noise.rms.items())
        for rms in held
    ]
    left = squares[1] / squares[0] if squares[0] > 0 else 0.0
    if found.noise.from_repeats:
        # Both in units of the final noise, so that a re-estimated noise does not shift the share.
        scale = found.begin_noise.power / found.noise.power
        before = float(np.sum(np.maximum(found.begin_presence.excess * scale, 0.0)))
        after = float(np.sum(np.maximum(found.presence.excess, 0.0)[found.presence.rejected]))
        left = max(left if left > _GENERALISES else 0.0, after / before if before > 0 else 0.0)
    return min(1.0, left)


def _verdict(found: Found, outputs: Mapping[str, OutputFit], share: float) -> Verdict:
    if not found.alarmed:
        return "adequate"
    grown = len(found.final.hypothesis.terms) > len(found.begin.hypothesis.terms)
    if not grown or share > _HALF:
        return "unknown"
    if not found.still or not found.noise.from_repeats:
        return "explained" if share < _GENERALISES else "partly"
    # A trace below the noise, such as a load that bounces on its rope, is told but changes nothing.
    at_noise = all(
        fitted.noise_rms is not None and fitted.heldout_rms_after < _AT_NOISE * fitted.noise_rms
        for fitted in outputs.values()
    )
    return "explained" if share < (_TRACE if at_noise else _NEGLIGIBLE) else "partly"


def output_fits(
    inquiry: Inquiry, begin: tuple[Fit, Noise], final: tuple[Fit, Noise]
) -> dict[str, OutputFit]:
    """Every output before and after, in sample and held out, beside its noise."""
    problem, groups = inquiry.problem, inquiry.groups
    before, after = _rms(problem, begin[0]), _rms(problem, final[0])
    held_before = held_out_rms(problem, *begin, groups)
    held_after = held_out_rms(problem, *final, groups)
    noise = final[1]
    source = "repeats" if noise.from_repeats else "saturated fit"
    return {
        output: OutputFit(
            unit=OUTPUT_UNITS[output],
            band=next(s.band.cut_off for s in problem.segments if s.output == output),
            signal_rms=signal_rms(problem.dataset, output),
            rms_before=before[output],
            rms_after=after[output],
            heldout_rms_before=held_before[output],
            heldout_rms_after=held_after[output],
            noise_rms=noise.rms[output],
            noise_source=source,
        )
        for output in problem.dataset.outputs
    }


def _rms(problem: Problem, fitted: Fit) -> dict[str, float]:
    out = {}
    for output in problem.dataset.outputs:
        own = [s for s in problem.segments if s.output == output]
        total = sum(float(np.sum(fitted.residual[s.rows] ** 2)) for s in own)
        out[output] = float(np.sqrt(total / sum(s.band.count for s in own)))
    return out


def _steps(inquiry: Inquiry, found: Found, sets: Sequence[Confusion]) -> tuple[Step, ...]:
    """Every addition with its confusion set, values and held-out gain."""
    final, noise = found.final, found.noise
    gains = _gains(inquiry, final, noise)
    std = unknown_std(inquiry.problem, final, noise, inquiry.blocks)
    own = estimates(inquiry.problem, final, std)
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
    squares = []
    for count in range(inquiry.given, len(hypothesis.terms) + 1):
        partial = Hypothesis(hypothesis.terms[:count], hypothesis.offset, hypothesis.starts[:count])
        fitted = final if count == len(hypothesis.terms) else inquiry.refit(partial, noise)
        squares.append(float(np.sum(held_out(inquiry.problem, fitted, noise, inquiry.groups))))
    return [1 - after / before for before, after in pairwise(squares)]


def _candidates(inquiry: Inquiry, found: Found) -> tuple[Candidate, ...]:
    out = []
    for rank, item in enumerate(found.scores):
        rms: dict[str, float] = {}
        if found.alarmed and rank < _CANDIDATES_FITTED and item.value > 0:
            fitted = inquiry.trial(found.begin, item, found.begin_noise).fit
            rms = held_out_rms(inquiry.problem, fitted, found.begin_noise, inquiry.groups)
        out.append(Candidate(item.atom.effect.id, item.value, rms))
    return tuple(out)


def _where(inquiry: Inquiry, found: Found, fitted: Fit) -> tuple[Where, ...]:
    """Where the rest lives: angles with an order, other variables, and the loudest band."""
    problem = inquiry.problem
    places = [*harmonics(problem, fitted.residual), *follows(problem, fitted.residual)]
    out = [Where(f.output, f.variable, f.share, f.order) for f in places]
    excess = found.presence.excess
    if excess.size and excess.max() > 0:
        loudest = int(np.argmax(excess))
        output, low, high = problem.bands[loudest]
        middle = low if not np.isfinite(high) else (low + high) / 2
        share = float(excess[loudest] / np.sum(np.maximum(excess, 0)))
        out.append(Where(output, "time", share, frequency=middle))
    return tuple(sorted(out, key=lambda w: -w.share)[:_WHERE])
