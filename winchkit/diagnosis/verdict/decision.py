"""Verdict: the excess of every output's error over its noise, and the decision that follows.

One number decides: r, the excess that the final model leaves over that of the profile's file,

    E = Σ max(0, e² − n²)/n²,  r = E after / E before,

summed over the outputs, with the held-out error e and the noise n of an output. The noise is the
pure error of repeats or that of the instruments. Without either it has two bounds: below the white
noise (:func:`white_noise`), above the whole residual.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.cross_validation import (
    AT_NOISE,
    excess,
    held_out_rms,
    held_out_samples,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import BandNoise, replicate_rms
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.stop_band_leakage import StopBandLeakage
from winchkit.diagnosis.results import OutputFit, Verdict
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.model.stages import OUTPUT_UNITS

_EXPLAINED, MOSTLY = 0.1, 0.5
"""Largest share that remains of an explained and of a partly explained excess. Of 127 new cases
the truth leaves at most 0.075, and 0.16 where it is very weak; another effect 0.25 and more."""
_NOISY = 0.1
"""Noise over the rms of a signal that does not vary by more: instruments in order have 0.03."""
_BY_CHANCE = 0.001
"""Probability above which a misfit is noise, whatever its size; convention: of 80 sessions of the
shipped spiral bench, which have no effect, seven have an output above 1.1 times its noise."""
_STANDS = 3.0
"""Error of the file's model over the noise from which an output that does not vary is no measured
one: an effect at the noise can cancel a variation by chance."""
_LIMIT = 2.0
"""Standard deviations from the estimate of a white noise to its upper limit, which is taken."""
_UPPER_ROWS = 0.25
"""Share of the highest frequencies of an output from which its white noise is taken."""


def verdict_of(
    outputs: Mapping[str, OutputFit],
    *,
    steps: int,
    noise_known: bool,
    deciding: Collection[str],
    refuted: Collection[str],
    predictable: Callable[[], bool],
) -> Verdict:
    """Verdict by the table of the errors; noise that is not known from repeats or instruments is a
    lower bound. The ``deciding`` outputs vary by more than their noise; what remains is
    ``predictable`` where a free curve or an order predicts a tenth of it.
    """
    counted = {name: output for name, output in outputs.items() if name in deciding}
    at_noise = bool(counted) and all(map(is_at_noise, counted.values()))
    share = remaining_share(counted) if counted else 1.0
    if refuted:
        share, at_noise = 1.0, False
    if not steps and at_noise:
        return "adequate"
    if steps and (share <= _EXPLAINED or at_noise):
        return "explained"
    if steps and share <= MOSTLY:
        return "partly"
    above = not all(map(is_at_noise, outputs.values()))
    decided = noise_known and (deciding or refuted)
    return "unknown" if decided or (above and predictable()) else "undecided"


def is_at_noise(output: OutputFit) -> bool:
    """Whether the final model's held-out error is within ``AT_NOISE`` of the noise, or within what
    the repeats leave open of it.
    """
    if output.noise_rms is None:
        return False
    by_chance = output.p_value is not None and output.p_value > _BY_CHANCE
    return by_chance or output.heldout_rms_after <= AT_NOISE * output.noise_rms


def remaining_share(outputs: Mapping[str, OutputFit]) -> float:
    """r of the module, 0 to 1; zero where nothing was above the noise."""
    noise = {name: output.noise_rms for name, output in outputs.items()}
    before = excess({name: o.heldout_rms_before for name, o in outputs.items()}, noise)
    after = excess({name: o.heldout_rms_after for name, o in outputs.items()}, noise)
    return min(1.0, after / before) if before > 0.0 else 0.0


def white_noise(regression: TimeSeriesRegression, residual: Array) -> dict[str, float]:
    """Rms of the white noise by output, SI: a lower bound of the noise without repeats.

    It is the density of a residual's highest quarter of frequencies over all its frequencies, and
    at least that of the resolution.
    """
    out = {}
    for output in regression.outputs:
        upper = power = floor = passed = count = 0.0
        for segment in (s for s in regression.segments if s.output == output):
            share = float(regression.share_of_row[segment.rows.start])
            gain = np.broadcast_to(segment.band.gain, segment.rows.stop - segment.rows.start)
            first = len(gain) - max(1, round(_UPPER_ROWS * len(gain)))
            power += float(np.sum(residual[segment.rows][first:] ** 2))
            upper += share * float(np.sum(gain[first:] ** 2))
            count += share * (len(gain) - first)
            passed += share * float(np.sum(gain**2))
            bands = regression.band_of_row[segment.rows]
            floor += share * float(np.sum(regression.power_floor[bands]))
        # The variance of a mean square of n normal values is 2/n of its square.
        limit = 1.0 + _LIMIT * np.sqrt(2.0 / max(count, 1.0))
        total = max(limit * power / upper * passed, floor)
        out[output] = float(np.sqrt(total / regression.n_samples(output)))
    return out


@dataclass(frozen=True)
class OutputEvidence:
    """What the outputs say of a model beside their errors."""

    deciding: frozenset[str]
    """Outputs that vary by more than their noise: only these decide on a model."""
    refuted: frozenset[str]
    """Outputs that the model does not predict, or that measure nothing: see :func:`measured`."""


def measured(
    regression: TimeSeriesRegression,
    before: Fit,
    final: Fit,
    noise: BandNoise,
    outputs: Mapping[str, OutputFit],
) -> OutputEvidence:
    """Outputs that decide on a model, and those that refute it.

    An output above its noise refutes the model where each run's own mean predicts it better, beyond
    the standard error of the difference over blocks of time, and by more than the variance of the
    noise: that of a measured input, such as the load, is in the error of the model. An output that
    does not vary measures nothing where the model of the file says that it must vary, or where its
    noise is more than a tenth of its level.
    """
    blocks = regression.blocks
    left = held_out_samples(regression, final, noise, blocks)
    first = regression.in_time(before.residual)
    losses = {output: np.zeros(blocks.count) for output in regression.outputs}
    varied, predicted = dict.fromkeys(losses, 0.0), dict.fromkeys(losses, 0.0)
    means: dict[str, list[float]] = {output: [] for output in losses}
    for segment, own, error, block in zip(regression.segments, first, left, blocks.of, strict=True):
        output = segment.output
        samples, valid = regression.measured_of(segment)
        deviation = _centred(samples, valid)
        varied[output] += float(deviation @ deviation)
        predicted[output] += float(np.sum(_centred(own, valid) ** 2))
        means[output].append(float(np.mean(samples[valid])))
        loss = error**2 - deviation**2 - valid * (outputs[output].noise_rms or 0.0) ** 2
        losses[output] += np.bincount(block, weights=loss, minlength=blocks.count)
    deciding, refuted = set(), set()
    for output, loss in losses.items():
        fitted, count = outputs[output], regression.n_samples(output)
        between = 0.0 if regression.has_run_offsets(output) else float(np.var(means[output]))
        size = fitted.noise_rms or 0.0
        if np.sqrt(varied[output] / count + between) > AT_NOISE * size:
            deciding.add(output)
        if np.sqrt(varied[output] / count) <= AT_NOISE * size and (
            np.sqrt(predicted[output] / count) > _STANDS * size or size > _NOISY * fitted.signal_rms
        ):
            refuted.add(output)
        if not is_at_noise(fitted) and _is_larger(loss[loss != 0.0]):
            refuted.add(output)
    return OutputEvidence(frozenset(deciding), frozenset(refuted))


def _centred(values: Array, valid: NDArray[np.bool_]) -> Array:
    """Values less their mean over the compared samples, zero elsewhere, (n,)."""
    return np.where(valid, values - np.mean(values[valid]), 0.0)


def _is_larger(losses: Array) -> bool:
    """Whether the sum of losses per block exceeds zero by its standard error."""
    if len(losses) < 2:
        return False
    return bool(np.sum(losses) > np.sqrt(len(losses)) * np.std(losses, ddof=1))


def output_fits(
    engine: TimeSeriesSelection,
    initial_model: tuple[Fit, BandNoise],
    final: tuple[Fit, BandNoise],
) -> dict[str, OutputFit]:
    """Errors of every output before and after, in sample and held out, with its noise; rms in SI.
    The folds are those of the final fit.
    """
    regression, folds = engine.regression, engine.folds(*final)
    noise, leakage = final[1], StopBandLeakage(regression)

    def errors(model: tuple[Fit, BandNoise]) -> tuple[dict[str, float], ...]:
        """Rms in sample and held out, and what leaks from above the cut-off, by output."""
        held = held_out_rms(regression, *model, folds)
        return _rms(regression, model[0]), held, leakage.residual(model[0].hypothesis)

    first = errors(initial_model)
    before, held_before, leakage_before = first
    after, held_after, leakage_after = first if final is initial_model else errors(final)
    noise_leakage = leakage.noise(final[0].hypothesis)
    known, unexplained = noise.from_repeats, regression.dataset.unexplained
    p_values = engine.p_values(*final) if known else {}
    p_values = {output: p for output, p in p_values.items() if output not in unexplained}
    source = dict.fromkeys(regression.outputs, "saturated fit" if known else "white noise")
    source |= dict.fromkeys(replicate_rms(regression, final[0].residual), "repeats")
    size = {**noise.rms, **unexplained} if known else white_noise(regression, final[0].residual)
    if any(held_after[output] > AT_NOISE * size[output] for output in size):
        # What coarse samples of a fast motion add to the error is known, and no effect.
        sampled = engine.discretization_power(*final)
        size = {
            output: float(np.hypot(own, sampled[output] ** 0.5)) for output, own in size.items()
        }
    return {
        output: OutputFit(
            unit=OUTPUT_UNITS[output],
            band=next(s.band.cut_off for s in regression.segments if s.output == output),
            signal_rms=regression.signal_rms(output),
            rms_before=_with(before[output], leakage_before.get(output)),
            rms_after=_with(after[output], leakage_after.get(output)),
            heldout_rms_before=_with(held_before[output], leakage_before.get(output)),
            heldout_rms_after=_with(held_after[output], leakage_after.get(output)),
            noise_rms=_with(size[output], noise_leakage.get(output)),
            noise_source=source[output],
            noise_upper=None
            if known
            else _with(max(after[output], size[output]), leakage_after.get(output)),
            p_value=p_values.get(output),
            heldout_on="runs" if engine.grouped(folds) else "parts of the runs",
        )
        for output in regression.outputs
    }


def _with(rms: float, leakage_power: float | None) -> float:
    """An rms with the mean square above the low-pass's cut-off added."""
    return float(np.hypot(rms, np.sqrt(leakage_power or 0.0)))


def _rms(regression: TimeSeriesRegression, fitted: Fit) -> dict[str, float]:
    out = {}
    for output in regression.outputs:
        own = [s for s in regression.segments if s.output == output]
        total = sum(float(np.sum(fitted.residual[s.rows] ** 2)) for s in own)
        out[output] = float(np.sqrt(total / regression.n_samples(output)))
    return out
