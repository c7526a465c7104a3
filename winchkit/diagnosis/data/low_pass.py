"""Low-pass of the torque: its cut-off, and what it removes.

Accelerations by differences of a measured angle are mostly noise at high frequencies: the torque is
compared below a cut-off, as in the identification of robots. Cogging of a fast motor is far above
the usual one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from winchkit.arrays import Array
from winchkit.diagnosis.data.harmonics import half_of_samples_per_turn, strongest_harmonic
from winchkit.diagnosis.data.sampling import bridged
from winchkit.diagnosis.data.spectrum import (
    LOST_POWER,
    Band,
    highest_frequency,
    to_frequency,
    to_time,
)
from winchkit.effects.effect import MOTOR_ORDERS
from winchkit.model.line import Motion
from winchkit.model.stages import RESULT_UNITS
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.schema.linear_axis import linear_words

_TORQUE_BAND = 20.0
"""Usual cut-off of the torque, Hz; a tenth of a sampling rate below 200 Hz; convention of robot
identification."""
_HIGHEST_CUT_OFF = 0.4
"""In units of the sampling rate."""
_SAME_RATE = 1.1
"""Ratio of the sampling rates of two runs up to which they have one cut-off; clocks of one logger
differ by less."""
_ABOVE_ORDER = 1.5
"""Cut-off over the frequency of the highest order of a candidate: the filter passes 96 % there."""
_AT_NOISE = 1.1
"""Ratio of an rms to that of the noise from which it is more than noise; as in the verdict."""
_LEVEL = 0.01
"""Probability that the strongest order of noise is named; convention, as the score's."""


@dataclass(frozen=True)
class UnfilteredOutput:
    """One output of one run before the low-pass."""

    angle: Array
    """Of the motor, rad, (n,)."""
    measured: Array
    """(n,), SI."""
    error: Array
    """Measured less predicted, (n,), SI; NaN where it is not compared."""
    rate: float
    """Samples per second."""

    def highest_frequency(self, runs: int, lost: float = 0.0) -> float:
        """Highest frequency at which both the measured output and its error exceed white noise, Hz.

        The error alone exceeds it at high frequencies, where the predicted inertial torque has the
        noise of a measured angle.
        """
        return min(
            highest_frequency(values, self.rate, runs, lost)
            for values in (self.measured, self.error)
        )


def torque_cut_off(runs: Sequence[UnfilteredOutput], speed: float, lost: float = 0.0) -> float:
    """Cut-off of the torque's low-pass, Hz, the same for all runs of a sampling rate.

    It is the lowest of three: the highest frequency at which a torque exceeds its white noise (20
    Hz or a tenth of the rate at least), 1.5 times the frequency of the highest order of a candidate
    at the motor's highest ``speed`` in rad/s (20 Hz at least), and 0.4 of the sampling rate.
    """
    rate = min(run.rate for run in runs)
    usual = min(_TORQUE_BAND, rate / 10)
    order = _ABOVE_ORDER * MOTOR_ORDERS[-1] * speed / (2 * np.pi)
    highest = max(run.highest_frequency(len(runs), lost) for run in runs)
    return min(max(usual, highest), max(_TORQUE_BAND, order), _HIGHEST_CUT_OFF * rate)


def cut_offs_of(
    runs: Sequence[Run],
    nominal: Sequence[Mapping[str, Array]],
    stands: Sequence[NDArray[np.bool_]],
    motions: Sequence[Motion],
) -> list[float | None]:
    """Cut-off of the torque's low-pass of every run, Hz; None for a run without a torque, and where
    an order of the motor angle is above the highest cut-off.

    The acceleration of a known weight by differences of samples is too small at high frequencies: 1
    % of the power may lie above the cut-off there.
    """
    compared = {
        index: UnfilteredOutput(
            motion.at.motor_angle,
            run["motor_torque"],
            np.where(still, 0.0, run["motor_torque"] - own["motor_torque"]),
            1 / run.interval,
        )
        for index, (run, own, still, motion) in enumerate(
            zip(runs, nominal, stands, motions, strict=True)
        )
        if "motor_torque" in run
    }
    speed = max(float(np.max(np.abs(motion.at.motor_rate))) for motion in motions)
    weighed = any(motion.load_mass is not None for motion in motions)
    out: list[float | None] = [None] * len(runs)
    found: dict[tuple[int, ...], float | None] = {}
    for index, run in compared.items():
        ratios = {other: one.rate / run.rate for other, one in compared.items()}
        alike = tuple(o for o, ratio in ratios.items() if 1 / _SAME_RATE < ratio < _SAME_RATE)
        if alike not in found:
            own_runs = [compared[other] for other in alike]
            cut_off = torque_cut_off(own_runs, speed, weighed * LOST_POWER)
            highest = _HIGHEST_CUT_OFF * min(one.rate for one in own_runs)
            lost = cut_off >= highest and removed_by_low_pass(own_runs, "", cut_off).order
            found[alike] = None if lost else cut_off
        out[index] = found[alike]
    return out


@dataclass(frozen=True)
class RemovedBand:
    """What the low-pass of an output removes from measured less predicted, SI."""

    output: str
    cut_off: float
    """Hz."""
    rms: float
    above_noise: bool
    """Whether it contains more than white noise."""
    order: int | None
    """Its strongest order of the motor angle; None where that is within white noise."""
    amplitude: float | None
    """Amplitude of that order."""

    @property
    def text(self) -> str:
        """One sentence without a full stop."""
        unit = RESULT_UNITS[self.output]
        text = f"the low-pass at {self.cut_off:.3g} Hz removes {quantity(self.rms, unit)} rms"
        if not self.above_noise:
            return f"{text}, which is white noise"
        if self.order is not None and self.amplitude is not None:
            own = quantity(self.amplitude, unit)
            often = f"{self.order} periods per motor turn"
            often = linear_words(often) if self.output == "force" else often
            text = f"{text}, of it {own} at {often}"
        return f"{text}: more than white noise; --band HZ sets another cut-off"

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Finding where it is more than white noise; value: its rms, SI."""
        found = Finding("low-passed", "", self.output, self.rms, self.text)
        return (found,) if self.above_noise else ()


def removed_by_low_pass(
    runs: Sequence[UnfilteredOutput], output: str, cut_off: float
) -> RemovedBand:
    """What a low-pass with a cut-off in Hz removes from the errors of an output in all runs.

    The white noise is that of the upper half of the frequencies, from the median of the squared
    coefficients of the cosine transform.
    """
    angles, removed, noise = [], [], 0.0
    for run in runs:
        known, band = np.isfinite(run.error), Band(len(run.error), run.rate, cut_off, np.inf)
        coefficients = to_frequency(bridged(run.error), replace(band, cut_off=None))
        removed.append(to_time((1 - band.gain) * coefficients, band)[known])
        angles.append(run.angle[known])
        white = np.median(coefficients[band.count // 2 :] ** 2) / chdtri(1, 0.5)
        noise += float(white * np.mean((1 - band.gain) ** 2) * np.count_nonzero(known))
    lost = np.concatenate(removed)
    mean_square = float(np.mean(lost**2))
    above = mean_square > _AT_NOISE**2 * noise / len(lost) and any(
        run.highest_frequency(len(runs)) > cut_off for run in runs
    )
    orders = max(half_of_samples_per_turn(angles), int(MOTOR_ORDERS[-1]))
    found = strongest_harmonic(np.concatenate(angles), lost, orders)
    order, share = found if above and found is not None else (None, 0.0)
    if share <= 2 * np.log(orders / _LEVEL) / len(lost):
        order = None
    amplitude = None if order is None else float(np.sqrt(2 * share * mean_square))
    return RemovedBand(output, cut_off, float(np.sqrt(mean_square)), above, order, amplitude)
