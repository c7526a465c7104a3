"""Motion of a simulated drive: set-points of its mode, or a stop, in short time steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from winchkit.sim.drive.cyclic_modes import (
    CyclicPosition,
    CyclicTorque,
    CyclicVelocity,
    InterpolatedPosition,
)
from winchkit.sim.drive.demand import DriveDemand, SetPoints, approach
from winchkit.sim.drive.homing import HomingMode, Switches
from winchkit.sim.drive.modes import Mode
from winchkit.sim.drive.power import RAMPS, Order
from winchkit.sim.drive.profile_modes import ProfilePosition, ProfileTorque, ProfileVelocity
from winchkit.sim.drive.settings import Settings
from winchkit.sim.drive.shaft import HoldingBrake
from winchkit.sim.plant.servo import DriveCommand

_STANDSTILL = 0.05
"""Speed below which a ramp has ended, rad/s."""
_TIMEOUT = 0.5
"""Longest wait for standstill after the ramp of a stop, s."""
_HOLD, _BRAKED, _FREE = DriveCommand(), DriveCommand.off(brake=True), DriveCommand.off(brake=False)


class DriveMotion:
    """Computes a :class:`DriveCommand` from an order, the mode and the targets."""

    def __init__(
        self,
        settings: Settings,
        modes: Iterable[Mode],
        brake: HoldingBrake,
        *,
        smoothing: float = 0.0,
    ) -> None:
        self.settings = settings
        self.demand = DriveDemand()
        self.switches = Switches()
        self.halted = False
        self.stopping = False
        self._brake = brake
        self._set_points = _all(settings, self.demand, smoothing, lambda: self.switches)
        self.modes = frozenset(modes) & frozenset(self._set_points)
        self.mode = Mode.NONE
        self.set_points = self._set_points[self.mode]
        """Set-points of the present mode."""
        self._following = False
        self._last_word = 0
        self._stood = 0.0

    @property
    def controls_position(self) -> bool:
        """Whether the demanded angle is controlled at present."""
        return self._following and not self.stopping and self.set_points.position

    def set_mode(self, mode: Mode, angle: float) -> None:
        """Change the mode; set-points start at the motor's angle."""
        self.mode, self.set_points = mode, self._set_points[mode]
        self.set_points.reset()
        self._begin(angle)

    def control(self, word: int, angle: float, *, enabled: bool) -> None:
        """Take a control word that was just written."""
        rising, self._last_word = word & ~self._last_word, word
        self.set_points.control(word, rising, angle, enabled=enabled)

    def aim(self) -> None:
        """Take a target of a cyclic mode that was written."""
        self.set_points.aim()

    def step(self, order: Order, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command for the next ``dt`` s, given the motor's angle and speed."""
        if order is Order.OFF or order is Order.CUT:
            self._brake.off(dt, still=abs(speed) < _STANDSTILL, cut=order is Order.CUT)
            return self._rest(angle, speed)
        self._brake.power(dt)
        if self._brake.closed:
            return self._rest(angle, speed)
        if not self._following:
            self._following = True
            self.demand.speed = speed
            self._begin(angle)
        self.demand.limited = False
        if order is not Order.FOLLOW or self.halted:
            return self._stop(order, angle, dt)
        if self.stopping:
            self.stopping = False
            self._begin(angle)
        return self.set_points.step(angle, speed, dt)

    def at_rest(self, speed: float) -> bool:
        """Whether the motor is at standstill at the end of a stop."""
        return self.stopping and self.demand.speed == 0 and abs(speed) < _STANDSTILL

    def stop_is_over(self, speed: float) -> bool:
        """Whether a stop has ended, or its time-out has passed: a load may turn the motor."""
        return self.at_rest(speed) or (self.stopping and self._stood > _TIMEOUT)

    def _begin(self, angle: float) -> None:
        """Start the set-points at the present speed and an angle."""
        self.demand.angle = angle
        self.set_points.begin()

    def _rest(self, angle: float, speed: float) -> DriveCommand:
        """Command without set-points: the brake holds, or the motor until it does, or neither."""
        self._following = self.stopping = False
        self.set_points.reset()
        self.demand.angle, self.demand.speed = angle, speed
        if self._brake.holding:
            return _HOLD
        return _BRAKED if self._brake.closed else _FREE

    def _stop(self, order: Order, angle: float, dt: float) -> DriveCommand:
        if order is Order.FOLLOW:
            order = RAMPS.get(self.settings.number(0x605D, 0, 1), Order.SLOW_DOWN)
        else:
            self.set_points.reset()
        if not self.stopping:
            self.stopping, self._stood = True, 0.0
        index = {Order.SLOW_DOWN: 0x6084, Order.QUICK_STOP: 0x6085}.get(order, 0x60C6)
        demand = self.demand
        demand.speed = approach(demand.speed, 0.0, self.settings.ramp(index) * dt)
        self._stood = self._stood + dt if demand.speed == 0 else 0.0
        return self.set_points.by_speed(angle)


def _all(
    settings: Settings, demand: DriveDemand, smoothing: float, switches: Callable[[], Switches]
) -> dict[Mode, SetPoints]:
    return {
        Mode.NONE: SetPoints(settings, demand),
        Mode.PP: ProfilePosition(settings, demand),
        Mode.PV: ProfileVelocity(settings, demand),
        Mode.PT: ProfileTorque(settings, demand),
        Mode.HM: HomingMode(settings, demand, switches),
        Mode.IP: InterpolatedPosition(settings, demand, smoothing),
        Mode.CSP: CyclicPosition(settings, demand, smoothing),
        Mode.CSV: CyclicVelocity(settings, demand, smoothing),
        Mode.CST: CyclicTorque(settings, demand),
    }
