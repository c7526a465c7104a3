"""Decision rule: from the unexplained share to a verdict, and the errors per output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from winchkit.diagnosis.regression.base import Folds, Regression
from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.residuals.stop_band_leakage import StopBandLeakage
from winchkit.diagnosis.results import OutputFit, Verdict
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.selection.weighting import reweighted
from winchkit.model.stages import OUTPUT_UNITS

__all__ = ["Judgement", "judge", "named", "output_fits", "reweighted_judgement", "withheld"]

_UNKNOWN_SHARE = 0.5
_HELD_OUT_SHARE = 0.15
_EXPLAINED_SHARE = 0.025
_EXPLAINED_SHARE_UNCERTAIN = 0.25
_UNCERTAIN_P_VALUE = 1e-3
_EXPLAINED_SHARE_NEAR_NOISE = 0.02
_AT_NOISE = 1.1
_NEAR_NOISE = 1.25


@dataclass(frozen=True)
class Judgement:
    """Verdict on the result of a search."""

    verdict: Verdict
    share: float
    """Share of the excess over the noise that the final model leaves unexplained."""
    outputs: Mapping[str, OutputFit]
    reported: SelectionResult
    """Result of the search, without the effects that are not named."""
    notes: tuple[str, ...]


def judge(engine: SelectionEngine, result: SelectionResult) -> Judgement:
    """Verdict on the result of a search.

    Parameters
    ----------
    engine
        Data, candidates and folds of the search.
    result
        Its result.

    Returns
    -------
    Judgement
        Effects are named where the verdict is ``explained``, or where repeats show that less than
        1/40 of the excess is unexplained. Otherwise they are withheld, and a note lists them: an
        effect outside the catalogue is often imitated by one inside it. See :func:`named`.

    Notes
    -----
    The unexplained share is the ratio, final over initial model, of the mean squares beyond the
    noise (held out) and, with repeats, of the lack of fit in the rejected bands; the larger of the
    two.
    """
    outputs = output_fits(
        engine, (result.initial_model, result.initial_noise), (result.final, result.noise)
    )
    added = result.final.labels[engine.n_initial_terms :]
    if not result.lack_of_fit_at_start:
        return Judgement("adequate", 0.0, outputs, result, ())
    # Without repeats the noise is what no candidate explains, below the error of any effect.
    if result.noise.from_repeats or not added:
        irrelevant = withheld(engine, result, 0.0, _irrelevant(result))
        if _error_ratio(irrelevant.outputs) < 1 / RELEVANT_RATIO:
            return replace(irrelevant, verdict="adequate")
    share = _unexplained(engine, result)
    verdict = _verdict(result, outputs, share) if added else "unknown"
    # Only the effect itself explains nearly all of a residual far above the noise floor.
    explained_but_detectable = share < _EXPLAINED_SHARE and result.noise.from_repeats
    if verdict == "explained" or explained_but_detectable or not added:
        return Judgement(verdict, share, outputs, result, ())
    note = f"closest, but not named while the rest is unexplained: {', '.join(added)}"
    return withheld(engine, result, share, note)


def _irrelevant(result: SelectionResult) -> str:
    """Note on what is significant where no error is above the noise by a relevant ratio."""
    significant = (item for item in result.scores if item.is_significant(result.threshold))
    best = next(significant, None)
    what = "a lack of fit" if best is None else f"the evidence for {best.candidate.effect.id}"
    return (
        f"{what} is significant, but no held-out error is above the noise by "
        f"{100 * (1 / RELEVANT_RATIO - 1):.0f} %: what it would change is not named"
    )


def withheld(
    engine: SelectionEngine, result: SelectionResult, share: float, note: str
) -> Judgement:
    """Verdict that names no effect, with the reason as a note."""
    verdict: Verdict = "unknown" if share > _UNKNOWN_SHARE else "partly"
    reported = replace(result, final=result.initial_model, noise=result.initial_noise)
    before = (result.initial_model, result.initial_noise)
    return Judgement(verdict, share, output_fits(engine, before, before), reported, (note,))


def named(engine: SelectionEngine, result: SelectionResult, judgement: Judgement) -> Judgement:
    """The same verdict with the names of all additions, which explain a part."""
    before, after = (result.initial_model, result.initial_noise), (result.final, result.noise)
    outputs = output_fits(engine, before, after)
    return Judgement(judgement.verdict, judgement.share, outputs, result, ())


def reweighted_judgement(engine: SelectionEngine, judgement: Judgement) -> Judgement:
    """The same verdict with parameters from the weights of least held-out error."""
    reported = judgement.reported
    best = reweighted(engine, reported.final, reported.noise)
    if best.fit is reported.final:
        return judgement
    before, after = (reported.initial_model, reported.initial_noise), (best.fit, best.noise)
    outputs = output_fits(engine, before, after)
    return replace(
        judgement,
        outputs=outputs,
        reported=replace(reported, final=best.fit, noise=best.noise),
        notes=(*judgement.notes, *best.notes),
    )


def _unexplained(engine: SelectionEngine, result: SelectionResult) -> float:
    """Share of the excess over the noise that the final model leaves, larger of two estimates."""
    folds = engine.folds(result.final, result.noise)
    held_out_errors = [
        held_out_rms(engine.regression, fitted, result.noise, folds)
        for fitted in (result.initial_model, result.final)
    ]
    # Without a lack of fit, an error above the noise floor may be chance.
    expected_excess = {} if result.lack_of_fit else result.noise.uncertainty(engine.regression)

    def excess(rms: Mapping[str, float], known: Mapping[str, float]) -> float:
        """Mean squares beyond the noise and beyond what is known, in units of the noise."""
        return sum(
            max(0.0, (rms[o] ** 2 - known.get(o, 0.0)) / noise**2 - 1 - expected_excess.get(o, 0.0))
            for o, noise in result.noise.rms.items()
        )

    before, after = held_out_errors
    initial = excess(before, {})
    share = excess(after, {}) / initial if initial > 0 else 0.0
    if share > _HELD_OUT_SHARE:
        # Without the discretisation error, as in the lack-of-fit test.
        share = excess(after, engine.discretization_power(result.final, result.noise)) / initial
    if result.noise.from_repeats:
        # Both in units of the final noise, so that a re-estimated noise does not shift the share.
        scale = result.initial_noise.power / result.noise.power
        lacking = float(
            np.sum(np.maximum(result.initial_lack_of_fit_test.excess_power * scale, 0.0))
        )
        left = float(
            np.sum(
                np.maximum(result.lack_of_fit_test.excess_power, 0.0)[
                    result.lack_of_fit_test.rejected
                ]
            )
        )
        share = max(
            share if share > _HELD_OUT_SHARE else 0.0, left / lacking if lacking > 0 else 0.0
        )
    return min(1.0, share)


def _error_ratio(outputs: Mapping[str, OutputFit]) -> float:
    """Held-out error of the later model over the noise, in the output where it is largest."""
    return max(
        fitted.heldout_rms_after / fitted.noise_rms if fitted.noise_rms else np.inf
        for fitted in outputs.values()
    )


def _verdict(result: SelectionResult, outputs: Mapping[str, OutputFit], share: float) -> Verdict:
    if share > _UNKNOWN_SHARE:
        return "unknown"
    if not result.lack_of_fit or not result.noise.from_repeats:
        return "explained" if share < _HELD_OUT_SHARE else "partly"
    # A trace below the noise, e.g. a load that bounces on its cable, is reported and has no effect.
    error_ratio = _error_ratio(outputs)
    # An effect that imitates an unknown one leaves a share of this size; where the lack of fit is
    # certain, the limit is therefore small.
    limit = 0.0
    if error_ratio < _AT_NOISE:
        uncertain = result.lack_of_fit_test.p_value > _UNCERTAIN_P_VALUE
        limit = _EXPLAINED_SHARE_UNCERTAIN if uncertain else _EXPLAINED_SHARE
    elif error_ratio < _NEAR_NOISE:
        limit = _EXPLAINED_SHARE_NEAR_NOISE
    return "explained" if share < limit else "partly"


def output_fits(
    engine: SelectionEngine,
    initial_model: tuple[Fit, Noise],
    final: tuple[Fit, Noise],
    folds: Folds | None = None,
) -> dict[str, OutputFit]:
    """Errors of every output before and after, in sample and held out, with its noise.

    Parameters
    ----------
    engine
        Data, candidates and folds of the search.
    initial_model, final
        Fit and noise of the initial and of the final model.
    folds
        Folds of the held-out errors; None for those that suit the final fit.

    Returns
    -------
    dict
        By output; rms in SI.
    """
    regression, folds = engine.regression, folds or engine.folds(*final)
    noise, leakage = final[1], StopBandLeakage(regression)

    def errors(model: tuple[Fit, Noise]) -> tuple[dict[str, float], ...]:
        """Rms in sample and held out, and what leaks from above the cut-off, by output."""
        held = held_out_rms(regression, *model, folds)
        return _rms(regression, model[0]), held, leakage.residual(model[0].hypothesis)

    first = errors(initial_model)
    before, held_before, leakage_before = first
    after, held_after, leakage_after = first if final is initial_model else errors(final)
    noise_leakage = leakage.noise(final[0].hypothesis)
    source = "repeats" if noise.from_repeats else "saturated fit"
    return {
        output: OutputFit(
            unit=OUTPUT_UNITS[output],
            band=next(s.band.cut_off for s in regression.segments if s.output == output),
            signal_rms=regression.signal_rms(output),
            rms_before=_with(before[output], leakage_before.get(output)),
            rms_after=_with(after[output], leakage_after.get(output)),
            heldout_rms_before=_with(held_before[output], leakage_before.get(output)),
            heldout_rms_after=_with(held_after[output], leakage_after.get(output)),
            noise_rms=_with(noise.rms[output], noise_leakage.get(output)),
            noise_source=source,
        )
        for output in regression.outputs
    }


def _with(rms: float, leakage_power: float | None) -> float:
    """An rms with the mean square above the low-pass's cut-off added."""
    return float(np.hypot(rms, np.sqrt(leakage_power or 0.0)))


def _rms(regression: Regression, fitted: Fit) -> dict[str, float]:
    out = {}
    for output in regression.outputs:
        own = [s for s in regression.segments if s.output == output]
        total = sum(float(np.sum(fitted.residual[s.rows] ** 2)) for s in own)
        out[output] = float(np.sqrt(total / regression.n_samples(output)))
    return out
