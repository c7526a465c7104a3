"""Control of the cable tension of one winch by its speed, evaluated once a cycle.

The winding speed is proportional to the tension error. A cable under load integrates it, with a
tension rate of stiffness times speed, so that the loop has no steady error at a fixed load and
needs no integrator that could wind up. It starts from rest at the present tension.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.motion import Ramp, Setpoint, fastest_within
from winchkit.errors import UsageError
from winchkit.schema.bench import LimitSpec
from winchkit.schema.profiles.winch import CableSpec

LOOP = 0.25
"""Gain times stiffness times delay: of 0.37, the limit of a response without overshoot, and 1.57,
the limit of stability, of an integrator with a delay."""
HELD = 0.01
"""Share of the set-point by which a held tension may differ at its end: the class of usual load
cells in a chain with pulleys (rule of thumb)."""
_MARGIN = 2e-3
"""Distance that is kept from the end of the declared travel, m."""
_STUCK = 0.5
"""Time for which the travel may be used up before the winch trips, s."""
SLACK_TIME = 0.2
"""A load that swings relieves its cable for less, s."""
SOFTER = 10.0
"""Times by which a cable with its structure may be softer than the bound of its stiffness: of a
fibre cable on a frame against its own elasticity by the data sheet."""
_STEEL = 210e9
"""Modulus of elasticity of steel, Pa: no cable is stiffer than a steel bar of its diameter."""


class TensionReading(NamedTuple):
    """The controlled tension in a cycle."""

    value: float
    """At the platform end, N; NaN without a valid reading."""
    age: float
    """s."""


@dataclass(frozen=True)
class TensionSetting:
    """Setpoint, bounds and delay of the control, SI."""

    tension: float
    """N."""
    travel: float
    """Largest travel of the cable from its start, in either direction, m."""
    speed: float
    """m/s."""
    stiffness: float
    """Upper bound of the stiffness of cable and structure, N/m."""
    delay: float
    """Delay of reading and drive together, s."""
    max_age: float
    """Older readings are not used, s."""
    slack: float = -math.inf
    """A cable whose tension is below is slack or broken, N."""

    @property
    def gain(self) -> float:
        """Winding speed per tension error, m/s/N."""
        return LOOP / (self.stiffness * self.delay)


def greatest_stiffness(cable: CableSpec, length: float, declared: float | None) -> float:
    """Upper bound of a cable's stiffness, N/m: as declared, by the profile, or of a steel bar."""
    if declared is not None:
        return declared
    axial = cable.axial_stiffness
    if axial is None and cable.diameter is not None:
        axial = _STEEL * math.pi * cable.diameter**2 / 4
    span = length + cable.dead_length
    if axial is None or not span > 0:
        raise UsageError(
            "the profile has neither axial_stiffness nor diameter of the cable, from which the "
            'gain is computed; give the stiffness, such as "20 kN/m"'
        )
    return axial / span


class BrokenCable:
    """Whether a cable stays slack although it has been wound in: it is broken or its load gone.

    A cable that has been taut is slack for no reason of the winding. One that is slack from the
    beginning is wound in by what stretches it to the set tension by the bound of its stiffness,
    and further as long as its tension rises by a tenth of what that bound says.
    """

    def __init__(self, setting: TensionSetting) -> None:
        self._setting = setting
        self._first: float | None = None
        self._taut = False
        self._since = math.inf

    def at(self, now: float, tension: float, wound: float) -> bool:
        """Take a tension (N) and the cable wound in since the beginning (m), once a cycle."""
        setting = self._setting
        if self._first is None:
            self._first = tension
        self._taut = self._taut or tension >= setting.slack
        rise = SOFTER * max(0.0, tension - self._first)
        explained = (setting.tension + rise) / setting.stiffness
        slack = tension < setting.slack and (self._taut or wound > explained)
        self._since = min(self._since, now) if slack else math.inf
        return now - self._since >= SLACK_TIME


class UsedUp:
    """Whether the travel of a control has been used up for 0.5 s, while it asks for more."""

    def __init__(self) -> None:
        self._since = math.inf

    def at(self, now: float, *, used_up: bool) -> bool:
        """Take whether it is used up at ``now`` (s), once a cycle."""
        self._since = min(self._since, now) if used_up else math.inf
        return now - self._since >= _STUCK


class TensionControl:
    """Keeps the tension until the command expires unless it is renewed; then ramps to rest."""

    holds = False
    joins = False

    def __init__(
        self,
        cable: CableMap,
        limits: LimitSpec,
        setting: TensionSetting,
        reading: Callable[[float], TensionReading],
        trip: Callable[[str], None],
        *,
        dead_man: DeadMan,
    ) -> None:
        """``reading`` gives the tension at a time (s), ``trip`` latches a reason in words."""
        self.setting, self.dead_man = setting, dead_man
        self._cable, self._limits = cable, limits
        self._reading, self._trip = reading, trip
        self._ramp = Ramp(limits.acceleration)
        self._begin = self._angle = self._last = 0.0
        self._used_up = UsedUp()
        self._broken = BrokenCable(setting)

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin at rest."""
        self._ramp = Ramp(self._limits.acceleration)
        self._begin = self._angle = angle
        self._last = time

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """Speed by the tension error, within speed and travel; rest without a valid reading."""
        live = self.dead_man.live(now)
        arm = self._cable.at(angle)[1]
        travelled = (angle - self._begin) * arm
        requested = self._requested(now, travelled) if live else 0.0
        speed = self._ramp.follow(requested, time)
        velocity = speed / arm
        self._angle += velocity * (time - self._last)
        self._last = time
        return Setpoint(velocity, self._angle, speed, done=not live and speed == 0.0)

    def _requested(self, now: float, travelled: float) -> float:
        setting = self.setting
        reading = self._reading(now)
        if not math.isfinite(reading.value) or reading.age > setting.max_age:
            return 0.0
        if self._broken.at(now, reading.value, travelled):
            self._trip(
                f"the tension is {reading.value:.1f} N, below {setting.slack:.1f} N, after "
                f"{travelled * 1e3:.1f} mm of winding in (negative: paid out), set is "
                f"{setting.tension:.1f} N; look for a broken or slack cable and a wrong load cell, "
                "reset, wind in by hand until it is taut"
            )
            return 0.0
        requested = setting.gain * (setting.tension - reading.value)
        fastest = min(setting.speed, self._limits.speed)
        requested = max(-fastest, min(fastest, requested))
        room = setting.travel - math.copysign(1.0, requested) * travelled - _MARGIN
        allowed = fastest_within(room, self._limits)
        if self._used_up.at(now, used_up=allowed == 0.0 and requested != 0.0):
            self._trip(
                f"the tension is {reading.value:.1f} N after {setting.travel * 1e3:.0f} mm of "
                f"cable (the declared travel), set is {setting.tension:.1f} N; look for a broken "
                "or jammed cable and a wrong load cell, then reset"
            )
        return math.copysign(min(abs(requested), allowed), requested)
