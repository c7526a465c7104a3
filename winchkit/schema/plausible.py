"""Plausibility bounds of numbers in files and on the command line, with reasons.

A value beyond its bound is refused when it is read, also by ``winchkit check``. The bounds are
wide; valid but unusual values are warnings (:mod:`winchkit.schema.bench_warnings`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from winchkit.errors import UsageError
from winchkit.units import parse


class Bound(NamedTuple):
    """The largest magnitude of a dimension, and why."""

    value: float
    """SI."""
    why: str


LARGEST: Mapping[str, Bound] = {
    "length": Bound(1e5, "the longest cables of winches, in the deep sea, have some 10 km"),
    "speed": Bound(50.0, "mine hoists and cable cameras run at 20 m/s"),
    "acceleration": Bound(1000.0, "the fastest cable robots reach 430 m/s^2"),
    "angle": Bound(1e8, "a winch motor turns less in its service life"),
    "time": Bound(1e7, "it is 115 days"),
    "frequency": Bound(1e7, "no converter of a load cell is faster"),
    "force": Bound(1e15, "no cable and no frame has a force or a stiffness near it"),
    "torque": Bound(1e9, "no motor or drum of a winch reaches it"),
    "inertia": Bound(1e9, "the largest hoist drums have some 1e7 kg m^2"),
    "torque per current": Bound(1e6, "no motor of a winch is near it"),
    "mass per length": Bound(1e4, "a steel cable of 1 m diameter has 5000 kg/m"),
    "mass": Bound(1e6, "no single cable holds 1000 t"),
    "force per time": Bound(1e12, "no cable breaks so fast"),
    "temperature": Bound(1e4, "no cable withstands it"),
}
"""By dimension; other dimensions and ratios have no general bound."""


def check_size(value: float, dimension: str, text: object) -> float:
    """The value (SI), where it is finite and not beyond its dimension's bound; else UsageError."""
    if not math.isfinite(value):
        raise UsageError(f"'{text}' must be finite; leave the key out where there is no value")
    bound = LARGEST.get(dimension)
    if bound is not None and abs(value) > bound.value:
        from winchkit.units import UNITS

        unit = next(iter(UNITS[dimension]))
        raise UsageError(f"'{text}' must be at most {bound.value:g} {unit}: {bound.why}")
    return value


def typed_quantity(text: str, dimension: str) -> float:
    """``"0.1m/s"`` or ``"0.1 m/s"`` in SI; raises UsageError."""
    return check_size(parse(text, dimension), dimension, text)
