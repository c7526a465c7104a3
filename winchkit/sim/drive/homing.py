"""Homing of a simulated drive (HM): searches for switches and index pulses, by method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import floor, inf, isinf, pi

from winchkit.sim.drive.demand import DriveDemand, SetPoints, Windows, approach
from winchkit.sim.drive.settings import Settings
from winchkit.sim.plant.servo import DriveCommand

_START = 1 << 4
_REACHED, _ATTAINED, _ERROR = 1 << 10, 1 << 12, 1 << 13
_SWITCH, _ZERO = 1, 2
"""Sub-indices of the homing speeds 6099h."""
_TURN = 2 * pi


@dataclass
class Switches:
    """Positions of the switches of an axis and of its encoder's index pulse, rad of the motor.

    A limit switch is on at and beyond its angle, the home switch between two angles; a switch at
    infinity is not fitted.
    """

    negative: float = -inf
    positive: float = inf
    home: tuple[float, float] = (inf, inf)
    index: float = 0.0
    """One of the angles of the index pulse, one per turn."""

    def on(self, name: str, angle: float) -> bool:
        """Whether the switch ``negative``, ``positive`` or ``home`` is on."""
        if name == "negative":
            return angle <= self.negative
        if name == "positive":
            return angle >= self.positive
        return self.home[0] <= angle <= self.home[1]

    def fitted(self, name: str) -> bool:
        """Whether the switch is fitted."""
        places = {"negative": (self.negative,), "positive": (self.positive,), "home": self.home}
        return not all(isinf(place) for place in places[name])

    def inputs(self, angle: float) -> int:
        """Digital inputs 60FDh: bit 0 negative limit, 1 positive limit, 2 home."""
        names = ("negative", "positive", "home")
        return sum(1 << bit for bit, name in enumerate(names) if self.on(name, angle))


@dataclass(frozen=True)
class _Leg:
    """Motion in a direction until a switch is on or off, or until the index pulse."""

    direction: int
    speed: int
    until: str
    """``on``, ``off`` or ``index``."""
    switch: str = ""


def _towards(switch: str, first: int, *, leave: bool) -> tuple[_Leg, _Leg]:
    """Fast search for a switch in a direction, and slow search for its edge from the other side."""
    there, back = ("on", "off") if leave else ("off", "on")
    return _Leg(first, _SWITCH, there, switch), _Leg(-first, _ZERO, back, switch)


_BY_SWITCH: dict[int, tuple[_Leg, ...]] = {
    17: _towards("negative", -1, leave=True),
    18: _towards("positive", 1, leave=True),
    19: _towards("home", 1, leave=True),
    20: _towards("home", -1, leave=False),
    21: _towards("home", -1, leave=True),
    22: _towards("home", 1, leave=False),
}
_LEGS: dict[int, tuple[_Leg, ...]] = {
    **_BY_SWITCH,
    **{
        method - 16: (*legs, _Leg(legs[-1].direction, _ZERO, "index"))
        for method, legs in _BY_SWITCH.items()
    },
    33: (_Leg(-1, _ZERO, "index"),),
    34: (_Leg(1, _ZERO, "index"),),
    35: (),
    37: (),
}
HOMING_METHODS = frozenset(_LEGS)
"""Simulated values of 6098h: 1 to 6 are 17 to 22 with the index pulse after the edge."""


class _Phase(Enum):
    IDLE = _REACHED
    RUNNING = 0
    STOPPING = _ATTAINED
    DONE = _ATTAINED | _REACHED
    FAILED = _ERROR


class HomingMode(SetPoints):
    """HM: a set bit 4 of the control word starts a search, a cleared one ends it."""

    def __init__(
        self, settings: Settings, demand: DriveDemand, switches: Callable[[], Switches]
    ) -> None:
        super().__init__(settings, demand)
        self._switches = switches
        self._phase = _Phase.IDLE
        self._legs: list[_Leg] = []
        self._until = 0.0

    def reset(self) -> None:
        """Abort a search; an attained home position stays valid."""
        if self._phase is not _Phase.DONE:
            self._phase = _Phase.IDLE

    def control(self, word: int, rising: int, angle: float, *, enabled: bool) -> None:
        """Start with a rising bit 4; continue while it is set."""
        if rising & _START and enabled:
            self._start(angle)
        elif not word & _START and self._phase is _Phase.RUNNING:
            self._phase = _Phase.IDLE

    def _start(self, angle: float) -> None:
        number, switches = self.settings.number, self._switches()
        self._legs = list(_LEGS[number(0x6098)])
        possible = all(not leg.switch or switches.fitted(leg.switch) for leg in self._legs) and all(
            number(0x6099, leg.speed) for leg in self._legs
        )
        self._phase = _Phase.RUNNING if possible else _Phase.FAILED
        if possible:
            self._next_leg(angle)

    def _next_leg(self, angle: float) -> None:
        """Start the next leg; after the last one the position is home."""
        if not self._legs:
            self.settings.take_home(angle)
            self._phase = _Phase.STOPPING
        elif self._legs[0].until == "index":
            place = self._switches().index
            turns = (angle - place) / _TURN
            whole = floor(turns) + 1 if self._legs[0].direction > 0 else -floor(-turns) - 1
            self._until = place + whole * _TURN

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Continue the search, or stop."""
        demand, rate = self.demand, self.settings.ramp(0x609A)
        if self._phase is _Phase.RUNNING:
            self._search(angle)
        goal = 0.0
        if self._phase is _Phase.RUNNING:
            leg = self._legs[0]
            goal = leg.direction * self.settings.number(0x6099, leg.speed)
        demand.speed = approach(demand.speed, goal * self.settings.units.speed, rate * dt)
        if self._phase is _Phase.STOPPING and demand.speed == 0:
            self._phase = _Phase.DONE
        return self.by_speed(angle)

    def _search(self, angle: float) -> None:
        switches, leg = self._switches(), self._legs[0]
        if leg.until == "index":
            if (angle - self._until) * leg.direction >= 0:
                self._found(self._until)
        elif switches.on(leg.switch, angle) == (leg.until == "on"):
            self._found(angle)
        elif leg.switch == "home" and switches.on(_LIMIT[leg.direction], angle):
            self._phase = _Phase.FAILED

    def _found(self, angle: float) -> None:
        self._legs.pop(0)
        self._next_leg(angle)

    def bits(self, windows: Windows) -> int:
        """10 target reached, 12 homing attained, 13 homing error."""
        bits = self._phase.value
        return bits | (_REACHED if self._phase is _Phase.FAILED and not self.demand.speed else 0)


_LIMIT = {-1: "negative", 1: "positive"}
