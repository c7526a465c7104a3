"""Columns whose numbers wrap or have lost their sign: restored, reported, or asked."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.importing.assignment import (
    ChosenColumn,
    Question,
    Work,
    clock_of,
    clock_values,
    is_whole,
)
from winchkit.runs.importing.clocks.row_order import after_gaps, rows_in_order
from winchkit.runs.importing.consistency import USUAL_COUNTS
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.stored.numbers import restored, wrap_of
from winchkit.runs.importing.stored.sign_bits import LostSign, lost_sign, sign_by_jumps
from winchkit.runs.importing.units.known import COUNTS, SHARE
from winchkit.schema.mapping import DATE, MODULO

_TURN = 2 * math.pi
_TURNS = {360.0: "deg", _TURN: "rad", 1.0: "turn"}
"""Units of an angle by the number at which it wraps."""
_CLOCKS = (2.0**16, 2.0**32, 2.0**32 / 1000)
"""Ranges of clocks: of counts, and of microseconds that are written in milliseconds."""
_GAP = 2.5
"""Usual steps of a clock, beyond which it may have been set back."""
_RANGES = tuple(2.0**bits for bits in range(8, 33))
"""Ranges of counters: a byte to a double word."""


def settle_stored(work: Work) -> None:
    """Restore the numbers of every column, before units are compared; ask where it is not sure."""
    given = dict(work.answers.modulo)
    lost: dict[tuple[str, str], list[tuple[ChosenColumn, LostSign]]] = {}
    for clock in (item for item in work.columns if item.base == "time"):
        _settle_clock_wrap(work, clock)
    for item in work.columns:
        name = item.column.source
        if item.base in {"time", DATE} or item.column.texts is not None:
            continue
        if given.get(name):
            _restore(item, f"{MODULO} {given[name]:.12g}")
        elif name not in given and _settle_wrap(work, item):
            continue
        elif name not in work.answers.unsigned:
            unit = item.candidate.unit
            is_small = unit is not None and unit.dimension == SHARE
            values = _in_order(work, item)[0]
            sign = lost_sign(values, is_small=is_small)
            if sign is None and item.role in {"motor_velocity", "motor_torque"}:
                sign = sign_by_jumps(values)
            if sign is not None:
                lost.setdefault((_stem(name), sign.stored), []).append((item, sign))
    for items in lost.values():
        _settle_signs(work, items)


def _settle_clock_wrap(work: Work, clock: ChosenColumn) -> None:
    """Unwrap a clock that counts in a field of 16 or 32 bits, where it goes back by all of it."""
    steps = np.diff(clock.column.known)
    back, forward = steps[steps < 0], steps[steps > 0]
    if clock.column.texts is not None or not len(back) or not len(forward):
        return
    name, usual = clock.column.source, float(np.median(forward))
    for modulus in _CLOCKS:
        if np.all((back + modulus > 0) & (back + modulus < _GAP * usual)):
            _restore(clock, f"{MODULO} {modulus:.12g}")
            times = "once" if len(back) == 1 else f"{len(back)} times"
            work.notes.append(f"'{name}' is a clock that wraps at {modulus:.12g} ({times})")


def _in_order(work: Work, item: ChosenColumn) -> tuple[Array, NDArray[np.bool_]]:
    """Values of a column in the order of time, and where rows begin again after a gap."""
    clock = clock_of(work, item)
    times = np.zeros(0) if clock is None else clock_values(clock)
    values = item.column.values
    if len(times) != len(values):
        return values, np.zeros(len(values), dtype=bool)
    kept = rows_in_order(times)
    return values[kept], after_gaps(times[kept])


def _restore(item: ChosenColumn, stored: str) -> None:
    values = restored(item.column.values, stored)
    item.candidate = replace(item.candidate, column=replace(item.column, values=values))
    item.stored = stored


def _settle_wrap(work: Work, item: ChosenColumn) -> bool:
    """Unwrap an angle or a counter by its steps; whether it wraps, for certain or perhaps."""
    usual, rare = _moduli(work, item)
    values, starts = _in_order(work, item)
    wrap = wrap_of(values, usual, rare, starts) if usual else None
    if wrap is None:
        return False
    name = item.column.source
    if wrap.is_sure:
        _restore(item, f"{MODULO} {wrap.modulus:.12g}")
        if item.candidate.unit is None and wrap.modulus in _TURNS and item.factor is None:
            unit = _TURNS[wrap.modulus]
            item.settle(_TURN / wrap.modulus, unit, "derived", f"wraps at {wrap.modulus:.10g}")
        times = "once" if wrap.count == 1 else f"{wrap.count} times"
        work.notes.append(
            f"'{name}' wraps at {wrap.modulus:.10g} ({times}) and is unwrapped; "
            f'--modulo "{name}=0" where it does not'
        )
        return True
    text = (
        f"'{name}' jumps {wrap.count} times by about {wrap.modulus:.4g}, as numbers do that "
        "wrap there; its other steps do not say so for certain"
    )
    if wrap.modulus not in {*usual, *rare}:
        text += "; this number is an estimate: that of the counter or encoder is exact"
    options = (f'--modulo "{name}={wrap.modulus:.12g}"', f'--modulo "{name}=0"')
    work.questions.append(Question(text, options, "modulo"))
    return True


def _moduli(work: Work, item: ChosenColumn) -> tuple[Collection[float], Collection[float]]:
    """Usual and rare moduli of an angle or a counter; none of another column."""
    unit = item.candidate.unit
    if math.isfinite(item.column.modulus):
        return (item.column.modulus,), ()
    if item.role not in {"motor_angle", "cable_length", "swivel"}:
        return (), ()
    if unit is not None and unit.dimension == "angle":
        return tuple(share * _TURN / unit.factor for share in (0.5, 1, 2)), ()
    if is_whole(item) or (unit is not None and unit.dimension == COUNTS):
        own = work.answers.counts_per_turn
        turns = tuple(own * share for share in (1, 0.5, 2)) if own else ()
        return (*_RANGES, 360.0, *turns), [*map(float, USUAL_COUNTS)]
    is_angle = item.base in {"motor_angle", "swivel"}
    return ((360.0, _TURN, 1.0) if unit is None and is_angle else ()), ()


def _stem(name: str) -> str:
    """Words of a name that those of its siblings have, ``speed`` of ``speed (3)``."""
    return " ".join(word for word in words_of(name).split() if not word.isdecimal())


def _settle_signs(work: Work, items: list[tuple[ChosenColumn, LostSign]]) -> None:
    """Restore the signs of columns that are named alike, or ask for them at once."""
    names = [item.column.source for item, _ in items]
    if all(name in work.answers.signed for name in names):
        for item, sign in items:
            _restore(item, sign.stored)
        return
    sign = items[0][1]
    values = "; ".join(f"'{item.column.source}' of {one.text}" for item, one in items)
    text = (
        f"values of {values}: as signed numbers of {sign.bits} bits stored without a sign "
        f"({sign.kind}); are they signed?"
    )
    options = tuple(
        " ".join(f'--{word} "{name}"' for name in names) for word in ("signed", "unsigned")
    )
    work.questions.append(Question(text, options, "signed"))
