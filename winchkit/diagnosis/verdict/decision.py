"""Decision rule: from the unexplained share to a verdict, and the errors per output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from winchkit.diagnosis.compare import signal_rms
from winchkit.diagnosis.regression.cross_validation import Folds, held_out_rms
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.time_series import Problem
from winchkit.diagnosis.residuals.error_statistics import Skirt
from winchkit.diagnosis.results import OutputFit, Verdict
from winchkit.diagnosis.selection.engine import Inquiry
from winchkit.diagnosis.selection.stepwise import Found
from winchkit.diagnosis.selection.weighting import weighed
from winchkit.model.stages import OUTPUT_UNITS

__all__ = ["Judgement", "by_best_weights", "judge", "output_fits", "withheld"]

_HALF = 0.5
_GENERALISES = 0.15
_TRACE = 0.025
_DOUBTFUL_TRACE = 0.25
_DOUBTFUL = 1e-3
_NEGLIGIBLE = 0.02
_AT_NOISE = 1.1
_NEAR_NOISE = 1.25


@dataclass(frozen=True)
class Judgement:
    """Verdict on the result of a search."""

    verdict: Verdict
    share: float
    """Share of the excess over the noise that the final model leaves unexplained."""
    outputs: Mapping[str, OutputFit]
    shown: Found
    """Result of the search, without the effects that are not named."""
    notes: tuple[str, ...]


def judge(inquiry: Inquiry, found: Found) -> Judgement:
    """Verdict on the result of a search.

    Parameters
    ----------
    inquiry
        Data, candidates and folds of the search.
    found
        Its result.

    Returns
    -------
    Judgement
        Effects are named where the verdict is ``explained``, or where repeats show that less than
        1/40 of the excess is unexplained. Otherwise they are withheld, and a note lists them: an
        effect outside the catalogue is often imitated by one inside it.

    Notes
    -----
    The unexplained share is the ratio, final over initial model, of the mean squares beyond the
    noise (held out) and, with repeats, of the lack of fit in the rejected bands; the larger of the
    two.
    """
    share = _unexplained(inquiry, found)
    folds = _folds(inquiry, found)
    outputs = output_fits(
        inquiry, (found.begin, found.begin_noise), (found.final, found.noise), folds
    )
    verdict = _verdict(found, outputs, share)
    added = found.final.labels[inquiry.given :]
    # Only the true effect explains nearly all of an excess that is far above the noise.
    nearly = share < _TRACE and found.noise.from_repeats
    if verdict == "explained" or nearly or not added:
        return Judgement(verdict, share, outputs, found, ())
    note = f"closest, but not named while the rest is unexplained: {', '.join(added)}"
    return withheld(inquiry, found, share, note)


def withheld(inquiry: Inquiry, found: Found, share: float, note: str) -> Judgement:
    """Verdict that names no effect, with the reason as a note."""
    verdict: Verdict = "unknown" if share > _HALF else "partly"
    shown = replace(found, final=found.begin, noise=found.begin_noise)
    before = (found.begin, found.begin_noise)
    return Judgement(verdict, share, output_fits(inquiry, before, before), shown, (note,))


def by_best_weights(inquiry: Inquiry, judgement: Judgement) -> Judgement:
    """The same verdict with parameters from the weights of least held-out error."""
    shown = judgement.shown
    best = weighed(inquiry, shown.final, shown.noise)
    if best.fit is shown.final:
        return judgement
    before, after = (shown.begin, shown.begin_noise), (best.fit, best.noise)
    outputs = output_fits(inquiry, before, after, _folds(inquiry, shown))
    return replace(
        judgement,
        outputs=outputs,
        shown=replace(shown, final=best.fit, noise=best.noise),
        notes=(*judgement.notes, *best.notes),
    )


def _unexplained(inquiry: Inquiry, found: Found) -> float:
    """Share of the excess over the noise that the final model leaves, larger of two estimates."""
    if not found.alarmed:
        return 0.0
    folds = _folds(inquiry, found)
    held = [
        held_out_rms(inquiry.problem, fitted, found.noise, folds)
        for fitted in (found.begin, found.final)
    ]
    # Without lack of fit in any band, the excess of an output may be chance.
    chance = {} if found.still else found.noise.uncertainty(inquiry.problem)
    squares = [
        sum(
            max(0.0, (rms[o] / noise) ** 2 - 1 - chance.get(o, 0.0))
            for o, noise in found.noise.rms.items()
        )
        for rms in held
    ]
    left = squares[1] / squares[0] if squares[0] > 0 else 0.0
    if found.noise.from_repeats:
        # Both in units of the final noise, so that its re-estimation does not change the share.
        scale = found.begin_noise.power / found.noise.power
        before = float(np.sum(np.maximum(found.begin_presence.excess * scale, 0.0)))
        after = float(np.sum(np.maximum(found.presence.excess, 0.0)[found.presence.rejected]))
        left = max(left if left > _GENERALISES else 0.0, after / before if before > 0 else 0.0)
    return min(1.0, left)


def _folds(inquiry: Inquiry, found: Found) -> Folds:
    """Groups of runs while lack of fit remains, where imitations fail; else folds of the fit."""
    return inquiry.groups if found.still else inquiry.folds(found.final, found.noise)


def _verdict(found: Found, outputs: Mapping[str, OutputFit], share: float) -> Verdict:
    if not found.alarmed:
        return "adequate"
    grown = len(found.final.hypothesis.terms) > len(found.begin.hypothesis.terms)
    if not grown or share > _HALF:
        return "unknown"
    if not found.still or not found.noise.from_repeats:
        return "explained" if share < _GENERALISES else "partly"
    # A remainder below the noise, such as a load that swings on its cable, is accepted.
    over = max(
        fitted.heldout_rms_after / fitted.noise_rms if fitted.noise_rms else np.inf
        for fitted in outputs.values()
    )
    # An imitation of an unknown effect leaves as much: a significant remainder must be small.
    trace = _DOUBTFUL_TRACE if found.presence.p_value > _DOUBTFUL else _TRACE
    allowed = trace if over < _AT_NOISE else _NEGLIGIBLE if over < _NEAR_NOISE else 0.0
    return "explained" if share < allowed else "partly"


def output_fits(
    inquiry: Inquiry,
    begin: tuple[Fit, Noise],
    final: tuple[Fit, Noise],
    folds: Folds | None = None,
) -> dict[str, OutputFit]:
    """Errors of every output before and after, in sample and held out, with its noise.

    Parameters
    ----------
    inquiry
        Data, candidates and folds of the search.
    begin, final
        Fit and noise of the initial and of the final model.
    folds
        Folds of the held-out errors; None for those that suit the final fit.

    Returns
    -------
    dict
        By output; rms in SI.
    """
    problem, folds = inquiry.problem, folds or inquiry.folds(*final)
    before, after = _rms(problem, begin[0]), _rms(problem, final[0])
    held_before = held_out_rms(problem, *begin, folds)
    held_after = held_out_rms(problem, *final, folds)
    noise, skirt = final[1], Skirt(problem.dataset)
    beyond = skirt.residual(begin[0].hypothesis), skirt.residual(final[0].hypothesis)
    noise_beyond = skirt.noise(final[0].hypothesis)
    source = "repeats" if noise.from_repeats else "saturated fit"
    return {
        output: OutputFit(
            unit=OUTPUT_UNITS[output],
            band=next(s.band.cut_off for s in problem.segments if s.output == output),
            signal_rms=signal_rms(problem.dataset, output),
            rms_before=_with(before[output], beyond[0].get(output)),
            rms_after=_with(after[output], beyond[1].get(output)),
            heldout_rms_before=_with(held_before[output], beyond[0].get(output)),
            heldout_rms_after=_with(held_after[output], beyond[1].get(output)),
            noise_rms=_with(noise.rms[output], noise_beyond.get(output)),
            noise_source=source,
        )
        for output in problem.dataset.outputs
    }


def _with(rms: float, beyond: float | None) -> float:
    """An rms with the mean square above the low-pass's cut-off added."""
    return float(np.hypot(rms, np.sqrt(beyond or 0.0)))


def _rms(problem: Problem, fitted: Fit) -> dict[str, float]:
    out = {}
    for output in problem.dataset.outputs:
        own = [s for s in problem.segments if s.output == output]
        total = sum(float(np.sum(fitted.residual[s.rows] ** 2)) for s in own)
        out[output] = float(np.sqrt(total / problem.samples(output)))
    return out
