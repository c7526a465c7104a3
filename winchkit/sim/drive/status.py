"""The status word of a simulated drive: state, and mode-specific bits."""

from __future__ import annotations

from winchkit.sim.drive.modes import Mode
from winchkit.sim.drive.motion import DriveMotion
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.power import PowerState

_VOLTAGE, _REMOTE, _REACHED, _LIMIT = 1 << 4, 1 << 9, 1 << 10, 1 << 11


class StatusBits:
    """Times within the windows, and status bits; ``toggling``: bit 10 is the parity of SYNCs."""

    def __init__(self, objects: ObjectDictionary, motion: DriveMotion, *, toggling: bool) -> None:
        self._objects, self._motion, self._toggling = objects, motion, toggling
        self.following_error = False
        self.syncs = 0
        self._position_time = self._speed_time = self._slow_time = 0.0
        self._speed = 0.0

    def advance(self, angle: float, speed: float, dt: float) -> None:
        """Advance by ``dt`` s with the motor at ``angle`` (rad) and ``speed`` (rad/s)."""
        settings = self._motion.settings
        limits = settings.limits
        self._speed = speed
        near = abs(self._target() - angle) <= limits.position_window
        self._position_time = self._position_time + dt if near else 0.0
        target = self._objects.number(0x60FF, 0, 0) * settings.units.speed
        near = abs(target - speed) <= limits.speed_window
        self._speed_time = self._speed_time + dt if near else 0.0
        slow = abs(speed) <= limits.slow_speed
        self._slow_time = self._slow_time + dt if slow else 0.0

    def _target(self) -> float:
        settings, number = self._motion.settings, self._objects.number
        if self._motion.mode is Mode.IP:
            return settings.angle(number(0x60C1, 1, 0))
        return settings.angle(number(0x607A, 0, 0))

    @property
    def position_reached(self) -> bool:
        """Within the position window (6067h) for the time 6068h."""
        return self._position_time > self._motion.settings.limits.position_time

    @property
    def speed_reached(self) -> bool:
        """Within the velocity window (606Dh) for the time 606Eh."""
        return self._speed_time > self._motion.settings.limits.speed_time

    @property
    def slow(self) -> bool:
        """Below the velocity threshold (606Fh) for the time 6070h."""
        return self._slow_time > self._motion.settings.limits.slow_time

    def word(self, state: PowerState) -> int:
        """Status word (6041h) in a state."""
        if state is PowerState.NOT_READY:
            return 0
        word = int(state) | _VOLTAGE | _REMOTE
        still = self._motion.at_rest(self._speed)
        if state is PowerState.QUICK_STOP_ACTIVE and still:
            word |= _REACHED
        if state is not PowerState.OPERATION_ENABLED:
            return word
        word |= _LIMIT if self._motion.demand.limited else 0
        return word | self._mode_bits(still)

    def _mode_bits(self, still: bool) -> int:
        motion = self._motion
        bits = motion.set_points.bits(self)
        if motion.set_points.cyclic:
            bits = 0 if motion.stopping else bits
            return bits | (_REACHED if self._toggling and self.syncs % 2 else 0)
        if motion.stopping:
            bits = bits & ~_REACHED | (_REACHED if still else 0)
        return bits
