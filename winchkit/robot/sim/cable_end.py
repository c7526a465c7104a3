"""Coupling of the winches to a common platform."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.arrays import Array
from winchkit.robot.sim.platform import CablePlatform

_LEAST_STEP = 5e-4
"""Shorter times of the platform are left to the next call, s: every instrument has its winch
advance by itself."""


class Coupling:
    """Advances the platform to the time that all winches have reached. Beyond it, at most one tick,
    each winch's cable continues with the last rate of its length."""

    def __init__(
        self,
        platform: CablePlatform,
        tension: Array,
        axial_stiffness: float,
        dead_length: Sequence[float],
    ) -> None:
        self.platform = platform
        platform.tension = tension
        self.ends = [
            CableEnd(self, index, axial_stiffness, dead) for index, dead in enumerate(dead_length)
        ]

    def advance(self) -> None:
        """Advance the platform to the time of the winch that is furthest behind."""
        platform, ends = self.platform, self.ends
        for end in ends:
            if end.time - platform.time < _LEAST_STEP:
                return
        to = min([end.time for end in ends])
        passed = to - platform.time
        start = [end.passed for end in ends]
        goal = [
            end.passed + passed / (end.time - platform.time) * (end.unstrained - end.passed)
            for end in ends
        ]
        platform.advance(to, start, goal, [1.0 / end.flexibility for end in ends])
        for end, value in zip(ends, goal, strict=True):
            end.passed = value


class CableEnd:
    """The platform as the load of one winch; takes the place of a hanging load."""

    def __init__(
        self, coupling: Coupling, index: int, axial_stiffness: float, dead_length: float
    ) -> None:
        platform = coupling.platform
        self._coupling, self._index = coupling, index
        self._axial_stiffness, self._dead_length = axial_stiffness, dead_length
        self.position, _, self._home_wrap = platform.cable[index]
        self.mass = platform.body.mass / platform.count
        """Share of the platform, kg, which the motor accelerates beside its own rotor."""
        self.time = platform.time
        self.tension = float(platform.tension[index])
        self.wrap_change = 0.0
        self.unstrained = self.passed = self.home_length
        """Unstrained cable now, and at the platform's time, m."""
        self.flexibility = self._flexibility(0.0)

    @property
    def home_length(self) -> float:
        """Unstrained free length at the start, m, for the initial force."""
        strained = self.position + self._dead_length
        return strained / (1 + self.tension / self._axial_stiffness) - self._dead_length

    def rest(self, cable_end: float, compliance: float) -> None:
        """Take the unstrained cable of the winch; the platform does not move at once."""
        self.unstrained = self.passed = cable_end
        self.flexibility = self._flexibility(compliance)
        self._take(0.0)

    def step(self, cable_end: float, end_speed: float, compliance: float, dt: float) -> None:
        """Advance by ``dt`` s; the unstrained length is then ``cable_end``."""
        # Only the winch that is furthest behind keeps the platform from advancing.
        furthest = self.time - self._coupling.platform.time < _LEAST_STEP
        self.time += dt
        self.unstrained = cable_end
        self.flexibility = self._flexibility(compliance)
        if furthest:
            self._coupling.advance()
        self._take(end_speed)

    def _take(self, end_speed: float) -> None:
        """Continue the cable from the platform's time; its unstrained end moves at a speed."""
        platform = self._coupling.platform
        length, speed, wrap = platform.cable[self._index]
        self.position = length + speed * (self.time - platform.time)
        stretch = self.position - self.unstrained
        pull = (stretch + platform.damping_time * (speed - end_speed)) / self.flexibility
        self.tension = max(0.0, pull) if stretch > 0 else 0.0
        self.wrap_change = wrap - self._home_wrap

    def _flexibility(self, compliance: float) -> float:
        """Elongation per force, m/N."""
        return compliance + (self.unstrained + self._dead_length) / self._axial_stiffness
