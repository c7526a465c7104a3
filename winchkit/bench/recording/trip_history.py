"""The control cycles around a trip, kept until its reset: measured and commanded values."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from winchkit.bench.control.snapshot import BenchSnapshot, Direction, Trip
from winchkit.plain_json import significant

BEFORE, AFTER = 2.0, 0.5
"""Time kept before and after the cycle of the trip, s."""
_CHANNELS = (
    *("motor_angle", "motor_velocity", "motor_torque", "tension", "load", "length"),
    *("cable_length", "cable_speed", "commanded_speed"),
)
_DIGITS = 6
"""Significant digits: 10 µs in the seconds before a trip, and 0.1 mm in 10 m of cable."""
_WORDS = {
    Direction.NONE: "nothing",
    Direction.WIND_IN: "winding in",
    Direction.PAY_OUT: "paying out",
    Direction.BOTH: "any motion",
}


class TripHistory:
    """A sampler of the control loop that keeps the newest cycles, and stops soon after a trip."""

    def __init__(self, cycle: float) -> None:
        self._cycles: deque[BenchSnapshot] = deque(maxlen=round((BEFORE + AFTER) / cycle) + 1)
        self._at: float | None = None

    def __call__(self, snapshot: BenchSnapshot) -> None:
        """Take a cycle; cheap, for the control thread."""
        if not snapshot.tripped:
            self._at = None
        elif self._at is None:
            self._at = snapshot.time
        if self._at is None or snapshot.time <= self._at + AFTER:
            self._cycles.append(snapshot)

    def to_dict(self, newest: BenchSnapshot) -> dict[str, Any] | None:
        """The trip and the cycles around it as JSON has them; None where nothing is tripped.

        Returns: ``at``: time of the trip on the bench's clock, s; ``tripped`` and ``blocked``:
        message and forbidden direction of each; ``time``: of the cycles, s from the trip;
        ``winch``: channels by winch, in SI, None for what is not known; ``events``: time from the
        trip and words.
        """
        at = self._at
        if at is None:
            return None
        cycles = [item for item in tuple(self._cycles) if item.time >= at - BEFORE]
        names = list(newest.winch)
        return {
            "at": at,
            "tripped": _forbidden(newest.tripped),
            "blocked": _forbidden(newest.blocked),
            "time": significant((item.time - at for item in cycles), _DIGITS),
            "winch": {
                name: {
                    channel: significant(
                        (getattr(item.winch[name], channel) for item in cycles), _DIGITS
                    )
                    for channel in _CHANNELS
                }
                for name in names
            },
            "events": [[round(time - at, 4), words] for time, words in _events(cycles)],
        }


def _forbidden(trips: Iterable[Trip]) -> list[dict[str, str]]:
    return [{"message": str(trip), "forbids": _WORDS[trip.blocks]} for trip in trips]


def _events(cycles: Iterable[BenchSnapshot]) -> Iterator[tuple[float, str]]:
    """Changes of trips, phases and commanders, in words."""
    tripped: tuple[Trip, ...] | None = None
    before: Mapping[str, tuple[str, str]] | None = None
    for item in cycles:
        if tripped is not None:
            yield from ((item.time, str(trip)) for trip in item.tripped if trip not in tripped)
        tripped = item.tripped
        now = {name: (one.phase.value, one.commander) for name, one in item.winch.items()}
        if before is not None:
            for name, (phase, commander) in now.items():
                if (phase, commander) != before[name]:
                    by = f", commanded by {commander}" if commander else ""
                    yield item.time, f"winch {name} {phase}{by}"
        before = now
