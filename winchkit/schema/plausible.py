"""Bounds beyond which a number in a file or on a command line is taken for a mistake, with reasons.

A value beyond them is refused where it is read: ``winchkit check`` says so, and nothing opens.
They are wide; what is possible but rarely meant is a warning (:func:`doubts`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec, LimitSpec

__all__ = ["LARGEST", "Bound", "check_size", "doubts"]


class Bound(NamedTuple):
    """The largest magnitude of a dimension, and why."""

    value: float
    """SI."""
    why: str


LARGEST: Mapping[str, Bound] = {
    "length": Bound(1e5, "the longest cables of winches, in the deep sea, have some 10 km"),
    "speed": Bound(50.0, "mine hoists and cable cameras run at 20 m/s"),
    "acceleration": Bound(1000.0, "the fastest cable robots reach 430 m/s^2"),
    "angle": Bound(1e8, "a motor turns less in its life on a drum"),
    "time": Bound(1e7, "it is 115 days"),
    "frequency": Bound(1e7, "no converter of a load cell is faster"),
    "force": Bound(1e15, "no cable and no frame has a force or a stiffness near it"),
    "torque": Bound(1e9, "no motor or drum of a winch has it"),
    "mass": Bound(1e6, "no single cable holds 1000 t"),
    "force per time": Bound(1e12, "no cable breaks so fast"),
    "temperature": Bound(1e4, "no cable stands it"),
}
"""By dimension; others, and ratios, have none in general."""
_SLOW_HEARTBEAT = 0.25
"""After 2.5 of them a drive stops by itself: 0.6 s, 0.3 m of cable at 0.5 m/s."""


def check_size(value: float, dimension: str, text: object) -> float:
    """The value, where it is finite and not beyond its dimension's bound; raises UsageError."""
    if not math.isfinite(value):
        raise UsageError(f"'{text}' must be finite; leave the key out where there is no value")
    bound = LARGEST.get(dimension)
    if bound is not None and abs(value) > bound.value:
        from winchkit.units import UNITS

        unit = next(iter(UNITS[dimension]))
        raise UsageError(f"'{text}' must be at most {bound.value:g} {unit}: {bound.why}")
    return value


def doubts(spec: BenchSpec) -> Iterator[tuple[tuple[str, ...], str]]:
    """Limits of a bench file that are possible and rarely meant: the key, and the warning."""
    for name, winch in spec.winch.items():
        yield from _of_limits(("winch", name, "limits"), winch.limits, cell=winch.cell is not None)
    for name, bus in spec.bus.items():
        if bus.kind == "can" and bus.heartbeat > _SLOW_HEARTBEAT:
            yield (
                ("bus", name, "heartbeat"),
                f"{bus.heartbeat:g} s: when this computer dies, the drives go on for up to "
                f"{2.5 * bus.heartbeat:g} s; 50 to 100 ms are usual",
            )


def _of_limits(
    at: tuple[str, ...], limits: LimitSpec, *, cell: bool
) -> Iterator[tuple[tuple[str, ...], str]]:
    if limits.length is None:
        yield (
            at,
            "there are no length limits: the cable may be paid out to its end or wound in to its "
            'stop; declare such as length = ["0.5 m", "9 m"]',
        )
    if limits.tension_high is None:
        yield (
            at,
            "there is no upper tension limit: nothing stops a load that is caught"
            + ("; declare tension_high" if cell else ", and there is no load cell to see it"),
        )
