"""Runs that are copies of one another: excerpts, every k-th row, rounded values.

Recordings of one motion have independent noise: a difference far below the noise of either shows
that both are one recording. As repeats of each other they would have no noise floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged, bridged_channel
from winchkit.model.line import Line
from winchkit.model.stages import OUTPUTS, Signals
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.runs.sanity.quantisation import resolution
from winchkit.schema.profiles.winch import WinchProfile

COPIES = "repeats-are-copies"
_DEPENDENT = 0.3
"""Median difference over the noise of one recording; of a copy that is rounded to its noise it is
0.25, of independent ones 0.95."""
_LEAST_OVERLAP = 0.5
"""Share of the shorter run's rows from which it is left out as a copy; screened."""
_LEAST_ROWS = 50
"""Rows that two runs must share, and different values that an output must have."""


@dataclass(frozen=True)
class _Recorded:
    """Outputs of a run with the standard deviation of their noise."""

    run: Run
    profile: WinchProfile

    @cached_property
    def outputs(self) -> dict[str, Array]:
        """Measured outputs, interpolated where NaN."""
        return {name: bridged(self.run[name]) for name in OUTPUTS if name in self.run}

    @cached_property
    def local(self) -> dict[str, float]:
        """Noise of every output from differences of neighbours: not less than its noise."""
        return {name: local_noise(values) for name, values in self.outputs.items()}

    @cached_property
    def noise(self) -> dict[str, float]:
        """The same, or that of the residual if it is smaller; of outputs finer than their noise."""
        line = Line(self.profile)
        load = bridged_channel(self.run, "load")
        mass = self.run.load_mass if load is None else None
        angle = bridged(self.run["motor_angle"])
        signals = Signals(self.run.time, angle, load, mass, bridged_channel(self.run, "tension"))
        nominal = line.predict(line.motion(signals))
        out = {}
        for name, values in self.outputs.items():
            own = self.local[name]
            if name in nominal:
                own = min(own, local_noise(values - nominal[name]))
            if own > resolution(values) and len(np.unique(values)) >= _LEAST_ROWS:
                out[name] = own
        return out


def without_copies(
    runs: Sequence[Run], profile: WinchProfile
) -> tuple[list[Run], tuple[Finding, ...]]:
    """Runs in their order without copies of longer ones; per copy a finding with its copied share.

    Rows are compared by number, since stamps may differ, at the lag at which the differences of an
    output correlate most, with every row of the longer run or every k-th. A copy has in every
    output a median absolute difference, less an offset, below 0.3 of the noise of either run.
    An output whose resolution exceeds its noise shows nothing, since independent recordings are
    rounded alike.
    """
    recorded = [_Recorded(run, profile) for run in runs]
    # The longer one is kept; of equal ones the finer one, which has more different values.
    order = sorted(range(len(runs)), key=lambda i: (-len(runs[i]), -_levels(recorded[i])))
    kept: list[int] = []
    findings = []
    for index in order:
        for other in kept:
            share = _copied_share(recorded[other], recorded[index])
            if share:
                findings.append(_finding(runs[index], runs[other], share))
                break
        else:
            kept.append(index)
    return [runs[index] for index in sorted(kept)], tuple(findings)


def _finding(run: Run, kept: Run, share: float) -> Finding:
    text = (
        f"{100 * share:.0f} % of its rows are those of {kept.name}, with the same noise to within "
        "rounding: a copy, no repeat, and left out"
    )
    return Finding(COPIES, run.name, "time", share, text)


def _levels(recorded: _Recorded) -> int:
    return sum(len(np.unique(values)) for values in recorded.outputs.values())


def _copied_share(longer: _Recorded, shorter: _Recorded) -> float:
    """Share of the shorter run's rows that the longer one has; zero where it is no copy."""
    names = [name for name in OUTPUTS if name in longer.outputs and name in shorter.outputs]
    if not names:
        return 0.0
    every = max(1, round(shorter.run.interval / longer.run.interval))
    for first in range(every):
        count, differences = _differences(longer, shorter, names, slice(first, None, every))
        if count < max(_LEAST_ROWS, _LEAST_OVERLAP * len(shorter.run)):
            continue
        if any(differences[n] > _DEPENDENT * longer.local[n] for n in names):
            continue
        # A rounded copy has a resolution; the noise is that of the one that has none.
        noise = {**shorter.noise, **longer.noise}
        if noise and all(differences[n] <= _DEPENDENT * noise[n] for n in names if n in noise):
            return count / len(shorter.run)
    return 0.0


def _differences(
    longer: _Recorded, shorter: _Recorded, names: list[str], rows: slice
) -> tuple[int, dict[str, float]]:
    """Shared rows, and the median absolute difference of every output there, less an offset."""
    count, other = len(shorter.run), len(longer.outputs[names[0]][rows])
    lag = _lag(longer.outputs[names[-1]][rows], shorter.outputs[names[-1]])
    start, stop = max(0, lag), min(other, lag + count)
    out = {}
    for name in names if stop > start else []:
        part = shorter.outputs[name][start - lag : stop - lag]
        difference = longer.outputs[name][rows][start:stop] - part
        out[name] = float(np.median(np.abs(difference - np.median(difference))))
    return stop - start, out


def _lag(whole: Array, part: Array) -> int:
    """Row of ``whole`` at which ``part`` begins by the correlation of their differences."""
    a, b = np.diff(whole), np.diff(part)
    length = next_fast_len(len(a) + len(b), real=True)
    products = irfft(rfft(a, length) * np.conj(rfft(b, length)), length)
    best = int(np.argmax(products))
    return best if best < len(a) else best - length
