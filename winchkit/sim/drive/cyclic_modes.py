"""The modes of a simulated drive with set-points of the master: CSP, CSV, CST, IP."""

from __future__ import annotations

from collections import deque
from math import inf

from winchkit.sim.drive.demand import DriveDemand, SetPoints, Windows, approach
from winchkit.sim.drive.settings import Settings
from winchkit.sim.plant.servo import DriveCommand


class MovingAverage:
    """Mean of a signal over the last ``duration`` s; without a duration the signal itself."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._parts: deque[tuple[float, float]] = deque()
        self._time = self._sum = 0.0

    def begin(self, value: float) -> None:
        """Restart, as if the signal had always had this value."""
        self._parts.clear()
        self._parts.append((self._duration, value))
        self._time, self._sum = self._duration, self._duration * value

    def step(self, value: float, dt: float) -> float:
        """Mean after another ``dt`` s with this value."""
        if dt >= self._duration:
            self.begin(value)
            return value
        self._parts.append((dt, value))
        self._time += dt
        self._sum += dt * value
        while (surplus := self._time - self._duration) > 0:
            length, oldest = self._parts.popleft()
            dropped = min(length, surplus)
            self._time -= dropped
            self._sum -= dropped * oldest
            if dropped < length:
                self._parts.appendleft((length - dropped, oldest))
                break
        return self._sum / self._time


_BIT_12, _BIT_13 = 1 << 12, 1 << 13
_INTERPOLATE = 1 << 4


class _Interpolation:
    """Linear interpolation to each target within the interpolation period (60C2h)."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._from = self._goal = 0.0
        self._elapsed = inf

    def aim(self, start: float, goal: float) -> None:
        """Set a new target, to be reached in one period from the present demand."""
        self._from, self._goal, self._elapsed = start, goal, 0.0

    def step(self, dt: float) -> float:
        """Demand after another ``dt`` s."""
        period = self._settings.limits.period
        self._elapsed += dt
        if self._elapsed >= period:
            return self._goal
        return self._from + (self._goal - self._from) * self._elapsed / period


class CyclicPosition(SetPoints):
    """CSP: target position 607Ah and its offset 60B0h, with 60B1h fed forward."""

    position = True
    cyclic = True

    def __init__(self, settings: Settings, demand: DriveDemand, smoothing: float = 0.0) -> None:
        super().__init__(settings, demand)
        self._interpolation = _Interpolation(settings)
        self._smooth = MovingAverage(smoothing)
        self._wanted = 0.0
        self._clipped = False

    def begin(self) -> None:
        """Continue towards the target."""
        self._wanted = self.demand.angle
        self._smooth.begin(self.demand.angle)
        self.aim()

    def aim(self) -> None:
        """Move to the target within the software limits."""
        low, high = self.settings.limits.angle
        wanted = self.target()
        goal = min(max(wanted, low), high)
        self._clipped = goal != wanted
        self._interpolation.aim(self._wanted, goal)

    def target(self) -> float:
        """Target motor angle of the master, rad."""
        number = self.settings.number
        return self.settings.angle(number(0x607A) + number(0x60B0, 0, 0))

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Follow the interpolated target, at most at the motor's highest speed."""
        self._wanted = self._interpolation.step(dt)
        demand, wanted = self.demand, self._smooth.step(self._wanted, dt)
        before = demand.angle
        demand.angle = approach(before, wanted, self.settings.limits.top_speed * dt)
        demand.limited = self._clipped or demand.angle != wanted
        demand.speed = (demand.angle - before) / dt
        extra = self.settings.number(0x60B1, 0, 0) * self.settings.units.speed
        return self.by_position(demand.speed + extra)

    def bits(self, windows: Windows) -> int:
        """12 drive follows the command, 13 following error."""
        return _BIT_12 | (_BIT_13 if windows.following_error else 0)


class InterpolatedPosition(CyclicPosition):
    """IP: the data record 60C1h:1, while bit 4 of the control word is set."""

    cyclic = False

    def __init__(self, settings: Settings, demand: DriveDemand, smoothing: float = 0.0) -> None:
        super().__init__(settings, demand, smoothing)
        self._active = False

    def reset(self) -> None:
        """Wait for bit 4."""
        self._active = False

    def control(self, word: int, rising: int, angle: float, *, enabled: bool) -> None:
        """Bit 4 starts and ends the interpolation."""
        wanted = enabled and bool(word & _INTERPOLATE)
        if wanted != self._active:
            self._active = wanted
            self.aim()

    def target(self) -> float:
        """Target motor angle of the master, rad; the present one while bit 4 is not set."""
        if not self._active:
            return self.demand.angle
        return self.settings.angle(self.settings.number(0x60C1, 1))

    def bits(self, windows: Windows) -> int:
        """10 target reached, 12 interpolation active, 13 following error."""
        bits = _BIT_12 if self._active else 0
        bits |= 1 << 10 if windows.position_reached else 0
        return bits | (_BIT_13 if windows.following_error else 0)


class CyclicVelocity(SetPoints):
    """CSV: target velocity 60FFh and its offset 60B1h.

    ``smoothing`` (s) averages the targets, as drives can, to suppress the jitter of the master's
    cycle.
    """

    cyclic = True

    def __init__(self, settings: Settings, demand: DriveDemand, smoothing: float) -> None:
        super().__init__(settings, demand)
        self._interpolation = _Interpolation(settings)
        self._smooth = MovingAverage(smoothing)
        self._wanted = 0.0

    def begin(self) -> None:
        """Continue from the present speed."""
        self._wanted = self.demand.speed
        self._smooth.begin(self.demand.speed)
        self.aim()

    def aim(self) -> None:
        """Move to the target within the interpolation period."""
        number = self.settings.number
        goal = (number(0x60FF) + number(0x60B1, 0, 0)) * self.settings.units.speed
        self._interpolation.aim(self._wanted, goal)

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Follow the interpolated target within the motor's speed and deceleration."""
        demand = self.demand
        self._wanted = self._interpolation.step(dt)
        goal = self.clamped(self._smooth.step(self._wanted, dt), self.settings.limits.top_speed)
        hardest = self.settings.ramp(0x60C6)
        goal = self.within(goal, angle, hardest)
        demand.speed = approach(demand.speed, goal, hardest * dt)
        demand.limited |= demand.speed != goal
        return self.by_speed(angle)

    def bits(self, windows: Windows) -> int:
        """12 drive follows the command."""
        return _BIT_12


class CyclicTorque(SetPoints):
    """CST: target torque 6071h and its offset 60B2h."""

    torque = True
    cyclic = True

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command with the target torque."""
        number = self.settings.number
        self.demand.torque = (number(0x6071) + number(0x60B2, 0, 0)) * self.settings.units.torque
        return self.by_torque(angle)

    def bits(self, windows: Windows) -> int:
        """12 drive follows the command."""
        return _BIT_12
