"""What a residual follows: the share of it that each variable's bins explain."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.variables import ANGLES, COMPOUND, VARIABLES

__all__ = [
    "BINS",
    "Followed",
    "binned_share",
    "by_chance",
    "follows",
    "harmonics",
    "kept_rows",
    "quantile_bins",
    "ranked",
    "variables_of",
]

BINS = 16
"""Over a variable."""
_ORDERS = 40
_WORTH = 0.02
_CLEARLY = 0.05
"""Share that two variables at once must tell beyond either of them."""


@dataclass(frozen=True)
class Followed:
    """One variable and the share of an output's residual power that it explains."""

    output: str
    variable: str
    share: float
    order: int | None = None
    """Periods per turn of the variable, where it is an angle."""
    frequency: float | None = None
    line: str | None = None
    """Of a robot, or the axis of its platform's position, where one alone has most of it."""


class _Shared(Protocol):
    @property
    def variable(self) -> str: ...
    @property
    def share(self) -> float: ...


_S = TypeVar("_S", bound=_Shared)


def variables_of(recording: Recording) -> dict[str, Array]:
    """The variables that a residual may follow along one run, (n,) each."""
    known = [name for name in VARIABLES if name not in ("load", "tension", "temperature")]
    out = {name: VARIABLES[name](recording.raw.at) for name in known}
    if recording.raw.load is not None:
        out["load"] = VARIABLES["load"](recording.smooth.at)
    elif recording.raw.drum_tension is not None:
        out["tension"] = VARIABLES["tension"](recording.smooth.at)
    if recording.signals.temperature is not None:
        out["temperature"] = VARIABLES["temperature"](recording.smooth.at)
    return out


def follows(regression: TimeSeriesRegression, residual: Array) -> list[Followed]:
    """Per output the variables that its residual follows, largest share first."""
    times = regression.in_time(residual)
    out: list[Followed] = []
    known = [variables_of(recording) for recording in regression.dataset.recordings]
    for output in regression.dataset.outputs:
        own = [
            (s, t) for s, t in zip(regression.segments, times, strict=True) if s.output == output
        ]
        valid = [regression.dataset.recordings[s.run].valid[output] for s, _ in own]
        error = np.concatenate([t[v] for (_, t), v in zip(own, valid, strict=True)])
        found, kept = [], kept_rows(regression, output)
        for name in known[own[0][0].run]:
            if any(name not in known[s.run] for s, _ in own):
                continue
            values = [known[s.run][name][v] for (s, _), v in zip(own, valid, strict=True)]
            share = binned_share(np.concatenate(values), error, kept)
            if share > by_chance(BINS, kept):
                found.append(Followed(output, name, share))
        out += ranked(found)
    return out


def ranked(found: Iterable[_S]) -> list[_S]:
    """Largest share first; two variables at once only where they tell clearly more than either."""
    shares = {item.variable: item.share for item in found}

    def needless(item: _S) -> bool:
        parts = COMPOUND.get(item.variable, ())
        return any(item.share < shares.get(part, 0.0) + _CLEARLY for part in parts)

    return sorted((item for item in found if not needless(item)), key=lambda item: -item.share)


def harmonics(regression: TimeSeriesRegression, residual: Array) -> list[Followed]:
    """Per output and angle the order whose sine takes most of the residual."""
    times = regression.in_time(residual)
    out = []
    for output in regression.dataset.outputs:
        own = [
            (s, t) for s, t in zip(regression.segments, times, strict=True) if s.output == output
        ]
        error = np.concatenate([t for _, t in own])
        for name in ANGLES:
            angle = np.concatenate(
                [VARIABLES[name](regression.dataset.recordings[s.run].raw.at) for s, _ in own]
            )
            shares = _harmonic_shares(angle, error)
            best = int(np.argmax(shares))
            if shares[best] > _WORTH:
                out.append(Followed(output, name, float(shares[best]), order=best + 1))
    return sorted(out, key=lambda f: -f.share)


def kept_rows(regression: TimeSeriesRegression, output: str) -> int:
    """Independent values of an output: what its low-pass keeps, fewer than its samples."""
    return sum(s.rows.stop - s.rows.start for s in regression.segments if s.output == output)


def by_chance(bins: int, kept: int) -> float:
    """Share that chance hardly reaches: three standard deviations of a chi-square of the bins."""
    return max(_WORTH, 3 * float(np.sqrt(2 * bins)) / kept)


def binned_share(variable: Array, error: Array, kept: int) -> float:
    """Share of the error's power in its means over bins of the variable, less what chance gives.

    Chance gives one part in ``kept`` per bin, whatever the number of samples.
    """
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
    """The bin of every sample, each of as many samples as repeated values allow."""
    edges = np.unique(np.quantile(variable, np.linspace(0, 1, BINS + 1)[1:-1]))
    return np.searchsorted(edges, variable, side="right")


def _harmonic_shares(angle: Array, error: Array) -> Array:
    """Share of the error's power that a sine of each order takes, (orders,).

    Sines of one order are powers of those of the first, and their products sines of twice it.
    """
    total = float(error @ error)
    if total == 0.0:
        return np.zeros(_ORDERS)
    first = np.exp(1j * angle)
    power, own = first.copy(), error.astype(complex)
    gradient, sums = np.empty(_ORDERS, dtype=complex), np.empty(2 * _ORDERS, dtype=complex)
    for order in range(2 * _ORDERS):
        sums[order] = power.sum()
        if order < _ORDERS:
            gradient[order] = power @ own
        power *= first
    twice, count = sums[1::2], len(angle)
    normal = np.empty((_ORDERS, 2, 2))
    normal[:, 0, 0], normal[:, 1, 1] = (count + twice.real) / 2, (count - twice.real) / 2
    normal[:, 0, 1] = normal[:, 1, 0] = twice.imag / 2
    # An angle that hardly moves has no orders.
    turned = np.linalg.cond(normal) <= 1e6
    toward = np.stack([gradient.real, gradient.imag], axis=1)[turned]
    out = np.zeros(_ORDERS)
    solved = np.linalg.solve(normal[turned], toward[:, :, None])[:, :, 0]
    out[turned] = np.sum(toward * solved, axis=1) / total
    return out
