"""Watches every winch each cycle: what forbids motion now, and what has stopped it.

Free of buses and threads: it is given the time and what is known, and remembers only what a
rule needs (debounce, rates, boot-ups) and the trips that it latched.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from winchkit.bench.snapshot import Direction, Trip
from winchkit.schema.bench import LimitSpec

__all__ = ["Instrumented", "Supervisor", "WinchInput"]

_MISSED_SYNCS = 5
_SLACK_TIME = 0.2
_LENGTH_TOLERANCE = 5e-3
_SPEED_TOLERANCE = 1.2
_RATE_TIME = 0.05


@dataclass(frozen=True, slots=True)
class Instrumented:
    """Newest reading of a sensor as the supervisor needs it."""

    value: float
    """SI; NaN where the device flags it."""
    age: float
    """Since it was received, s; infinity before the first."""
    max_age: float
    """s."""
    quality: str
    time: float
    """Of the sample, s."""
    problem: str = ""
    """Why nothing comes, in words."""
    gross: float = math.nan
    """Before any tare."""


@dataclass(frozen=True, slots=True)
class WinchInput:
    """What is known of one winch in this cycle; SI."""

    feedback_age: float
    """Since the SYNC of the newest complete feedback, s; infinity before the first."""
    missed_syncs: int
    """SYNCs that were sent since then and are not answered, the one just sent left out."""
    heartbeat_lost: bool
    boot_ups: int
    operational: bool
    mode_kept: bool
    fault: str
    """The drive's fault in words; empty while it has none."""
    speed: float
    """Actual rope speed, positive winds in, m/s."""
    commanded: float
    """Commanded rope speed, m/s."""
    cable_length: float
    moving: bool
    """Whether the drive is or is being enabled."""
    tension: Instrumented | None = None


class Supervisor:
    """Rules over all winches of a bench, and the latch."""

    def __init__(self, limits: Mapping[str, LimitSpec], stale: float) -> None:
        """Feedback older than ``stale`` (s) that has also missed several SYNCs is stale.

        Both, since a late cycle of our own makes feedback old without a drive being silent.
        """
        self.tripped: tuple[Trip, ...] = ()
        self._limits = limits
        self._stale = stale
        self._boot_ups: dict[str, int] = {}
        self._slack_since: dict[str, float] = {}
        self._tension: dict[str, tuple[float, float]] = {}

    def check(self, now: float, inputs: Mapping[str, WinchInput]) -> tuple[Trip, ...]:
        """Everything that forbids motion now; latches what must stop a motion under way."""
        found = tuple(
            trip
            for name, item in inputs.items()
            for trip in self._rules(name, item, self._limits[name], now)
        )
        for trip in found:
            if trip.latches or self._stops(trip, inputs):
                self.latch(trip)
        return found

    def latch(self, trip: Trip) -> None:
        """Add a trip; the first of its kind on a winch stands."""
        if not any((old.kind, old.winch) == (trip.kind, trip.winch) for old in self.tripped):
            self.tripped = (*self.tripped, trip)

    def reset(self, boot_ups: Mapping[str, int]) -> None:
        """Clear the latch; boot-ups up to now have been dealt with."""
        self.tripped = ()
        self._boot_ups = dict(boot_ups)
        self._slack_since.clear()
        self._tension.clear()

    def _stops(self, trip: Trip, inputs: Mapping[str, WinchInput]) -> bool:
        """Whether a motion under way is one that the trip forbids."""
        for name, item in inputs.items():
            if not item.moving:
                continue
            if name != trip.winch or trip.blocks is Direction.BOTH:
                return True
            if direction_of(item.commanded) & trip.blocks:
                return True
        return False

    def _rules(self, name: str, item: WinchInput, limits: LimitSpec, now: float) -> Iterator[Trip]:
        yield from self._drive_rules(name, item)
        yield from _motion_rules(name, item, limits)
        if item.tension is not None:
            yield from self._tension_rules(name, item.tension, limits, now)

    def _drive_rules(self, name: str, item: WinchInput) -> Iterator[Trip]:
        known = self._boot_ups.setdefault(name, item.boot_ups)
        if item.boot_ups > known:
            yield Trip(
                "boot-up",
                name,
                "the drive has restarted and lost its PDO mapping; look why, then reset",
                latches=True,
            )
        if item.heartbeat_lost:
            yield Trip(
                "heartbeat",
                name,
                "the drive's heartbeat is gone; check its power and the bus, then reset",
                latches=True,
            )
        if not item.operational:
            yield Trip("nmt", name, "the drive has left the state operational; reset", latches=True)
        if item.feedback_age > self._stale and item.missed_syncs >= _MISSED_SYNCS:
            yield Trip(
                "feedback",
                name,
                f"no complete feedback for {item.feedback_age * 1e3:.0f} ms "
                f"(limit {self._stale * 1e3:.0f} ms); check the bus load and the drive",
            )
        if item.fault:
            yield Trip("fault", name, f"drive fault: {item.fault}; clear the cause, then reset")
        if not item.mode_kept:
            yield Trip("mode", name, "the drive has changed its mode of operation; reset")

    def _tension_rules(
        self, name: str, cell: Instrumented, limits: LimitSpec, now: float
    ) -> Iterator[Trip]:
        if cell.age > cell.max_age:
            since = "yet" if math.isinf(cell.age) else f"for {cell.age:.2f} s"
            reason = f": {cell.problem}" if cell.problem else ""
            yield Trip(
                "cell stale",
                name,
                f"no load cell reading {since} (limit {cell.max_age:.2f} s){reason}",
            )
            return
        if math.isnan(cell.value):
            yield Trip("cell", name, f"the load cell reads no number ({cell.quality}); check it")
            return
        yield from self._level_rules(name, cell, limits, now)
        yield from self._rate_rule(name, cell, limits)

    def _level_rules(
        self, name: str, cell: Instrumented, limits: LimitSpec, now: float
    ) -> Iterator[Trip]:
        high, slack, tension = limits.tension_high, limits.tension_slack, cell.value
        # The rope carries the gross value: a tare neither hides an overload nor makes it slack.
        tension = cell.gross if math.isfinite(cell.gross) else tension
        if high is not None and tension > high:
            yield Trip(
                "tension high",
                name,
                f"tension {tension:.1f} N is above tension_high {high:g} N; only paying out is "
                "allowed until it falls",
                Direction.WIND_IN,
            )
        if slack is None or tension >= slack:
            self._slack_since.pop(name, None)
        elif now - self._slack_since.setdefault(name, now) >= _SLACK_TIME:
            yield Trip(
                "slack",
                name,
                f"tension {tension:.1f} N is below tension_slack {slack:g} N; only winding in is "
                "allowed until it rises",
                Direction.PAY_OUT,
            )

    def _rate_rule(self, name: str, cell: Instrumented, limits: LimitSpec) -> Iterator[Trip]:
        if limits.tension_rate is None:
            return
        before = self._tension.setdefault(name, (cell.time, cell.value))
        span = cell.time - before[0]
        if span < _RATE_TIME:
            return
        self._tension[name] = (cell.time, cell.value)
        rate = (cell.value - before[1]) / span
        if abs(rate) > limits.tension_rate:
            yield Trip(
                "tension rate",
                name,
                f"tension changes by {rate:.0f} N/s, limit {limits.tension_rate:g} N/s",
            )


def direction_of(speed: float) -> Direction:
    """Direction of a rope speed, positive winding in."""
    if speed == 0:
        return Direction.NONE
    return Direction.WIND_IN if speed > 0 else Direction.PAY_OUT


def _motion_rules(name: str, item: WinchInput, limits: LimitSpec) -> Iterator[Trip]:
    if abs(item.speed) > limits.speed * _SPEED_TOLERANCE:
        yield Trip(
            "speed",
            name,
            f"rope speed {item.speed:.3f} m/s is beyond limits.speed {limits.speed:g} m/s "
            "by more than a fifth",
        )
    if limits.length is None:
        return
    low, high = limits.length
    if item.cable_length < low - _LENGTH_TOLERANCE:
        yield Trip(
            "length",
            name,
            f"cable length {item.cable_length:.3f} m is below limits.length {low:g} m; only "
            "paying out is allowed",
            Direction.WIND_IN,
        )
    if item.cable_length > high + _LENGTH_TOLERANCE:
        yield Trip(
            "length",
            name,
            f"cable length {item.cable_length:.3f} m is above limits.length {high:g} m; only "
            "winding in is allowed",
            Direction.PAY_OUT,
        )
