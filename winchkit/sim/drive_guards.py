"""Values that a simulated drive refuses, beyond the limits that its EDS states."""

from __future__ import annotations

from collections.abc import Container

from winchkit.schema.device_servo import QuirkSpec
from winchkit.sim.drive_homing import HOMING_METHODS
from winchkit.sim.drive_mode import Mode
from winchkit.sim.object_dictionary import Abort, Guard, ObjectDictionary

__all__ = ["guard_options"]

_POSITIVE = (0x6083, 0x6084, 0x6085, 0x609A, 0x60C5, 0x60C6)
"""A ramp of zero would never end."""


def guard_options(objects: ObjectDictionary, modes: frozenset[Mode], quirks: QuirkSpec) -> None:
    """Refuse option codes, modes and methods that are not simulated, and ramps without end."""
    allowed: dict[int, Container[int]] = {
        0x1003: (0,),
        0x1005: range(0x800),
        0x6007: range(4),
        0x605A: quirks.quick_stop_codes or range(9),
        0x605B: range(2),
        0x605C: range(2),
        0x605D: range(1, 5),
        0x605E: quirks.fault_reaction_codes or range(5),
        0x6060: modes,
        0x6098: HOMING_METHODS,
    }
    for index, values in allowed.items():
        objects.guards[index] = _only(values)
    for index in _POSITIVE:
        objects.guards[index] = _only(range(1, 1 << 32))


def _only(allowed: Container[int]) -> Guard:
    return lambda _sub, value: None if value in allowed else Abort.RANGE
