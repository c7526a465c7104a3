"""Integration of a motion with dry friction and bounded states, every switch an event.

Between events the motion is smooth and integrated by an embedded Runge-Kutta pair of order 5(4)
(Dormand, J. R., Prince, P. J., 1980), whose step is one compiled expression. A step that ends
behind an event is shortened to it: the event is the root of its function over the length of the
step, so that it is as exact as the step.

Events are a reversal, from which the motor moves on or sticks (it sticks while neither direction
accelerates it; Filippov, A. F., 1988), its release, and a state that reaches or leaves a bound. At
a bound the parts that were apart move together: their momentum stays, and the speed falls by the
ratio of the inertias.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import copysign, isfinite

import numpy as np
from scipy.optimize import brentq

from winchkit.arrays import Array
from winchkit.dynamics.balance import Balance
from winchkit.dynamics.drives import Drive, Inputs
from winchkit.dynamics.expression import Expression, apply, compiled, number, substituted, symbol
from winchkit.errors import UsageError

_STAGES = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
_TIMES = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
_ERRORS = (
    71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40,
)  # fmt: skip
"""Coefficients of the pair: stages, their times, and the difference of both orders."""
_FLOOR = 1e-3
"""SI: a state below it counts as this size in the tolerance."""
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 5.0
"""Usual factors of the step's length (Hairer, Nørsett, Wanner, Solving ODEs I, II.4)."""
_SHORTEST = 1e-12
"""s: a step this short makes no progress; events and stiffness end the integration then."""
_NUDGE = 1e-9
"""Speed that gives a standstill its direction, rad/s or m/s: its size has no influence."""
_ROOT = 1e-14
"""s: an event is located to it, near the rounding of times of some minutes."""

Numbers = tuple[float, ...]


def runge_kutta(rates: Mapping[str, Expression], tolerance: float) -> list[Expression]:
    """A step of length ``step``: the new states, of which ``rates`` are the derivatives, and its
    error in tolerances."""
    step, names, slopes = symbol("step"), list(rates), list(rates.values())
    k, moved = [slopes], dict[str, Expression]()
    for weights, share in zip(_STAGES, _TIMES, strict=True):
        moved = {name: _advanced(name, i, weights, k) for i, name in enumerate(names)}
        there = {**moved, "time": symbol("time") + number(share) * step}
        k.append(substituted(slopes, there))
    error = number(0.0)
    for i, name in enumerate(names):
        off = apply("absolute", step * _weighted(i, _ERRORS, k))
        size = apply("maximum", apply("absolute", symbol(name)), apply("absolute", moved[name]))
        error = apply("maximum", error, off / (number(tolerance) * (size + number(_FLOOR))))
    return [*moved.values(), error]


def _weighted(i: int, weights: Sequence[float], k: Sequence[Sequence[Expression]]) -> Expression:
    total = number(0.0)
    for weight, slopes in zip(weights, k, strict=False):
        total = total + number(weight) * slopes[i]
    return total


def _advanced(
    name: str, i: int, weights: Sequence[float], k: Sequence[Sequence[Expression]]
) -> Expression:
    return symbol(name) + symbol("step") * _weighted(i, weights, k)


@dataclass(frozen=True)
class SimulatedMotion:
    """A simulated motion; arrays (n,), SI."""

    time: Array
    angle: Array
    speed: Array
    acceleration: Array
    torque: Array
    """Of the motor, in the units of its drive."""
    load: Array
    direction: Array
    """−1, 1, or 0 at standstill."""


@dataclass(frozen=True)
class _Mode:
    """Direction of the motion, 0 at standstill, and 1 for each state that may change."""

    direction: float
    is_still: bool
    open: Numbers


@dataclass(frozen=True)
class _Instant:
    """A time with the states, the mode and the inputs from there on."""

    time: float
    states: Numbers
    mode: _Mode
    inputs: Numbers


@dataclass(frozen=True)
class Integrator:
    """Integrates one balance under one drive and given inputs."""

    balance: Balance
    drive: Drive
    inputs: Inputs
    tolerance: float = 1e-8

    @cached_property
    def _states(self) -> list[str]:
        own = [state.name for state in self.balance.states]
        return ["angle", "speed", *own, *self.drive.rates]

    @cached_property
    def _arguments(self) -> list[str]:
        opened = [state.open for state in self.balance.states]
        return ["time", *self._states, "direction", *opened, *self.inputs.symbols]

    @cached_property
    def _rates(self) -> dict[str, Expression]:
        b, torque = self.balance, {"torque": self.drive.torque}
        acceleration, *own = substituted([b.acceleration, *b.rates], torque)
        opened = {s.name: symbol(s.open) * rate for s, rate in zip(b.states, own, strict=True)}
        return {"angle": symbol("speed"), "speed": acceleration, **opened, **self.drive.rates}

    @cached_property
    def _moving(self) -> Callable[..., Numbers]:
        return compiled(runge_kutta(self._rates, self.tolerance), ["step", *self._arguments])

    @cached_property
    def _still(self) -> Callable[..., Numbers]:
        """The same of a motor at rest: only the drive's own states change."""
        held = {name: number(0.0) for name in self._rates} | dict(self.drive.rates)
        return compiled(runge_kutta(held, self.tolerance), ["step", *self._arguments])

    @cached_property
    def _at(self) -> Callable[..., Numbers]:
        """Acceleration, inertia, torque, load, and the rates of the states without bounds."""
        b, torque = self.balance, {"torque": self.drive.torque}
        roots = [b.acceleration, b.inertia, self.drive.torque, b.load, *b.rates]
        return compiled(substituted(roots, torque), self._arguments)

    def run(self, time: Array, angle: float, speed: float) -> SimulatedMotion:
        """Integrate from an angle and a speed at the first of the times (n,), s; raises UsageError
        where the cable becomes slack or the motion cannot be integrated."""
        y: Numbers = (
            angle, speed, *(s.start for s in self.balance.states), *self.drive.states.values()
        )  # fmt: skip
        rows: list[Numbers] = []
        intervals, breaks = self.inputs.rows(), self.inputs.time.tolist()
        row = intervals[0]
        at = _Instant(breaks[0], y, self._decided(breaks[0], y, row), row)
        rows.append(self._row(at))
        length, k = breaks[1] - breaks[0], 0
        for sample in time.tolist()[1:]:
            while at.time < sample:
                while k < len(intervals) - 1 and at.time >= breaks[k + 1]:
                    k += 1
                    at = replace(at, inputs=intervals[k])
                end = breaks[k + 1] if k < len(intervals) - 1 else sample
                at, length = self._advance(at, length, min(sample, end))
            rows.append(self._row(at))
        return SimulatedMotion(time, *np.array(rows).T)

    def _advance(self, at: _Instant, length: float, goal: float) -> tuple[_Instant, float]:
        """One step at most; returns where it ends and the length of the next step."""
        h = min(length, goal - at.time)
        new, error = self._step(at, h)
        if not error <= 1.0:
            shorter = h * max(_LEAST, _SAFETY * error**-0.2) if isfinite(error) else h * _LEAST
            if shorter < _SHORTEST:
                raise UsageError(
                    f"the motion cannot be integrated from {at.time:.6g} s on: the step would be "
                    f"below {_SHORTEST:g} s; a gain or a stiffness is too large, or a value is not "
                    "finite"
                )
            return at, shorter
        longer = max(length, h * min(_MOST, _SAFETY * max(error, 1e-10) ** -0.2))
        event = self._first_event(at, h, new)
        if event is None:
            time = goal if at.time + h >= goal - _ROOT else at.time + h
            return replace(at, time=time, states=new), longer
        h, which = event
        there = replace(at, time=at.time + h, states=self._step(at, h)[0])
        return self._switched(there, which), length

    def _step(self, at: _Instant, h: float) -> tuple[Numbers, float]:
        step = self._still if at.mode.is_still else self._moving
        mode = at.mode
        *new, error = step(h, at.time, *at.states, mode.direction, *mode.open, *at.inputs)
        return tuple(new), error if isfinite(sum(new)) else float("inf")

    # Events: functions that are above zero behind the event.

    def _events(self, time: float, y: Numbers, mode: _Mode, row: Numbers) -> list[float]:
        if mode.is_still:
            return [s * self._started(time, y, row, s)[0] for s in (1.0, -1.0)]
        if mode.direction == 0.0:
            return []
        return [
            -mode.direction * y[1],
            *(
                max(value - state.high, state.low - value) if is_open else -1.0
                for value, state, is_open in zip(
                    y[2:], self.balance.states, mode.open, strict=False
                )
            ),
        ]

    def _first_event(self, at: _Instant, h: float, new: Numbers) -> tuple[float, int] | None:
        """Length of the step to the first event, and its number; None without one."""

        def behind(length: float, i: int) -> float:
            there = self._step(at, length)[0] if length else at.states
            return self._events(at.time + length, there, at.mode, at.inputs)[i]

        found = []
        for i, value in enumerate(self._events(at.time + h, new, at.mode, at.inputs)):
            if value <= 0.0:
                continue
            inner = 0.0
            if behind(0.0, i) >= 0.0:
                # It starts on the event itself, at rest or at a bound, and comes back to it.
                inner = h
                while behind(inner, i) > 0.0 and inner > _SHORTEST:
                    inner /= 2
                if inner <= _SHORTEST:
                    found.append((_SHORTEST if at.mode.is_still else h, i))
                    continue
            found.append((float(brentq(behind, inner, h, args=(i,), xtol=_ROOT)), i))
        return min(found) if found else None

    def _switched(self, at: _Instant, event: int) -> _Instant:
        """States and mode behind an event; a speed of zero and a bound are made exact."""
        time, mode, row = at.time, at.mode, at.inputs
        if mode.is_still:
            # The acceleration is zero here, and grows in the direction of the event.
            direction = 1.0 if event == 0 else -1.0
            opened = self._openings(time, at.states, row, direction)
            return replace(at, mode=_Mode(direction, False, opened))
        new = list(at.states)
        if event == 0:
            new[1] = 0.0
        else:
            state = self.balance.states[event - 1]
            new[1 + event] = state.high if new[1 + event] > 0 else state.low
            held = tuple(0.0 if i == event - 1 else o for i, o in enumerate(mode.open))
            before, after = (
                self._at(time, *new, mode.direction, *opened, *row)[1]
                for opened in (mode.open, held)
            )
            if not before > 0.0:
                raise UsageError(
                    f"effect '{state.term.effect.id}': the motor has no inertia of its own while "
                    "the parts are apart; add the effect rotor-inertia"
                )
            new[1] *= before / after
        states = tuple(new)
        return replace(at, states=states, mode=self._decided(time, states, row))

    def _decided(self, time: float, y: Numbers, row: Numbers) -> _Mode:
        """The mode in which a state continues."""
        if not self.balance.is_directed:
            return _Mode(0.0, False, ())
        if y[1] != 0.0:
            direction = copysign(1.0, y[1])
            return _Mode(direction, False, self._openings(time, y, row, direction))
        forth, ahead = self._started(time, y, row, 1.0)
        back, behind = self._started(time, y, row, -1.0)
        if max(forth, -back) <= 0.0:
            return _Mode(0.0, True, ahead)
        return _Mode(1.0, False, ahead) if forth >= -back else _Mode(-1.0, False, behind)

    def _started(
        self, time: float, y: Numbers, row: Numbers, direction: float
    ) -> tuple[float, Numbers]:
        """Acceleration of a motor at rest that starts in a direction, and the open states."""
        opened = self._openings(time, y, row, direction)
        found = self._at(time, y[0], 0.0, *y[2:], direction, *opened, *row)
        return found[0], opened

    def _openings(self, time: float, y: Numbers, row: Numbers, direction: float) -> Numbers:
        """1 for each state that may change, 0 for one that would leave its bounds."""
        states = self.balance.states
        if not states:
            return ()
        speed, ones = y[1] or direction * _NUDGE, (1.0,) * len(states)
        rates = self._at(time, y[0], speed, *y[2:], direction, *ones, *row)[4:]
        return tuple(
            0.0 if (v >= s.high and r > 0.0) or (v <= s.low and r < 0.0) else 1.0
            for v, s, r in zip(y[2:], states, rates, strict=False)
        )

    def _row(self, at: _Instant) -> Numbers:
        """Angle, speed, acceleration, torque, load and direction."""
        time, y, mode = at.time, at.states, at.mode
        inputs = (time, *y, mode.direction, *mode.open, *at.inputs)
        acceleration, _, torque, load, *_ = self._at(*inputs)
        if mode.is_still:
            # At rest nothing accelerates the load.
            acceleration, load = 0.0, self.balance.load_at_rest or load
        if load < 0.0:
            raise UsageError(
                f"the cable is slack at {time:.4g} s: its tension would be {load:.3g} N, below 0; "
                "the load no longer follows the winch, so that the motion is not defined; at the "
                "start of a run the torque does not hold the load, as one with the wrong sign"
            )
        return y[0], y[1], acceleration, torque, load, mode.direction


def holding_torque(balance: Balance, inputs: Inputs, angle: float) -> float:
    """Torque that holds a motor at rest, in the middle of what friction bears, N m."""
    integrator = Integrator(balance, Drive(number(0.0)), inputs)
    row, time = inputs.rows()[0], float(inputs.time[0])
    y: Numbers = (angle, 0.0, *(s.start for s in balance.states))
    sides = []
    for direction in (1.0, -1.0):
        _, opened = integrator._started(time, y, row, direction)
        found = integrator._at(time, *y, direction, *opened, *row)
        sides.append(-found[0] * found[1])
    return sum(sides) / 2
