"""Residual attribution: share of the residual variance that each variable explains.

Correlation ratio η² over bins of equal counts, less its expectation under independence, and the
share of a sine per order of an angle.

References
----------
Pearson, K. (1905). On the general theory of skew correlation and non-linear regression. Dulau.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.data.harmonics import half_of_samples_per_turn, strongest_harmonic
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.variables import ANGLES, COMPOUND, VARIABLES
from winchkit.schema.profiles.axis import AxisProfile

BINS = 16
"""Bins per variable."""
_LEVEL = 0.01
"""Probability that independent residuals have an order; convention, as the score's."""
_OF_THE_CABLE = "cable_length", "directed_length"
"""Variables of a cable, which an axis lacks."""
_WHERE_MEASURED = "load", "tension", "directed_load", "directed_tension", "temperature"
"""Variables of runs that have the channel, or a known load."""
LEAST_SHARE = 0.02
"""Least share of the variance that is reported."""
_TIME = "time"
"""Variable that is no cause."""
LEAST_TEMPERATURE_RANGE = 1.0
"""Range below which the temperature counts as constant, K: noise of the thermometer."""
MOST_PLACES = 6
"""Lines of residual attribution that are reported."""
_SAME_BINS = 0.95
"""Share of samples in the same bins, above which two variables are names of one, such as drum and
motor angle; the rest is play and the ends of bins."""
_LEAST_JOINT_GAIN = 0.05
"""Share that two variables together must explain beyond either of them."""


@dataclass(frozen=True)
class Attribution:
    """A variable and the share of an output's residual variance that it explains."""

    output: str
    variable: str
    share: float
    order: int | None = None
    """Periods per turn, where the variable is an angle."""
    frequency: float | None = None
    """Middle of the band, Hz, where the variable is the time."""
    line: str | None = None
    """Line of a robot, or axis of its platform, that has most of the share."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints: order, frequency and line only where present."""
        return {key: value for key, value in vars(self).items() if value is not None}


class _HasShare(Protocol):
    @property
    def variable(self) -> str: ...
    @property
    def share(self) -> float: ...


_S = TypeVar("_S", bound=_HasShare)


def variables_of(recording: Recording) -> dict[str, Array]:
    """Variables that may explain a residual along one run, (n,) each."""
    known = [name for name in VARIABLES if name not in _WHERE_MEASURED]
    profile = recording.raw.at.profile
    if isinstance(profile, AxisProfile):
        known = ["motor_angle", *(n for n in known if n not in {"motor_angle", *_OF_THE_CABLE})]
    if profile.is_linear:
        known.remove("drum_angle")
    out = {name: VARIABLES[name](recording.raw.at) for name in known}
    if recording.raw.load is not None:
        out |= _smooth(recording, "load", "directed_load")
    elif recording.raw.drum_tension is not None:
        out |= _smooth(recording, "tension", "directed_tension")
    if recording.signals.temperature is not None:
        out |= _smooth(recording, "temperature")
    return out


def _smooth(recording: Recording, *names: str) -> dict[str, Array]:
    """Variables with the noise of an instrument, from its smoothed signal."""
    return {name: VARIABLES[name](recording.smooth.at) for name in names}


def attributions(regression: TimeSeriesRegression, residual: Array) -> list[Attribution]:
    """Per output the variables that explain its residual, largest share first.

    Their share exceeds 2 % and three standard deviations of its null distribution; of several names
    of one variable the first is kept. The time, over which every motion that all runs have in
    common repeats, is kept only where no other variable explains as much.
    """
    out: list[Attribution] = []
    known = [variables_of(recording) for recording in regression.dataset.recordings]
    for output in regression.dataset.outputs:
        runs = [s.run for s in regression.segments if s.output == output]
        valid = [regression.dataset.recordings[run].valid[output] for run in runs]
        error = regression.compared_samples(residual, output)
        found, seen, kept = [], list[NDArray[np.intp]](), kept_rows(regression, output)
        for name in known[runs[0]]:
            if any(name not in known[run] for run in runs):
                continue
            parts = [known[run][name][v] for run, v in zip(runs, valid, strict=True)]
            values = np.concatenate(parts)
            bins = quantile_bins(values)
            if any(_are_one(bins, other) for other in seen):
                continue
            seen.append(bins)
            share = binned_share(values, error, kept)
            if share > chance_share(BINS, kept):
                found.append(Attribution(output, name, share))
        most = max((item.share for item in found if item.variable != _TIME), default=0.0)
        out += ranked([item for item in found if item.variable != _TIME or item.share > most])
    return out


def _are_one(bins: NDArray[np.intp], other: NDArray[np.intp]) -> bool:
    """Whether two variables rise or fall together, but for play and rounding."""
    same = max(np.mean(bins == other), np.mean(bins == np.max(other) - other))
    return bool(np.ptp(bins) > 0 and same > _SAME_BINS)


def ranked(found: Sequence[_S]) -> list[_S]:
    """Largest share first; products of two variables only where they explain clearly more."""
    shares = {item.variable: item.share for item in found}

    def redundant(item: _S) -> bool:
        parts = COMPOUND.get(item.variable, ())
        return any(item.share < shares.get(part, 0.0) + _LEAST_JOINT_GAIN for part in parts)

    return sorted((item for item in found if not redundant(item)), key=lambda item: -item.share)


def harmonics(regression: TimeSeriesRegression, residual: Array) -> list[Attribution]:
    """Per output and angle the order whose sine explains most of the residual, largest share first.

    Orders reach up to half the samples per turn, and the motion holds two whole periods of each.
    The share is above 2 %, and above what the largest of all orders explains of independent
    residuals in 1 % of cases.
    """
    times = regression.in_time(residual)
    out = []
    for output in regression.dataset.outputs:
        own = [
            (s, t) for s, t in zip(regression.segments, times, strict=True) if s.output == output
        ]
        error = np.concatenate([t for _, t in own])
        for name in ANGLES[1:] if regression.dataset.profile.is_linear else ANGLES:
            angles = [VARIABLES[name](regression.dataset.recordings[s.run].raw.at) for s, _ in own]
            orders = half_of_samples_per_turn(angles)
            found = strongest_harmonic(np.concatenate(angles), error, orders)
            if found is None:
                continue
            by_chance = 2 * float(np.log(orders / _LEVEL)) / kept_rows(regression, output)
            if found[1] > max(LEAST_SHARE, by_chance):
                out.append(Attribution(output, name, found[1], order=found[0]))
    return sorted(out, key=lambda f: -f.share)


def kept_rows(regression: TimeSeriesRegression, output: str) -> int:
    """Number of independent values of an output: coefficients that its low-pass keeps, weighted by
    the share of each run that is compared."""
    return max(1, round(regression.compared_rows(output)))


def chance_share(bins: int, kept: int) -> float:
    """Share that independent residuals hardly reach: 3 √(2 bins) / rows, at least 2 %."""
    return max(LEAST_SHARE, 3 * float(np.sqrt(2 * bins)) / kept)


def binned_share(variable: Array, error: Array, kept: int) -> float:
    """Correlation ratio η² = Σ nᵦ mᵦ² / Σ e² over bins of mean m, less (number of bins) / kept."""
    total = float(error @ error)
    if total == 0.0 or np.ptp(variable) == 0.0:
        return 0.0
    bins = quantile_bins(variable)
    count = np.bincount(bins)
    sums = np.bincount(bins, weights=error)
    used = count > 0
    between = float(np.sum(sums[used] ** 2 / count[used]))
    chance = total * np.count_nonzero(used) / kept
    return max(0.0, (between - chance) / total)


def quantile_bins(variable: Array) -> NDArray[np.intp]:
    """Bin of every sample; bins hold equal counts as far as ties allow."""
    return np.searchsorted(quantile_edges(variable, BINS), variable, side="right")


def quantile_edges(values: Array, bins: int) -> Array:
    """Inner edges, sorted, of at most ``bins`` bins of equal counts as far as ties allow."""
    return np.unique(np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1]))
