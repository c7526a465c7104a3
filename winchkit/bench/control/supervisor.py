"""Supervision of every winch in each cycle: conditions that forbid motion, and trips.

Free of buses and threads: it is given the time and what is known, and remembers only what a
condition needs (debounce, rates, boot-ups) and the trips that it latched.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from operator import gt
from typing import NamedTuple

from winchkit.bench.control.conditions import CONDITIONS, Condition, Exceeds, Test
from winchkit.bench.control.observation import (
    Quantities,
    Supervised,
    SupervisorMemory,
    WinchInput,
    facts_of,
)
from winchkit.bench.control.snapshot import Direction, Trip

_BY_CELL = ("cell", "tension_high", "tension_slack", "tension_rate")
"""Needs of conditions that are tested only where there is a load cell."""
_Rows = tuple[tuple[Test, Condition], ...]
_Case = tuple[bool, bool, bool, bool]
"""Whether the load cell is there, and the winch moving, disabled and to follow."""


class _TestedConditions(NamedTuple):
    """The conditions that are tested in a case."""

    every: _Rows
    by_numbers: _Rows
    """Those on more than facts."""
    bounds: tuple[float, ...] | None
    """Of each quantity: the least that a condition compares it with. As long as none is exceeded,
    none of ``by_numbers`` holds. None where one of them compares no quantity."""


class Supervisor:
    """The conditions on all winches of a bench, and the latch."""

    def __init__(
        self, winches: Mapping[str, Supervised], conditions: Sequence[Condition] = CONDITIONS
    ) -> None:
        """Take the bounds of each winch, and the table of conditions."""
        self.tripped: tuple[Trip, ...] = ()
        self.warnings: tuple[Trip, ...] = ()
        """Conditions that hold and forbid nothing."""
        self._acknowledged: tuple[Trip, ...] = ()
        """Trips that a reset is about to clear; one of the same kind that comes now is another."""
        self._latching = threading.Lock()
        """A trip that comes while others are cleared is not lost."""
        self._memory = {name: SupervisorMemory(own) for name, own in winches.items()}
        self._rows = {name: _by_case(conditions, own) for name, own in winches.items()}

    def check(self, now: float, inputs: Mapping[str, WinchInput]) -> tuple[Trip, ...]:
        """Conditions that forbid motion now; those that forbid a present motion are latched."""
        found: list[Trip] = []
        for name, item in inputs.items():
            memory = self._memory[name]
            memory.observe(item)
            own, cell = memory.own, item.tension is not None
            case = (cell, item.moving, item.disabled, item.follows)
            tested = self._rows[name][case]
            # Under the same facts a condition on facts holds no more than before.
            facts = (cell, facts_of(item))
            rows = tested.every
            if facts == memory.quiet:
                bounds = tested.bounds
                exceeded = bounds is None or True in map(gt, memory.quantities, bounds)
                if not exceeded and not memory.since:
                    continue
                rows = tested.by_numbers
            held = [row for holds, row in rows if holds(item, own, memory)]
            if rows is tested.every:
                memory.quiet = None if any(row.by_facts for row in held) else facts
            if held or memory.since:
                for row in _debounced(held, memory.since, now):
                    words = row.words(item, own, memory)
                    found.append(Trip(row.kind, name, words, row.blocks, row.latches))
        if not found:
            self.warnings = ()
            return ()
        self.warnings = tuple(trip for trip in found if not trip.blocks)
        blocked = tuple(trip for trip in found if trip.blocks)
        for trip in blocked:
            if trip.latches or self._stops(trip, inputs):
                self.latch(trip)
        return blocked

    def latch(self, trip: Trip) -> None:
        """Add a trip; the first of its kind on a winch stands."""
        with self._latching:
            standing = self.tripped[len(self._acknowledged) :]
            if not any((old.kind, old.winch) == (trip.kind, trip.winch) for old in standing):
                self.tripped = (*self.tripped, trip)

    def acknowledge(self, boot_ups: Mapping[str, int]) -> tuple[Trip, ...]:
        """Discard what a reset has handled; returns the trips that :meth:`clear` will clear."""
        for name, memory in self._memory.items():
            self._memory[name] = SupervisorMemory(memory.own, boot_ups.get(name, memory.boot_ups))
        with self._latching:
            self._acknowledged = self.tripped
        return self._acknowledged

    def clear(self) -> None:
        """Clear the acknowledged trips; others stay."""
        with self._latching:
            self.tripped = self.tripped[len(self._acknowledged) :]
            self._acknowledged = ()

    def withdraw(self) -> None:
        """End the acknowledgement: trips that are not cleared stay, the first of its kind."""
        with self._latching:
            first = {(trip.kind, trip.winch): trip for trip in reversed(self.tripped)}
            self.tripped = tuple(
                trip for trip in self.tripped if first[trip.kind, trip.winch] is trip
            )
            self._acknowledged = ()

    def _stops(self, trip: Trip, inputs: Mapping[str, WinchInput]) -> bool:
        """Whether the trip forbids the present motion."""
        for name, item in inputs.items():
            if not item.moving:
                continue
            if name != trip.winch or trip.blocks is Direction.BOTH:
                return True
            measured = direction_of(self._memory[name].winds)
            if (direction_of(item.commanded) | measured) & trip.blocks:
                return True
        return False


def _debounced(
    held: Sequence[Condition], since: dict[str, float], now: float
) -> Iterator[Condition]:
    """Those of the conditions that hold now which have held for as long as their debounce wants."""
    kinds = {row.kind for row in held if row.debounce}
    for kind in since.keys() - kinds:
        del since[kind]
    for row in held:
        if not row.debounce or now - since.setdefault(row.kind, now) >= row.debounce:
            yield row


def _by_case(conditions: Sequence[Condition], own: Supervised) -> dict[_Case, _TestedConditions]:
    applying = [row for row in conditions if _applies(row, own)]
    found = {}
    for cell, moving, disabled, follows in product((False, True), repeat=4):
        holds = {"": True, "moving": moving, "disabled": disabled, "follows": follows}
        rows = tuple(
            (row.holds, row)
            for row in applying
            if holds[row.when] and (cell or row.needs not in _BY_CELL)
        )
        by_numbers = tuple((test, row) for test, row in rows if not row.by_facts)
        tested = _TestedConditions(rows, by_numbers, _bounds([test for test, _ in by_numbers], own))
        found[cell, moving, disabled, follows] = tested
    return found


def _bounds(tests: Sequence[Test], own: Supervised) -> tuple[float, ...] | None:
    """The least bound of each quantity; None where a test compares no quantity."""
    least = [math.inf] * len(Quantities._fields)
    for test in tests:
        if not isinstance(test, Exceeds):
            return None
        least[test.place] = min(least[test.place], test.bound(own))
    return tuple(least)


def _applies(row: Condition, own: Supervised) -> bool:
    """Whether the bench file declares the limit that a condition compares with."""
    return getattr(own.limits, row.needs, True) not in (None, ())


def direction_of(speed: float) -> Direction:
    """Direction of a winding speed, positive winding in."""
    if speed == 0:
        return Direction.NONE
    return Direction.WIND_IN if speed > 0 else Direction.PAY_OUT
