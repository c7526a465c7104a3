"""The modes PP, PV, HM, IP, CSP and CSV of CiA 402: commands to the motor, and measured values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from slave.dictionary import Dictionary
from slave.motor import Declared, Motor
from slave.power import Power, State

PP, PV, HM, IP, CSP, CSV = 1, 3, 6, 7, 8, 9
CYCLIC = (IP, CSP, CSV)
"""Modes that take a target at every SYNC."""
_TURN = 2 * math.pi
_DEFAULT_RAMP = 200.0
"""rad/s^2, where the slave has no ramp object or it is zero."""
_GAIN = 40.0
"""Of the position loop, 1/s."""
_MODES = {PP: 1 << 0, PV: 1 << 2, HM: 1 << 5, IP: 1 << 6, CSP: 1 << 7, CSV: 1 << 8}


@dataclass
class _Profile:
    """Set-points of PP and HM."""

    goal: float | None = None
    queue: list[float] = field(default_factory=list)
    acknowledged: bool = False
    reached: bool = True
    homed: bool = False
    searching: bool = False


class Motion:
    """Commands to the motor, and their objects; ``faults`` change both."""

    def __init__(
        self,
        objects: Dictionary,
        power: Power,
        motor: Motor,
        declared: Declared,
        faults: Mapping[str, Any],
    ) -> None:
        self.objects, self.power, self.motor = objects, power, motor
        self.declared, self.faults = declared, faults
        self.mode = 0
        self.reference = 0.0
        """Velocity that the motor follows, rad/s."""
        self.offset = 0
        """Added to the counts of the motor angle: home offset, or a fault's."""
        self.scaled = (0.0, 1.0)
        """Motor angle (rad) beyond which the counter changes by a multiple, and that multiple."""
        self._unit: float | None = None
        self._profile = _Profile()
        self._from = self._to = 0.0
        self._since = self._span = 0.0
        self._before = 0
        self._driven = False
        self._interpolates = False

    @property
    def unit(self) -> float:
        """rad of a position unit at the motor shaft (CiA 402-2, position actual value)."""
        if self.declared.counts is not None:
            return _TURN / self.declared.counts

        def ratio(index: int) -> float:
            above, below = self.objects.get(index, 1), self.objects.get(index, 2)
            return above / below if above > 0 and below > 0 else 0.0

        if self._unit is None:
            turn = ratio(0x6092) or ratio(0x608F)
            per_turn = turn / (ratio(0x6091) or 1.0)
            self._unit = _TURN / (per_turn if per_turn >= 16 else 65536)
        return self._unit

    def rescale(self) -> None:
        """An object that says something of units may have been written."""
        self._unit = None

    @property
    def velocity_unit(self) -> float:
        """rad/s of a velocity count."""
        return self.declared.velocity_unit or self.unit

    def restart(self) -> None:
        """As after power-on; an absolute encoder, unless a fault makes its counter begin anew."""
        self.mode, self.reference = self.objects.get(0x6060), 0.0
        self.rescale()
        begins = self.faults.get("counter begins anew")
        if begins is not None:
            self.offset = int(begins) - round(self.motor.angle / self.unit)
        self._hold()

    def counts(self) -> int:
        """6064h: the counter has a declared number of bits."""
        span = 1 << self.declared.counter_bits
        start, multiple = self.scaled
        angle = start + (self.motor.angle - start) * multiple
        raw = round(angle / self.unit) + self.offset
        return (raw + span // 2) % span - span // 2

    def select(self, mode: int) -> None:
        """6060h was written; a mode that the slave lacks changes nothing."""
        supported = self.objects.get(0x6502, 0, 0xFFFFFFFF) or 0xFFFFFFFF
        if mode in _MODES and supported & _MODES[mode]:
            self.mode = mode
            self._hold()

    def sync(self, span: float) -> None:
        """A SYNC: the target of CSP or IP is reached over the next period ``span`` (s)."""
        if self.mode == CSP or (self.mode == IP and self._interpolates):
            here = self._from + (self._to - self._from) * self._share()
            if self.mode == IP:
                target = self.objects.get(0x60C1, 1)
            else:
                target = self.objects.get(0x607A) + self.objects.get(0x60B0)
            away = (target - self.counts()) * self.unit
            self._from, self._to = here, self.motor.angle + away
            self._since, self._span = 0.0, max(span, 1e-4)

    def command(self, word: int) -> None:
        """The bits of a control word that belong to the mode."""
        rising = word & ~self._before
        self._before = word
        profile = self._profile
        # CiA 402-2, interpolated position mode: bit 4 enables the interpolation; without it the
        # drive holds where it is, whatever stands in 60C1h.
        interpolates = self.power.state is State.ENABLED and bool(word & 0x10)
        if self.mode == IP and interpolates != self._interpolates:
            self._hold()
        self._interpolates = interpolates
        if self.power.state is not State.ENABLED:
            profile.acknowledged = False
            return
        if self.mode == PP:
            if rising & 0x10:
                self._new_set_point(word)
            profile.acknowledged = bool(word & 0x10)
        elif self.mode == HM and rising & 0x10:
            profile.searching, profile.homed, profile.reached = True, False, False

    def advance(self, dt: float) -> None:
        """One step of the motor."""
        enabled = self.power.driven
        if enabled and not self._driven:
            self.reference = self.motor.velocity
            self._hold()
        self._driven = enabled
        self._since += dt
        turning = self.faults.get("turns while disabled")
        if not enabled:
            self.reference = 0.0
            self.motor.advance(dt, None if turning is None else float(turning))
            return
        if self.power.braking is not None:
            self._ramp(0.0, 0x6085 if self.power.braking == "quick" else 0x6084, dt)
        elif self.power.state is State.QUICK_STOP:
            self.reference = 0.0
        elif self.power.halted:
            self._ramp(0.0, 0x6085 if self.objects.get(0x605D, 0, 1) == 2 else 0x6084, dt)
        else:
            self._follow(dt)
            driven = self.faults.get("driven by its load")
            if driven is not None:
                self.motor.advance(dt, float(driven))
                return
            wrong = self.faults.get("follows wrongly")
            if wrong is not None:
                self.motor.advance(dt, self.reference * float(wrong))
                return
        self.motor.advance(dt, self.reference)

    def status(self) -> int:
        """Bits 10, 12 and 13 of the status word."""
        profile, enabled = self._profile, self.power.state is State.ENABLED
        if self.mode == PP:
            return (0x400 if profile.reached else 0) | (0x1000 if profile.acknowledged else 0)
        if self.mode == PV:
            target = self.objects.get(0x60FF) * self.velocity_unit
            reached = abs(self.motor.velocity - target) < 0.05
            return (0x400 if reached else 0) | (0x1000 if self.motor.at_rest else 0)
        if self.mode == HM:
            if not enabled and "homing forgotten" in self.faults:
                return 0
            idle = not profile.searching
            return (0x400 if idle else 0) | (0x1000 if profile.homed else 0)
        if self.mode == IP:
            return 0x1000 if enabled and self._interpolates else 0
        return 0x1000 if enabled and self.mode in (CSP, CSV) else 0

    def publish(self) -> None:
        """Write what the slave measures into its objects."""
        objects, unit = self.objects, self.velocity_unit
        velocity = self.motor.velocity * float(self.faults.get("velocity scaled", 1.0))
        if self.declared.velocity_resolution:
            step = self.declared.velocity_resolution
            velocity = round(velocity / step) * step
        if "velocity stuck" not in self.faults:
            objects.set(0x606C, 0, round(velocity / unit))
        if "position stuck" not in self.faults:
            objects.set(0x6064, 0, self.counts())
        objects.set(0x606B, 0, round(self.reference / unit))
        objects.set(0x6062, 0, self.objects.get(0x607A))
        objects.set(0x6061, 0, self.faults.get("mode lies", self.mode))

    def _hold(self) -> None:
        """Nothing is aimed at but the place where the motor is."""
        self._profile = _Profile()
        self._from = self._to = self.motor.angle
        self._span = self._since = 0.0

    def _share(self) -> float:
        return min(1.0, self._since / self._span) if self._span else 1.0

    def _follow(self, dt: float) -> None:
        velocity = (self.objects.get(0x60FF) + self.objects.get(0x60B1)) * self.velocity_unit
        if self.mode == PV or (self.mode == CSV and not self.declared.ramps):
            slower = abs(velocity) < abs(self.reference) or velocity * self.reference < 0
            self._ramp(velocity, 0x6084 if slower else 0x6083, dt)
        elif self.mode == CSV:
            self.reference = velocity
        elif self.mode in (CSP, IP):
            share = self._share()
            fresh = 0 < self._since < 1.5 * self._span
            feed = (self._to - self._from) / self._span if fresh else 0.0
            goal = self._from + (self._to - self._from) * share
            self.reference = feed + _GAIN * (goal - self.motor.angle)
            self._check_following(goal)
        elif self.mode == PP:
            self._towards(self._profile.goal, self.objects.get(0x6081), dt)
        elif self.mode == HM and self._profile.searching:
            self._search(dt)
        else:
            self.reference = 0.0

    def _ramp(self, wanted: float, index: int, dt: float) -> None:
        step = (self.objects.get(index) * self.velocity_unit or _DEFAULT_RAMP) * dt
        change = wanted - self.reference
        self.reference += max(-step, min(step, change))

    def _check_following(self, goal: float) -> None:
        window = self.objects.get(0x6065, 0, -1) & 0xFFFFFFFF
        if 0 < window < 0xFFFFFFFF and abs(goal - self.motor.angle) > window * self.unit:
            self.power.fail(0x8611)

    def _new_set_point(self, word: int) -> None:
        target = self.objects.get(0x607A)
        here = self.counts()
        away = target if word & 0x40 else target - here
        goal, profile = self.motor.angle + away * self.unit, self._profile
        if word & 0x20 or profile.reached:
            profile.goal, profile.queue = goal, []
        else:
            profile.queue = [goal]
        profile.reached = False

    def _towards(self, goal: float | None, speed: int, dt: float) -> None:
        """A trapezoid towards a goal: as fast as the way that is left allows."""
        if goal is None:
            self._ramp(0.0, 0x6084, dt)
            return
        profile, left = self._profile, goal - self.motor.angle
        slow = self.objects.get(0x6084) * self.velocity_unit or _DEFAULT_RAMP
        most = speed * self.velocity_unit
        near = min(most, math.sqrt(2 * slow * abs(left)), _GAIN * abs(left))
        self._ramp(math.copysign(near, left), 0x6083, dt)
        if abs(self.reference) > near:
            self.reference = math.copysign(near, left)
        if abs(left) < 2 * self.unit and self.motor.at_rest:
            profile.reached = True
            if profile.queue:
                profile.goal, profile.reached = profile.queue.pop(0), False

    def _search(self, dt: float) -> None:
        """35 and 37 take the place; any other method looks for the declared switch."""
        profile, away = self._profile, self.declared.home_switch - self.motor.angle
        if self.objects.get(0x6098) not in (35, 37) and abs(away) > 2 * self.unit:
            fast = abs(away) > self.objects.get(0x6099, 2) * self.velocity_unit
            self._towards(self.declared.home_switch, self.objects.get(0x6099, 1 if fast else 2), dt)
            return
        if not self.motor.at_rest:
            self._ramp(0.0, 0x6084, dt)
            return
        zero = 0 if "home offset ignored" in self.faults else self.objects.get(0x607C)
        self.offset = zero - round(self.motor.angle / self.unit)
        profile.searching, profile.homed, profile.reached = False, True, True
        self.reference = 0.0
