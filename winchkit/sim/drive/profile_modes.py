"""The modes of a simulated drive with ramps of the drive: PP, PV, PT."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

from winchkit.sim.drive.demand import DriveDemand, SetPoints, Windows, approach
from winchkit.sim.drive.settings import Settings
from winchkit.sim.plant.servo import DriveCommand


@dataclass(frozen=True)
class AcceptedSetpoint:
    """A set-point with the values at its acceptance, SI."""

    target: float
    """rad."""
    speed: float
    acceleration: float
    deceleration: float


class Moves:
    """The moves of the mode PP."""

    def __init__(self) -> None:
        self.current: AcceptedSetpoint | None = None
        self.next: AcceptedSetpoint | None = None
        """The next set-point."""

    def reset(self) -> None:
        """Discard the moves."""
        self.current = self.next = None

    @property
    def last(self) -> float | None:
        """The target accepted last, until it is reached."""
        last = self.next or self.current
        return None if last is None else last.target

    def accept(self, move: AcceptedSetpoint, *, at_once: bool) -> bool:
        """Accept a set-point; False where a next one is waiting already."""
        if at_once or self.current is None:
            self.current, self.next = move, None
            return True
        if self.next is not None:
            return False
        self.next = move
        return True

    def step(
        self, move: AcceptedSetpoint, angle: float, speed: float, fastest: float, dt: float
    ) -> tuple[float, float]:
        """Angle and speed after ``dt`` s of the current move, no faster than ``fastest``."""
        left = move.target - angle
        # The speed from which whole steps of dt still end at the target.
        brake = move.deceleration * dt
        allowed = brake * (sqrt(0.25 + 2 * abs(left) / (brake * dt)) - 0.5)
        wanted = copysign(min(move.speed, fastest, allowed), left) if left else 0.0
        faster = abs(wanted) > abs(speed) and wanted * speed >= 0
        step = (move.acceleration if faster else move.deceleration) * dt
        speed = wanted if abs(wanted - speed) <= step else speed + copysign(step, wanted - speed)
        if abs(left) <= abs(speed) * dt and abs(speed) <= step:
            self.current, self.next = self.next, None
            return move.target, 0.0
        return angle + speed * dt, speed


_NEW_SET_POINT, _AT_ONCE, _RELATIVE = 1 << 4, 1 << 5, 1 << 6
_REACHED, _BIT_12, _BIT_13 = 1 << 10, 1 << 12, 1 << 13


class ProfilePosition(SetPoints):
    """PP: trapezoidal moves to target positions 607Ah, with the handshake of set-point bits."""

    position = True

    def __init__(self, settings: Settings, demand: DriveDemand) -> None:
        super().__init__(settings, demand)
        self._moves = Moves()
        self._taken = False

    def reset(self) -> None:
        """Discard the moves."""
        self._moves.reset()

    def control(self, word: int, rising: int, angle: float, *, enabled: bool) -> None:
        """A rising bit 4 is a new set-point; bit 5 puts it into effect at once."""
        if not word & _NEW_SET_POINT:
            self._taken = False
        elif rising & _NEW_SET_POINT and enabled:
            move = self._move(angle, relative=bool(word & _RELATIVE))
            self._taken = self._moves.accept(move, at_once=bool(word & _AT_ONCE))

    def _move(self, angle: float, *, relative: bool) -> AcceptedSetpoint:
        settings = self.settings
        wanted = settings.angle(settings.number(0x607A))
        if relative:
            last = self._moves.last
            wanted += (angle if last is None else last) - settings.zero
        low, high = settings.limits.angle
        return AcceptedSetpoint(
            min(max(wanted, low), high),
            settings.number(0x6081) * settings.units.speed,
            settings.ramp(0x6083),
            settings.ramp(0x6084),
        )

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Follow the trapezoid; without a move, stop."""
        demand, fastest = self.demand, self.settings.profile_speed()
        if self._moves.current is None:
            demand.speed = approach(demand.speed, 0.0, self.settings.ramp(0x6084) * dt)
            demand.angle += demand.speed * dt
        else:
            demand.angle, demand.speed = self._moves.step(
                self._moves.current, demand.angle, demand.speed, fastest, dt
            )
        return self.by_position(demand.speed)

    def bits(self, windows: Windows) -> int:
        """10 target reached, 12 set-point acknowledged, 13 following error."""
        arrived = self._moves.current is None and windows.position_reached
        bits = _REACHED if arrived else 0
        bits |= _BIT_12 if self._taken or self._moves.next is not None else 0
        return bits | (_BIT_13 if windows.following_error else 0)


class ProfileVelocity(SetPoints):
    """PV: ramps to the target velocity 60FFh."""

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Ramp, within the limits."""
        settings, demand = self.settings, self.demand
        down = settings.ramp(0x6084)
        goal = settings.number(0x60FF) * settings.units.speed
        goal = self.within(self.clamped(goal, settings.profile_speed()), angle, down)
        faster = abs(goal) > abs(demand.speed) and goal * demand.speed >= 0
        demand.speed = approach(
            demand.speed, goal, (settings.ramp(0x6083) if faster else down) * dt
        )
        return self.by_speed(angle)

    def bits(self, windows: Windows) -> int:
        """10 target reached, 12 speed is zero."""
        return (_REACHED if windows.speed_reached else 0) | (_BIT_12 if windows.slow else 0)


class ProfileTorque(SetPoints):
    """PT: slopes (6087h) to the target torque 6071h; without a slope at once."""

    torque = True

    def __init__(self, settings: Settings, demand: DriveDemand) -> None:
        super().__init__(settings, demand)
        self._arrived = False

    def reset(self) -> None:
        """Start without torque."""
        self.demand.torque = 0.0

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command with the torque of the slope."""
        settings, demand = self.settings, self.demand
        unit = settings.units.torque
        goal, slope = settings.number(0x6071) * unit, settings.number(0x6087, 0, 0) * unit
        demand.torque = approach(demand.torque, goal, slope * dt) if slope else goal
        self._arrived = demand.torque == goal
        return self.by_torque(angle)

    def bits(self, windows: Windows) -> int:
        """10 target reached."""
        return _REACHED if self._arrived else 0
