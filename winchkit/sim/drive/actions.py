"""Objects of a simulated drive with an action when they are written."""

from __future__ import annotations

from collections.abc import Container

from winchkit.schema.devices.servo import QuirkSpec
from winchkit.sim.drive.homing import HOMING_METHODS
from winchkit.sim.drive.modes import Mode
from winchkit.sim.drive.motion import DriveMotion
from winchkit.sim.drive.object_dictionary import Abort, Guard, ObjectDictionary
from winchkit.sim.drive.power import HALT, PowerStage, PowerState
from winchkit.sim.drive.shaft import Shaft
from winchkit.sim.drive.units import SCALES

_POSITIVE = (0x6083, 0x6084, 0x6085, 0x609A, 0x60C5, 0x60C6)
"""Objects whose value zero would give a ramp without end."""


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


_TARGETS = (0x607A, 0x60FF, 0x60B0, 0x60B1, 0x60C1)
_SI_UNITS = (0x60A8, 0x60A9)
_POWERED = (PowerState.OPERATION_ENABLED, PowerState.QUICK_STOP_ACTIVE, PowerState.FAULT_REACTION)


class Actions:
    """Connects an object dictionary with the power stage and the motion."""

    def __init__(
        self,
        objects: ObjectDictionary,
        shaft: Shaft,
        power: PowerStage,
        motion: DriveMotion,
        *,
        quirks: QuirkSpec,
    ) -> None:
        self._shaft, self._power, self._motion = shaft, power, motion
        guard_options(objects, motion.modes, quirks)
        guards, watchers = objects.guards, objects.watchers
        for index in SCALES:
            guards[index] = self._check_unit if index in _SI_UNITS else self._check_scale
            watchers[index] = self._scale_again
        for index in _TARGETS:
            watchers[index] = lambda _sub, _value: motion.aim()
        watchers[0x6040] = self._control
        watchers[0x6060] = self._choose_mode

    def _control(self, _sub: int, word: int) -> None:
        self._motion.halted = bool(word & HALT)
        self._power.control(word)
        enabled = self._power.state is PowerState.OPERATION_ENABLED
        self._motion.control(word, self._shaft.motor_angle, enabled=enabled)

    def _choose_mode(self, _sub: int, value: int) -> None:
        self._motion.set_mode(Mode(value), self._shaft.motor_angle)

    def _check_unit(self, _sub: int, _value: int) -> Abort | None:
        return Abort.STATE if self._power.state in _POWERED else None

    def _check_scale(self, sub: int, value: int) -> Abort | None:
        return self._check_unit(sub, value) or (Abort.RANGE if value == 0 else None)

    def _scale_again(self, _sub: int, _value: int) -> None:
        self._motion.settings.read_units()
