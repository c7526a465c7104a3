"""Runs that are copies of one another: excerpts, every k-th row, rounded values.

Two recordings of one motion have independent noise, so that their difference has the variance of
both. A difference far below the noise of one recording alone shows that the two are one recording.
As repeats of each other they would have a noise floor of nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged
from winchkit.model.line import Line
from winchkit.model.stages import OUTPUTS, Signals
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.runs.sanity.quantisation import resolution
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["COPIES", "without_copies"]

COPIES = "repeats-are-copies"
_DEPENDENT = 0.1
"""Median difference over the noise of one recording; of independent ones it is 0.95."""
_LEAST_OVERLAP = 0.5
_LEAST_ROWS = 50
"""Rows that two runs must share, and different values that an output must have."""


@dataclass(frozen=True)
class _Recorded:
    """Outputs of a run with the standard deviation of their noise."""

    run: Run
    outputs: dict[str, Array]
    noise: dict[str, float]
    """Of outputs whose noise is above their resolution."""


def without_copies(
    runs: Sequence[Run], profile: WinchProfile
) -> tuple[list[Run], tuple[Finding, ...]]:
    """Runs without those that are copies of longer ones.

    Parameters
    ----------
    runs
        Validated runs.
    profile
        Winch profile.

    Returns
    -------
    kept : list of Run
        In their order.
    findings : tuple of Finding
        ``repeats-are-copies`` of every run that was left out; value: the share of its rows that the
        kept run has.

    Notes
    -----
    Rows are compared by their number, so that stamps may differ: at the lag at which the
    differences of an output correlate most, with every row of the longer run or every k-th. A copy
    has in every output a median absolute difference, less an offset, below a tenth of the noise of
    either run. The noise is the smaller of that of the output and of its residual, each from
    differences of neighbours; an output whose resolution exceeds its noise shows nothing, since
    independent recordings are rounded alike.
    """
    recorded = [_recorded(run, profile) for run in runs]
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
        f"{share:.0%} of its rows are those of {kept.name}, with the same noise to within "
        "rounding: a copy, no repeat, and left out"
    )
    return Finding(COPIES, run.name, "time", share, text)


def _recorded(run: Run, profile: WinchProfile) -> _Recorded:
    line = Line(profile)
    load = bridged(run["load"]) if "load" in run and np.isfinite(run["load"]).any() else None
    tension = bridged(run["tension"]) if "tension" in run else None
    signals = Signals(
        run.time,
        bridged(run["motor_angle"]),
        load,
        run.load_mass if load is None else None,
        tension,
    )
    nominal = line.predict(line.motion(signals))
    outputs = {name: bridged(run[name]) for name in OUTPUTS if name in run}
    noise = {}
    for name, values in outputs.items():
        own = local_noise(values)
        if name in nominal:
            own = min(own, local_noise(values - nominal[name]))
        if own > resolution(values) and len(np.unique(values)) >= _LEAST_ROWS:
            noise[name] = own
    return _Recorded(run, outputs, noise)


def _levels(recorded: _Recorded) -> int:
    return sum(len(np.unique(values)) for values in recorded.outputs.values())


def _copied_share(longer: _Recorded, shorter: _Recorded) -> float:
    """Share of the shorter run's rows that the longer one has; zero where it is no copy."""
    # A rounded copy has a resolution; the noise is that of the one that has none.
    noise = {**shorter.noise, **longer.noise}
    shared = [name for name in OUTPUTS if name in longer.outputs and name in shorter.outputs]
    decisive = [name for name in shared if name in noise]
    if not decisive:
        return 0.0
    every = max(1, round(shorter.run.interval / longer.run.interval))
    for first in range(every):
        share = _agreement(longer, shorter, noise, decisive, slice(first, None, every))
        if share:
            return share
    return 0.0


def _agreement(
    longer: _Recorded, shorter: _Recorded, noise: dict[str, float], names: list[str], rows: slice
) -> float:
    whole = {name: longer.outputs[name][rows] for name in names}
    count, other = len(shorter.run), len(whole[names[0]])
    lag = _lag(whole[names[-1]], shorter.outputs[names[-1]])
    start, stop = max(0, lag), min(other, lag + count)
    if stop - start < max(_LEAST_ROWS, _LEAST_OVERLAP * count):
        return 0.0
    for name in names:
        difference = whole[name][start:stop] - shorter.outputs[name][start - lag : stop - lag]
        if np.median(np.abs(difference - np.median(difference))) > _DEPENDENT * noise[name]:
            return 0.0
    return (stop - start) / count


def _lag(whole: Array, part: Array) -> int:
    """Row of ``whole`` at which ``part`` begins by the correlation of their differences."""
    a, b = np.diff(whole), np.diff(part)
    length = next_fast_len(len(a) + len(b), real=True)
    products = irfft(rfft(a, length) * np.conj(rfft(b, length)), length)
    best = int(np.argmax(products))
    return best if best < len(a) else best - length
