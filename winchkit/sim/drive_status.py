"""The status word of a simulated drive: state, and the bits whose meaning the mode gives."""

from __future__ import annotations

from winchkit.sim.drive_motion import Mode, Motion
from winchkit.sim.drive_state import State
from winchkit.sim.object_dictionary import ObjectDictionary

__all__ = ["SetPointHandshake", "StatusBits"]

_VOLTAGE, _REMOTE, _REACHED, _LIMIT = 1 << 4, 1 << 9, 1 << 10, 1 << 11
_MODE_BIT_12, _MODE_BIT_13 = 1 << 12, 1 << 13
_NEW_SET_POINT, _AT_ONCE, _RELATIVE = 1 << 4, 1 << 5, 1 << 6
_MS = 1e-3


class SetPointHandshake:
    """Bits 4 to 6 of the control word in PP, and bit 12 of the status word that answers."""

    def __init__(self, objects: ObjectDictionary, motion: Motion) -> None:
        self._objects, self._motion = objects, motion
        self._last = 0
        self._taken = False

    def take(self, word: int, angle: float, *, enabled: bool) -> None:
        """Take a control word that was just written; a rising bit 4 is a new set-point."""
        rising = word & ~self._last & _NEW_SET_POINT
        self._last = word
        if not word & _NEW_SET_POINT:
            self._taken = False
        elif rising and enabled and self._motion.mode is Mode.PP:
            relative, at_once = bool(word & _RELATIVE), bool(word & _AT_ONCE)
            self._taken = self._motion.start_profile(angle, relative=relative, at_once=at_once)

    @property
    def acknowledged(self) -> bool:
        """Status bit 12 in PP: a set-point was taken, or no more can be."""
        return self._taken or self._motion.profile.next is not None


class StatusBits:
    """Keeps the times for which the motor has been within its windows."""

    def __init__(self, objects: ObjectDictionary, motion: Motion) -> None:
        self._objects, self._motion = objects, motion
        self.following_error = False
        self._position_time = self._speed_time = self._slow_time = 0.0
        self._speed = 0.0

    def advance(self, angle: float, speed: float, dt: float) -> None:
        """Let ``dt`` s pass with the motor at ``angle`` (rad) and ``speed`` (rad/s)."""
        number, units = self._objects.number, self._motion.units
        self._speed = speed
        off = abs(number(0x607A) * units.angle - angle)
        near = off <= number(0x6067) * units.angle and self._motion.profile.target is None
        self._position_time = self._position_time + dt if near else 0.0
        off = abs(number(0x60FF) * units.speed - speed)
        self._speed_time = self._speed_time + dt if off <= number(0x606D) * units.speed else 0.0
        slow = abs(speed) <= number(0x606F) * units.speed
        self._slow_time = self._slow_time + dt if slow else 0.0

    def word(self, state: State, *, acknowledged: bool) -> int:
        """Status word (6041h) in a state."""
        if state is State.NOT_READY:
            return 0
        word = int(state) | _VOLTAGE | _REMOTE
        if state is State.QUICK_STOP_ACTIVE and self._motion.at_rest(self._speed):
            word |= _REACHED
        if state is not State.OPERATION_ENABLED:
            return word
        word |= _LIMIT if self._motion.limited else 0
        return word | self._mode_bits(acknowledged)

    def _mode_bits(self, acknowledged: bool) -> int:
        motion, number = self._motion, self._objects.number
        still = motion.at_rest(self._speed)
        bits = 0
        if motion.mode is Mode.PP:
            arrived = motion.profile.target is None
            reached = arrived and self._position_time > number(0x6068) * _MS
            bits |= _REACHED if (still if motion.stopping else reached) else 0
            bits |= _MODE_BIT_12 if acknowledged else 0
            bits |= _MODE_BIT_13 if self.following_error else 0
        elif motion.mode is Mode.PV:
            reached = self._speed_time > number(0x606E) * _MS
            bits |= _REACHED if (still if motion.stopping else reached) else 0
            bits |= _MODE_BIT_12 if self._slow_time > number(0x6070) * _MS else 0
        elif motion.mode in (Mode.CSP, Mode.CSV):
            bits |= 0 if motion.stopping else _MODE_BIT_12
            bits |= _MODE_BIT_13 if self.following_error else 0
        return bits
