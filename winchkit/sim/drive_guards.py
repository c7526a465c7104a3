"""Values that a simulated drive refuses, beyond the limits that its EDS states."""

from __future__ import annotations

from collections.abc import Container

from winchkit.sim.drive_motion import Mode
from winchkit.sim.object_dictionary import Abort, Guard, ObjectDictionary

__all__ = ["guard_options"]

_ALLOWED: dict[int, Container[int]] = {
    0x1003: (0,),
    0x1005: range(0x800),
    0x6007: range(4),
    0x605A: range(9),
    0x605B: range(2),
    0x605C: range(2),
    0x605D: range(1, 5),
    0x605E: range(5),
    0x6060: tuple(Mode),
}
_POSITIVE = (0x6083, 0x6084, 0x6085, 0x60C5, 0x60C6)
"""A ramp of zero would never end."""


def guard_options(objects: ObjectDictionary) -> None:
    """Refuse option codes and modes that are not simulated, and ramps that never end."""
    for index, allowed in _ALLOWED.items():
        objects.guards[index] = _only(allowed)
    for index in _POSITIVE:
        objects.guards[index] = _only(range(1, 1 << 32))


def _only(allowed: Container[int]) -> Guard:
    return lambda _sub, value: None if value in allowed else Abort.RANGE
