"""Health of a load cell from a few seconds of readings, as in Klipper's load cell diagnostic.

All figures are computed from raw counts or values at their estimated sampling times; missing
readings are not interpolated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import RunError

_MAINS = (50.0, 60.0)
"""Hz: the two mains frequencies in use."""
_FEWEST = 20
"""A standard deviation from 20 readings is known to 16 % (1/√(2·19))."""
_SIGNIFICANT = 4.0
"""In standard errors."""
_SETTLED = 0.5
"""Time after a change of load before which creep is not evaluated, s."""
_LONG_ENOUGH = 5.0
"""A shorter recording cannot separate drift from slow noise, s."""
_STEP = 20.0
"""Change of load in standard deviations of the noise."""
_THIRTY_MINUTES = 1800.0
"""s; OIML R 60 and data sheets state creep 30 min after a change of load."""
_ONE_MINUTE = 60.0
"""s, from which creep counts: before it the time of the change itself is uncertain (rule of thumb;
from 10 min on, a third of the creep would be stated)."""
_FADED = 0.05
"""Autocorrelation at which its sum ends: the noise of an estimate from 400 readings (1/√400)."""
_GAP = 2.5
"""Median intervals of a gap, as two lost readings are."""
_NO_CHANCE = -20.0
"""Logarithm of a probability of 2e-9."""
_ALIASED = 0.02
"""Distance of a tone from zero and from half the rate, as a share of the rate, to be separable."""


@dataclass(frozen=True)
class CellSamples:
    """Readings as arrays of one length; values in SI, NaN where not usable."""

    time: Array
    raw: Array
    """Counts; NaN where they are not known."""
    value: Array
    usable: NDArray[np.bool_]
    saturated: NDArray[np.bool_]


@dataclass(frozen=True)
class Hum:
    """Mains hum in the readings."""

    frequency: float
    """Of the mains, Hz."""
    amplitude: float
    """SI; NaN where it is not identifiable at this rate."""
    std: float

    @property
    def there(self) -> bool:
        """Whether the amplitude exceeds four standard errors."""
        return self.amplitude > _SIGNIFICANT * self.std


@dataclass(frozen=True)
class Creep:
    """Creep after a change of load."""

    step: float
    """Change of load, SI."""
    since: float
    """Duration of the readings after it, s."""
    change: float
    """Change of the value between 1 and 30 minutes, extrapolated by the logarithm of time."""
    std: float


@dataclass(frozen=True)
class Health:
    """Figures of a load cell's health."""

    readings: int
    usable: int
    saturated: int
    rate: float
    """Readings per second."""
    longest_gap: float
    """s."""
    unique: int
    """Distinct raw counts."""
    duplicates: float
    """Share of readings equal to the one before."""
    longest_still: float
    """Longest time without a change of the raw counts, s; a gap in the readings is none."""
    is_at_end: bool
    """Whether it was at the end of the range of the readings, as of a converter that saturates."""
    mean: float
    low: float
    high: float
    noise: float
    """Standard deviation about a straight line, SI."""
    noise_counts: float
    drift: float
    """SI per s."""
    drift_std: float
    hum: tuple[Hum, ...]
    creep: Creep | None
    remarks: tuple[str, ...]


def examine(samples: CellSamples) -> Health:
    """Health of a load cell by a few seconds of readings; raises RunError for fewer than 20 usable
    ones."""
    good = samples.usable & np.isfinite(samples.value)
    if int(good.sum()) < _FEWEST:
        raise RunError(
            f"{int(good.sum())} usable readings of {len(good)}; at least {_FEWEST} are needed"
        )
    time, value, raw = samples.time[good], samples.value[good], samples.raw[good]
    at = step_at(value)
    creep = None
    if at is not None:
        creep = _creep(time, value, at)
        time, value, raw = (part[at + 1 :] for part in (time, value, raw))
        late = time > time[0] + _SETTLED
        if int(late.sum()) >= _FEWEST:
            time, value, raw = time[late], value[late], raw[late]
    slope, slope_std, rest = line_fit(time, value)
    words = raw if np.isfinite(raw).all() else value
    still = np.diff(words) == 0
    scale = _scale(raw, value)
    health = Health(
        readings=len(good),
        usable=int(good.sum()),
        saturated=int(samples.saturated.sum()),
        rate=(len(good) - 1) / float(np.ptp(samples.time)),
        longest_gap=float(np.diff(samples.time).max()),
        unique=len(np.unique(words)),
        duplicates=float(still.mean()),
        longest_still=_longest_still(time, words)[0],
        is_at_end=_longest_still(time, words)[1],
        mean=float(value.mean()),
        low=float(value.min()),
        high=float(value.max()),
        noise=float(rest.std(ddof=2)),
        noise_counts=float(rest.std(ddof=2)) / scale if scale > 0 else math.nan,
        drift=slope,
        drift_std=slope_std,
        hum=tuple(_hum(time, rest, frequency) for frequency in _MAINS),
        creep=creep,
        remarks=(),
    )
    return _with_remarks(health, float(np.ptp(samples.time)))


def step_at(value: Array) -> int | None:
    """Index before the largest change between neighbours, if it is a change of load."""
    if len(value) <= 2 * _FEWEST:
        return None
    changes = np.diff(value)
    noise = 1.4826 * float(np.median(np.abs(changes - np.median(changes))))
    # With enough readings on both sides to know the levels.
    at = _FEWEST + int(np.argmax(np.abs(changes[_FEWEST : len(changes) - _FEWEST + 1])))
    before = np.median(value[max(0, at - _FEWEST) : at + 1])
    after = np.median(value[at + 1 : at + 1 + _FEWEST])
    lasting = abs(after - before) > 0.5 * abs(changes[at])
    big = abs(changes[at]) > _STEP * max(noise, 1e-12)
    return at if big and lasting else None


def _creep(time: Array, value: Array, at: int) -> Creep | None:
    """Creep between 1 and 30 minutes from the slope over the logarithm of time since the change."""
    since = time - (time[at] + time[at + 1]) / 2
    late = since > _SETTLED
    if int(late.sum()) < _FEWEST:
        return None
    slope, std, _ = line_fit(np.log(since[late]), value[late])
    decades = math.log(_THIRTY_MINUTES / _ONE_MINUTE)
    step = float(np.median(value[late]) - np.median(value[: at + 1]))
    return Creep(step, float(since[-1]), slope * decades, std * decades)


def line_fit(x: Array, y: Array) -> tuple[float, float, Array]:
    """Slope, its standard error under correlated residuals, and the residuals of the line."""
    centred = x - x.mean()
    spread = float(centred @ centred)
    slope = float(centred @ y) / spread
    rest = y - y.mean() - slope * centred
    std = math.sqrt(float(rest.var(ddof=2)) / spread * _memory(rest))
    return slope, std, rest


def _memory(rest: Array) -> float:
    """Variance inflation by autocorrelation: 1 + 2 Σ ρ_k up to the lag where ρ falls below 5 %."""
    if not rest.any():
        return 1.0
    power = np.abs(np.fft.rfft(rest, 2 * len(rest))) ** 2
    correlation = np.fft.irfft(power)[: max(2, len(rest) // 4)]
    correlation /= correlation[0]
    faded = np.flatnonzero(correlation < _FADED)
    last = faded[0] if len(faded) else len(correlation)
    return max(1.0, 1.0 + 2.0 * float(correlation[1:last].sum()))


def _hum(time: Array, rest: Array, frequency: float) -> Hum:
    """Amplitude of a tone by least squares at the sampling times."""
    # Readings that are left out do not change the rate at which the others alias.
    rate = 1 / float(np.median(np.diff(time)))
    apparent = abs(frequency - rate * round(frequency / rate))
    if apparent < _ALIASED * rate or apparent > (0.5 - _ALIASED) * rate:
        return Hum(frequency, math.nan, math.nan)
    phase = 2 * np.pi * frequency * (time - time[0])
    matrix = np.column_stack([np.cos(phase), np.sin(phase)])
    pair, *_ = np.linalg.lstsq(matrix, rest, rcond=None)
    left = rest - matrix @ pair
    return Hum(frequency, float(np.hypot(*pair)), float(left.std()) * math.sqrt(2 / len(rest)))


def _longest_still(time: Array, raw: Array) -> tuple[float, bool]:
    """Longest time without a change, and whether it is at an end of the range."""
    steps = np.diff(time)
    read = np.append(0.0, np.cumsum(np.minimum(steps, _GAP * np.median(steps))))
    changes = np.flatnonzero(np.diff(raw) != 0) + 1
    edges = np.concatenate([[0], changes, [len(raw) - 1]])
    longest = int(np.argmax(np.diff(read[edges])))
    word = raw[edges[longest]]
    return float(np.diff(read[edges])[longest]), bool(word in (raw.min(), raw.max()))


def _is_stuck(health: Health) -> bool:
    """Whether the longest standstill is no chance among readings that repeat as often as these."""
    length, count = health.longest_still * health.rate, health.readings
    others = (health.duplicates * count - length) / max(1.0, count - length)
    log_chance = math.log(count) + length * math.log(max(others, 1 / count))
    return log_chance < _NO_CHANCE


def _scale(raw: Array, value: Array) -> float:
    """SI per count."""
    spread = float(np.ptp(raw))
    return float(np.ptp(value)) / spread if spread > 0 else math.nan


def is_wrong(health: Health) -> bool:
    """Whether readings are lost, saturated, or stand still where a cell would not."""
    lost = health.saturated or health.usable < health.readings
    return bool(lost or health.unique == 1 or _is_stuck(health))


def lost_readings(health: Health) -> Iterator[str]:
    """Remarks on readings that are saturated or not usable for another reason."""
    lost = health.readings - health.usable - health.saturated
    if health.saturated:
        yield f"{health.saturated} readings are saturated: overload or a broken wire"
    if lost > 0:
        yield f"{lost} readings are unusable"


def _with_remarks(health: Health, duration: float) -> Health:
    """The figures with remarks, worst first."""
    remarks = list(lost_readings(health))
    if health.unique == 1:
        remarks.append("the counts never change: a frozen cell, or a division far above its noise")
    elif health.noise_counts < 0.5:
        remarks.append("the noise is below half a count: the division is too coarse to measure it")
    if health.unique > 1 and _is_stuck(health):
        where = " at the end of their range" if health.is_at_end else ""
        saturates = "it saturates, or " if health.is_at_end else ""
        remarks.append(
            f"the counts stood still{where} for {health.longest_still:.3g} s, although they change "
            f"elsewhere: {saturates}the cell, its converter or the logger was stuck"
        )
    if health.duplicates > 0.5 and health.unique > 1:
        remarks.append(
            f"{health.duplicates:.0%} of the readings repeat the one before: it is polled faster "
            "than it converts, or filtered"
        )
    remarks += [
        f"hum of the mains at {hum.frequency:g} Hz{_alias(hum.frequency, health.rate)}: check "
        "shield and grounding"
        for hum in health.hum
        if hum.there and hum.amplitude > 0.3 * health.noise
    ]
    if abs(health.drift) > _SIGNIFICANT * health.drift_std:
        over = abs(health.drift) * duration
        if over > health.noise and duration > _LONG_ENOUGH:
            remarks.append(
                "it drifted by more than its noise during the test: wait until it is warm"
            )
    if health.creep and abs(health.creep.change) > _SIGNIFICANT * health.creep.std:
        share = abs(health.creep.change / health.creep.step)
        remarks.append(f"it creeps after the change of load: {share:.2%} of it in 30 minutes")
    return replace(health, remarks=tuple(remarks))


def _alias(frequency: float, rate: float) -> str:
    """What else a tone above half the rate may be."""
    apparent = abs(frequency - rate * round(frequency / rate))
    if frequency <= rate / 2:
        return ""
    return f", or a vibration of {apparent:.3g} Hz, which {rate:.3g} readings a second show alike"


def samples_of(rows: Sequence[tuple[float, float, float, bool, bool]]) -> CellSamples:
    """Samples from rows (n, 5): time, s, raw counts, value, usable, saturated."""
    time, raw, value, usable, saturated = (np.array(column) for column in zip(*rows, strict=True))
    return CellSamples(
        time.astype(float),
        raw.astype(float),
        value.astype(float),
        usable.astype(bool),
        saturated.astype(bool),
    )
