"""Numbers as they are stored: modulo a turn or a counter's range, or without their sign.

A counter that wraps is unwrapped by its steps: of all numbers that are equal modulo M to the next
one, the nearest to the one before is taken.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.schema.mapping import EULER, MAGNITUDE, MODULO, TWOS, VECTOR

_FIELDS = (2.0**16, 2.0**24, 2.0**32)
"""Ranges of the fields of counters, whose numbers may be negative ones stored without a sign."""
_FEWEST = 20
"""Values below which a step of another size may be chance."""
_CLEAR = 0.25
"""Share of the modulus below which the other steps are: of half of it the direction is unknown."""
_FILLED = 0.7
"""Share of the modulus that numbers fill which pass its end with steps of a quarter at most."""
_WHOLE, _MANY = 0.95, 0.05
"""Share of the modulus that numbers fill, and of steps that are jumps, of a motion that is too fast
for its samples."""
_ROUNDED = 1e-4
"""Share of the modulus by which rounded numbers may exceed it."""


@dataclass(frozen=True)
class Wrap:
    """Numbers that return to the start of their range."""

    modulus: float
    count: int
    """Steps over the end of the range."""
    is_sure: bool
    """Whether the modulus is a usual one and the other steps are far below it."""


def restored(values: Array, stored: str) -> Array:
    """Numbers (n,) with their sign and without wraps.

    ``stored``: ``modulo 360``, ``two's complement 65536``, ``sign and magnitude 2048``, or empty.
    """
    if stored in {"", VECTOR, EULER}:
        return values
    kind, _, text = stored.rpartition(" ")
    modulus = float(text)
    if kind == MODULO:
        return _unwrapped(values, modulus)
    half = modulus / 2
    negative = values - modulus if kind == TWOS else half - values
    assert kind in {TWOS, MAGNITUDE}
    return np.where(values >= half, negative, values)


def range_of(stored: str) -> float:
    """Modulus of numbers that wrap; infinite for others."""
    kind, _, text = stored.rpartition(" ")
    return float(text) if kind == MODULO else math.inf


def _unwrapped(values: Array, modulus: float) -> Array:
    known = np.isfinite(values)
    own = values[known]
    if not len(own):
        return values
    turns = np.concatenate(([0.0], np.cumsum(np.round(np.diff(own) / modulus))))
    # A counter in a field of bits that starts in its upper half is below zero.
    turns += float(np.round(own[0] / modulus)) if modulus in _FIELDS else 0.0
    found = values.copy()
    found[known] = own - modulus * turns
    return found


def wrap_of(
    values: Array,
    usual: Collection[float],
    rare: Collection[float] = (),
    starts: NDArray[np.bool_] | None = None,
) -> Wrap | None:
    """Modulus of numbers (n,) that wrap, by their steps; an estimate if neither usual nor rare.

    ``starts``: where stretches of rows without a gap begin (n,), whose first steps say nothing.

    One step is enough for a ``usual`` one: a turn in the unit of the column, a counter's range. A
    step beyond half of the range of the numbers is a wrap of modulus M where the motion continues
    over it: step ± M differs from the steps before and after it by no more than twice the largest
    change from one other step to the next, which is below M/4. No numbers are more than M apart.
    """
    known = np.isfinite(values)
    own = values[known]
    if len(own) < _FEWEST:
        return None
    steps, span = np.diff(own), float(np.ptp(own))
    stretch = np.cumsum(np.zeros(len(values)) if starts is None else starts)[known]
    is_inside = np.diff(stretch) == 0
    is_jump = np.abs(steps) > span / 2
    plain, at = np.flatnonzero(is_inside & ~is_jump), np.flatnonzero(is_inside & is_jump)
    if not span or not len(at) or len(plain) < _FEWEST // 2:
        return None
    largest = float(np.max(np.abs(steps[plain])))
    sizes = np.abs(np.interp(at, plain, steps[plain]) - steps[at])
    is_next = np.diff(stretch[plain]) == 0
    bend = 2 * float(np.max(np.abs(np.diff(steps[plain])[is_next]), initial=0.0))
    fitting = [
        modulus
        for modulus in {*usual, *(rare if len(at) > 1 else ())}
        if span <= modulus * (1 + _ROUNDED)
        and bend < _CLEAR * modulus
        and np.any(np.abs(steps[at]) != modulus)
        and 2 * np.count_nonzero(np.abs(sizes - modulus) <= bend) > len(at)
    ]
    size = float(np.median(sizes))
    best = sorted(fitting, key=lambda modulus: abs(size - modulus))
    turns = [m for m in usual if _WHOLE * m < span <= m * (1 + _ROUNDED)]
    if not best and turns and len(at) > _MANY * len(steps):
        # It fills a turn by jumps: it wraps, so fast that its steps do not say where.
        return Wrap(min(turns), len(at), is_sure=False)
    if best:
        is_near = len(best) > 1 and abs(size - best[1]) < 3 * abs(size - best[0])
        is_fast = largest > _CLEAR * best[0]
        is_filled = span > _FILLED * best[0]
        return Wrap(best[0], len(at), is_sure=not (is_fast or is_near)) if is_filled else None
    is_even = len(at) > 2 and float(np.ptp(sizes)) <= bend and span <= size
    return Wrap(size, len(at), is_sure=False) if is_even and largest < _CLEAR * size else None
