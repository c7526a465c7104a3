"""The objects of a simulated drive that do something when they are written."""

from __future__ import annotations

from winchkit.schema.device_servo import QuirkSpec
from winchkit.sim.drive_axis import Axis
from winchkit.sim.drive_guards import guard_options
from winchkit.sim.drive_mode import Mode
from winchkit.sim.drive_motion import Motion
from winchkit.sim.drive_power import PowerStage
from winchkit.sim.drive_shaft import Shaft
from winchkit.sim.drive_state import HALT, State
from winchkit.sim.drive_units import SCALES
from winchkit.sim.object_dictionary import Abort, ObjectDictionary

__all__ = ["Actions"]

_TARGETS = (0x607A, 0x60FF, 0x60B0, 0x60B1, 0x60C1)
_SI_UNITS = (0x60A8, 0x60A9)
_POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION)


class Actions:
    """Connects an object dictionary with the power stage and the motion behind it."""

    def __init__(
        self,
        objects: ObjectDictionary,
        shaft: Shaft,
        power: PowerStage,
        motion: Motion,
        axis: Axis,
        *,
        quirks: QuirkSpec,
    ) -> None:
        self._shaft, self._power, self._motion, self._axis = shaft, power, motion, axis
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
        enabled = self._power.state is State.OPERATION_ENABLED
        self._motion.control(word, self._shaft.motor_angle, enabled=enabled)

    def _choose_mode(self, _sub: int, value: int) -> None:
        self._motion.set_mode(Mode(value), self._shaft.motor_angle)

    def _check_unit(self, _sub: int, _value: int) -> Abort | None:
        return Abort.STATE if self._power.state in _POWERED else None

    def _check_scale(self, sub: int, value: int) -> Abort | None:
        return self._check_unit(sub, value) or (Abort.RANGE if value == 0 else None)

    def _scale_again(self, _sub: int, _value: int) -> None:
        self._motion.settings.read_units()
        self._axis.forget_sample()
