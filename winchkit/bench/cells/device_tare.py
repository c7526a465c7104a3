"""Waits until a load cell confirms a tare by its own volatile command."""

from __future__ import annotations

from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import NoReply

_POLL = 0.01
"""s: a reading of the fastest usual cell."""
_WITHIN = 2.0
"""s: an indicator waits for a stable load, usually 1 s, before it takes a tare."""
_SETTLING = 3
"""Readings that were requested after the command, before one counts."""


def await_device_tare(clock: Clock, winch: str, cell: Sensor) -> float:
    """Wait for readings after the tare and make sure that the device took it; the tension, N.

    Raises NoReply where it does not confirm.
    """
    sent, seen, deadline = clock.now(), 0, clock.now() + _WITHIN
    last = sent
    while clock.now() < deadline:
        clock.sleep(_POLL)
        reading = cell.latest
        if reading is None or reading.t_request <= last:
            continue
        last, seen = reading.t_request, seen + 1
        if seen >= _SETTLING and cell.tared is not False and reading.quality.usable:
            return reading.value
    raise NoReply(
        f"winch {winch}: {cell.name} did not confirm the tare within {_WITHIN:g} s; "
        "check that the reading is stable and within the device's tare range"
    )
