"""Decimation of long runs: zero-phase low-pass, then every k-th sample.

The signals of the model (speed, direction, acceleration) are computed at the full rate and
decimated like the measured ones: a friction force that changes its sign within a millisecond is
low-passed alike in measurement and prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged, gaps
from winchkit.diagnosis.data.spectrum import LOST_POWER, highest_frequency
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.line import Motion
from winchkit.model.stages import At
from winchkit.runs.run import Run

_LEAST_SAMPLES = 200_000
"""Samples of all runs from which decimation begins."""
_TARGET_SAMPLES = 90_000
"""Samples that decimation aims at."""
_RELATIVE_CUT_OFF = 0.25
"""Cut-off over the new sampling rate: below it aliases come from three times the cut-off."""
LEAST_RATE = 20.0
"""Least sampling rate that is left, Hz: reversals and lags last about a tenth of a second."""
_TAPS = 10
"""Taps of the anti-alias filter per decimation factor; screened."""
_BETA = 7.857
"""Shape of the Kaiser window for 80 dB stop-band attenuation."""
_CHANNELS = ("motor_angle", "motor_torque", "predicted_torque", "tension", "load", "cable_length")


@dataclass(frozen=True)
class Decimation:
    """Low-pass and decimation by one factor."""

    factor: int
    cut_off: float
    """Hz; unchanged below, half of the amplitude at twice this, nothing from three times this."""

    @property
    def words(self) -> str:
        """Sentence for the notes of a diagnosis."""
        return (
            f"every {_ordinal(self.factor)} sample of the runs, whole up to {self.cut_off:.3g} Hz "
            f"and low-passed above, is compared; less than {LOST_POWER:.0%} of the power of any "
            "channel is above"
        )

    def run(self, run: Run) -> Run:
        """Decimate a measured run; NaN where more than half of the low-pass window is NaN."""
        pieces = _pieces(run.time)
        channels = {
            name: replace(channel, values=self._decimated_channel(channel.values, pieces))
            for name, channel in run.channels.items()
            if name.rpartition(".")[2] in (*_CHANNELS, "motor_velocity", "temperature")
        }
        return replace(run, time=self._every_kth(run.time, pieces), channels=channels)

    def motion(self, motion: Motion) -> Motion:
        """Decimate a motion, each of its signals low-passed by itself."""
        pieces = _pieces(motion.at.time)
        at: dict[str, Any] = {
            field.name: self._low_passed(value, pieces)
            for field in fields(At)
            if isinstance(value := getattr(motion.at, field.name), np.ndarray)
        }
        at["time"] = self._every_kth(motion.at.time, pieces)

        def decimated(values: Array | None) -> Array | None:
            return None if values is None else self._low_passed(values, pieces)

        return replace(
            motion,
            at=replace(motion.at, **at),
            clock=SamplingTimes(at["time"]),
            load=decimated(motion.load),
            drum_tension=decimated(motion.drum_tension),
            discretization=decimated(motion.discretization),
        )

    def _every_kth(self, time: Array, pieces: Sequence[slice]) -> Array:
        return np.concatenate([time[piece][:: self.factor] for piece in pieces])

    def _decimated_channel(self, values: Array, pieces: Sequence[slice]) -> Array:
        finite = np.isfinite(values)
        if finite.all():
            return self._low_passed(values, pieces)
        if not finite.any():
            return self._every_kth(values, pieces)
        share = self._low_passed(finite.astype(float), pieces)
        return np.where(share > 0.5, self._low_passed(bridged(values), pieces), np.nan)

    def _low_passed(self, values: Array, pieces: Sequence[slice]) -> Array:
        """Zero-phase low-pass and decimation, each piece between gaps by itself."""
        from scipy.signal import firwin, upfirdn  # Slow to import, and needed by long runs only.

        reach = _TAPS // 2 * self.factor
        taps = firwin(2 * reach + 1, 1.0 / self.factor, window=("kaiser", _BETA))
        out = []
        for piece in pieces:
            own = values[piece]
            count = -(-len(own) // self.factor)
            if len(own) < 2:
                out.append(own)
                continue
            # Odd reflection about the ends, so that a ramp continues as a ramp.
            padded = np.pad(own, reach, mode="reflect", reflect_type="odd")
            whole = upfirdn(taps, padded, down=self.factor)
            out.append(whole[_TAPS : _TAPS + count])
        return np.concatenate(out)


def _ordinal(number: int) -> str:
    ends = {1: "st", 2: "nd", 3: "rd"}
    return f"{number}{'th' if number % 100 in (11, 12, 13) else ends.get(number % 10, 'th')}"


def decimation_for(runs: Sequence[Run]) -> Decimation | None:
    """One decimation of all runs; None where they are short enough, or their signals too fast.

    The factor is the least of three: about 90,000 samples of all runs, 99 % of every channel's
    power above its white noise (Welch spectra) below the cut-off, and a rate of 20 Hz.
    """
    total, rate = sum(map(len, runs)), 1 / max(run.interval for run in runs)
    if total < _LEAST_SAMPLES:
        return None
    target_factor = -(-total // _TARGET_SAMPLES)
    highest = max(
        (highest_frequency(run[name], rate) for run in runs for name in _CHANNELS if name in run),
        default=0.0,
    )
    allowed = rate * _RELATIVE_CUT_OFF / highest if highest else np.inf
    factor = int(min(target_factor, allowed, rate / LEAST_RATE))
    return Decimation(factor, _RELATIVE_CUT_OFF * rate / factor) if factor > 1 else None


def _pieces(time: Array) -> list[slice]:
    """Slices between gaps in time."""
    ends = gaps(time) + 1
    edges = [0, *ends.tolist(), len(time)]
    return [slice(low, high) for low, high in pairwise(edges)]
