"""Ratio of an angle to the integral of a velocity: it determines units, counts and the sign.

The angle is compared with the integral of the velocity, which quantisation and jitter of the stamps
change less than they change a derivative.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.assignment import (
    ChosenColumn,
    Work,
    clock_of,
    clock_values,
    is_counted,
)

_CLEAR = 0.98
"""Least correlation of angle and integral at which their ratio is used."""
_TOLERANCE = 0.02
"""Relative: factors of units differ by more, and calibrations of one machine by less."""
_OVERLOAD = 10.0
"""Torque over the rated one that no servo reaches: peaks are 3 to 5 times as large."""
_TURN = 2 * math.pi
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "turn": _TURN}
_SPEEDS = {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": _TURN / 60, "turn/s": _TURN}
_LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
_LINEAR_SPEEDS = {"m/s": 1.0, "mm/s": 1e-3, "m/min": 1 / 60}
CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""SI value of each unit of a time."""


@dataclass(frozen=True)
class VelocityRatio:
    """Angle over the integral of the velocity, in the numbers of the file."""

    value: float
    """Negative for opposite senses."""
    correlation: float

    def agrees(self, expected: float) -> bool:
        """Whether the magnitude is the expected one, to 2 %."""
        return abs(abs(self.value) / expected - 1) < _TOLERANCE


def ratio_of(time: Array, angle: Array, velocity: Array) -> VelocityRatio | None:
    """Ratio of the change of an angle to the integral of a velocity, all (n,) in any unit.

    With I = ∫ v dt, it is Σ (a − ā)(I − Ī) / Σ (I − Ī)². None where the two are not proportional
    (correlation below 0.98) or constant.
    """
    known = np.isfinite(time) & np.isfinite(angle) & np.isfinite(velocity)
    if np.count_nonzero(known) < 8:
        return None
    t, a, v = time[known], angle[known], velocity[known]
    steps = np.diff(t)
    if np.any(steps < 0):
        return None
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * steps)))
    a, integral = a - a.mean(), integral - integral.mean()
    norm = float(np.sqrt(np.sum(a**2) * np.sum(integral**2)))
    if norm == 0 or not math.isfinite(norm):
        return None
    correlation = float(np.sum(a * integral)) / norm
    if abs(correlation) < _CLEAR:
        return None
    return VelocityRatio(float(np.sum(a * integral) / np.sum(integral**2)), correlation)


def likely_counts(estimate: float) -> int | None:
    """The one usual resolution of an encoder (counts per turn) within 0.5 % of an estimate."""
    near = [n for n in USUAL_COUNTS if abs(estimate / n - 1) < 0.005]
    return near[0] if len(near) == 1 else None


def _usual_counts() -> frozenset[int]:
    lines = (100, 200, 250, 256, 360, 400, 500, 512, 600, 720, 900, 1000, 1024, 1250, 1500, 1800)
    more = (2000, 2048, 2500, 3600, 4000, 4096, 5000, 6400, 8192, 9000, 10_000)
    usual = {2**n for n in range(8, 25)} | {4 * n for n in (*lines, *more)}
    usual |= {360, 3600, 36_000, 360_000, 1000, 10_000, 100_000, 1_000_000}
    return frozenset(usual)


USUAL_COUNTS = _usual_counts()
"""Usual resolutions of encoders, counts per turn."""


def from_velocity(work: Work) -> None:
    """Units, counts and sense from the ratio of the angle to the integral of the velocity."""
    for velocity in [item for item in work.columns if item.role == "motor_velocity"]:
        winch, dot, base = velocity.candidate.channel.rpartition(".")
        wanted = f"{winch}{dot}{'position' if base == 'velocity' else 'motor_angle'}"
        angle = next((i for i in work.columns if i.candidate.channel == wanted), None)
        clock = clock_of(work, velocity)
        if angle is None or clock is None or len(angle.column) != len(velocity.column):
            continue
        times = clock_values(clock)
        if len(times) != len(angle.column):
            continue
        ratio = ratio_of(times, angle.column.values, velocity.column.values)
        if ratio is not None:
            _apply_ratio(work, ratio, angle, velocity, clock)


def beyond_rating(work: Work) -> None:
    """Notes on torques that no motor of the rated torque has."""
    rated = work.answers.rated_torque
    for item in [item for item in work.columns if item.base == "motor_torque" and item.factor]:
        largest = float(np.max(np.abs(item.column.known), initial=0.0))
        times = largest * abs(item.factor or 0) / (rated or 1)
        if rated and times > _OVERLOAD:
            work.notes.append(
                f"'{item.column.source}' reaches {times:.3g} times the rated torque of {rated:g} "
                "N m: is its unit, its sign or the rated torque wrong?"
            )


def _apply_ratio(
    work: Work,
    ratio: VelocityRatio,
    angle: ChosenColumn,
    velocity: ChosenColumn,
    clock: ChosenColumn,
) -> None:
    if angle.factor is not None and velocity.factor is not None and clock.factor is not None:
        expected = velocity.factor * clock.factor / angle.factor
        if not ratio.agrees(abs(expected)):
            share = abs(ratio.value) / abs(expected)
            work.notes.append(
                f"'{angle.column.source}' changes {share:.4g} times as much as the integral of "
                f"'{velocity.column.source}': is a unit, a gear ratio or a resolution wrong?"
            )
            return
    else:
        matches = list(_matches(ratio, angle, velocity, clock))
        for item, index in ((angle, 0), (velocity, 1), (clock, 2)):
            options = {match[index] for match in matches}
            if item.factor is None and len(options) == 1:
                unit, factor = options.pop()
                text = f"ratio of angle and velocity (correlation {abs(ratio.correlation):.4f})"
                item.settle(factor / item.size, unit, "derived", text)
        if velocity.factor is None and angle.factor is not None and clock.factor is not None:
            measured = ratio.value * angle.factor / clock.factor
            work.measured[velocity.column.source] = measured
    if angle.factor and velocity.factor and ratio.value * angle.factor * velocity.factor < 0:
        velocity.factor = -velocity.factor
        velocity.reason += "; sense reversed: it is opposite to the angle"
        work.notes.append(
            f"'{velocity.column.source}' has the opposite sense of '{angle.column.source}'; its "
            "sign is changed"
        )


def _matches(
    ratio: VelocityRatio, angle: ChosenColumn, velocity: ChosenColumn, clock: ChosenColumn
) -> Iterator[tuple[tuple[str, float], tuple[str, float], tuple[str, float]]]:
    """Combinations of units that agree with the ratio."""
    is_linear = angle.base == "position"
    speeds = _options(velocity, _LINEAR_SPEEDS if is_linear else _SPEEDS)
    clocks = _options(clock, CLOCKS)
    counted = is_counted(angle) and not is_linear
    if counted and angle.factor is velocity.factor is None:
        # Counts and counts a second agree for any number of counts in a turn, 360 among them.
        clocks = [stamp for stamp in clocks if not ratio.agrees(stamp[1])]
    for speed in speeds:
        for stamp in clocks:
            if angle.factor is None and counted:
                turn = _TURN * angle.size
                counts = likely_counts(turn * abs(ratio.value / (speed[1] * stamp[1])))
                if counts:
                    yield (f"1/{counts} turn", turn / counts), speed, stamp
                continue
            for unit in _options(angle, _LENGTHS if is_linear else _ANGLES):
                if ratio.agrees(abs(speed[1] * stamp[1] / unit[1])):
                    yield unit, speed, stamp


def _options(item: ChosenColumn, units: dict[str, float]) -> list[tuple[str, float]]:
    if item.factor is not None:
        return [(item.unit, item.factor)]
    return [(unit, value * item.size) for unit, value in units.items()]
