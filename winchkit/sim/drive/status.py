"""The status word of a simulated drive: state, and mode-specific bits."""

from __future__ import annotations

from winchkit.sim.drive.demand import Windows
from winchkit.sim.drive.modes import Mode
from winchkit.sim.drive.motion import Motion
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.power import State

__all__ = ["StatusBits"]

_VOLTAGE, _REMOTE, _REACHED, _LIMIT = 1 << 4, 1 << 9, 1 << 10, 1 << 11
_NARROW = 100
"""Default of a missing window, counts."""
_MS = 1e-3


class StatusBits:
    """Times for which the motor has been within its windows, and status bits.

    With ``toggling``, bit 10 is the parity of ``syncs`` in the cyclic modes.
    """

    def __init__(self, objects: ObjectDictionary, motion: Motion, *, toggling: bool) -> None:
        self._objects, self._motion, self._toggling = objects, motion, toggling
        self.following_error = False
        self.syncs = 0
        self._position_time = self._speed_time = self._slow_time = 0.0
        self._speed = 0.0

    def advance(self, angle: float, speed: float, dt: float) -> None:
        """Advance by ``dt`` s with the motor at ``angle`` (rad) and ``speed`` (rad/s)."""
        number, settings = self._objects.number, self._motion.settings
        unit = settings.units
        self._speed = speed
        off = abs(self._target() - angle)
        near = off <= number(0x6067, 0, _NARROW) * unit.angle
        self._position_time = self._position_time + dt if near else 0.0
        off = abs(number(0x60FF, 0, 0) * unit.speed - speed)
        near = off <= number(0x606D, 0, _NARROW) * unit.speed
        self._speed_time = self._speed_time + dt if near else 0.0
        slow = abs(speed) <= number(0x606F, 0, _NARROW) * unit.speed
        self._slow_time = self._slow_time + dt if slow else 0.0

    def _target(self) -> float:
        settings, number = self._motion.settings, self._objects.number
        if self._motion.mode is Mode.IP:
            return settings.angle(number(0x60C1, 1, 0))
        return settings.angle(number(0x607A, 0, 0))

    def _windows(self) -> Windows:
        number = self._objects.number
        return Windows(
            position_reached=self._position_time > number(0x6068, 0, 0) * _MS,
            speed_reached=self._speed_time > number(0x606E, 0, 0) * _MS,
            slow=self._slow_time > number(0x6070, 0, 0) * _MS,
            following_error=self.following_error,
        )

    def word(self, state: State) -> int:
        """Status word (6041h) in a state."""
        if state is State.NOT_READY:
            return 0
        word = int(state) | _VOLTAGE | _REMOTE
        still = self._motion.at_rest(self._speed)
        if state is State.QUICK_STOP_ACTIVE and still:
            word |= _REACHED
        if state is not State.OPERATION_ENABLED:
            return word
        word |= _LIMIT if self._motion.demand.limited else 0
        return word | self._mode_bits(still)

    def _mode_bits(self, still: bool) -> int:
        motion = self._motion
        bits = motion.set_points.bits(self._windows())
        if motion.set_points.cyclic:
            bits = 0 if motion.stopping else bits
            return bits | (_REACHED if self._toggling and self.syncs % 2 else 0)
        if motion.stopping:
            bits = bits & ~_REACHED | (_REACHED if still else 0)
        return bits
