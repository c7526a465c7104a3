"""Simulated motions with dry friction and backlash against scipy's solver with its own events.

The motions are written here from textbooks: a mass whose friction has the direction of its speed,
at rest while no larger force acts on it, and a rotor between two flanks. Each interval between two
samples of the torque, a straight line, is integrated to 1e-13, and anew behind each event.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from simulated_profiles import (
    ARM,
    AXIS,
    GRAVITY,
    INERTIA,
    MASS,
    ROTOR,
    WINCH,
    profile_of,
    torque_run,
)  # fmt: skip
from winchkit import forward
from winchkit.runs import Run

Array = NDArray[np.float64]
State = Sequence[float] | Array
"""Angle and speed first."""
solved: Any = solve_ivp


class Law(Protocol):
    """A motion between events; all of them under a motor torque, N m."""

    def rates(self, torque: float, state: State) -> list[float]:
        """Derivatives of the state."""

    def events(self, torque: float, state: State) -> list[float]:
        """Functions that fall below zero at an event."""

    def behind(self, event: int, torque: float, state: State) -> State:
        """State behind an event; the law continues from there."""


def by_scipy(run: Run, torque: Array, law: Law, state: State) -> tuple[Array, int]:
    """Angles at the times of a run, and the number of events."""
    out, count = [state[0]], 0
    for k in range(len(run) - 1):
        now, end = run.time[k], run.time[k + 1]

        def pushed(t: float, k: int = k) -> float:
            return float(np.interp(t, run.time[k : k + 2], torque[k : k + 2]))

        while now < end:
            own = []
            for i in range(len(law.events(pushed(now), state))):

                def event(t: float, y: Array, i: int = i) -> float:
                    return float(law.events(pushed(t), y)[i])

                event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
                own.append(event)
            found = solved(
                lambda t, y: law.rates(pushed(t), y), (now, end), state, "DOP853",
                events=own, rtol=1e-13, atol=1e-15,
            )  # fmt: skip
            now, state = float(found.t[-1]), found.y[:, -1].tolist()
            if found.status == 1:
                count += 1
                (which,) = (i for i, times in enumerate(found.t_events) if len(times))
                state = law.behind(which, pushed(now), state)
        out.append(state[0])
    return np.array(out), count


@dataclass
class Mass:
    """A mass under a torque of its place and a friction of its speed, N m."""

    pulled: Callable[[float], float]
    friction: Callable[[float], float]
    sign: float = 0.0

    def rates(self, torque: float, state: State) -> list[float]:
        if not self.sign:
            return [0.0, 0.0]
        force = torque + self.pulled(state[0]) - self.sign * self.friction(state[1])
        return [state[1], force / INERTIA]

    def events(self, torque: float, state: State) -> list[float]:
        if self.sign:
            return [self.sign * state[1]]
        force = torque + self.pulled(state[0])
        return [self.friction(0.0) - force, self.friction(0.0) + force]

    def behind(self, event: int, torque: float, state: State) -> State:
        if not self.sign:
            self.sign = 1.0 - 2.0 * event
        else:
            force = torque + self.pulled(state[0])
            self.sign = float(np.sign(force)) if abs(force) > self.friction(0.0) else 0.0
        return [state[0], 0.0]


COULOMB = ("motor-coulomb", 'torque = "0.2 N m"')
STRIBECK = ("motor-stribeck", 'torque = "0.15 N m"\nstribeck_speed = "0.3 rad/s"')


def dry(_: float) -> float:
    return 0.2


def stribeck(speed: float) -> float:
    return 0.2 + 0.15 * float(np.exp(-((speed / 0.3) ** 2)))


TIME = np.arange(0.0, 12.0, 0.01)
SPRING = ("spring-balancer", 'stiffness = "2 N m/rad"')
WEIGHT = ("joint-gravity", 'amplitude = "2 N m"\nphase = "0 rad"')


def sprung(angle: float) -> float:
    return -2.0 * angle


def hung(angle: float) -> float:
    return -2.0 * float(np.sin(angle))


def free(_: float) -> float:
    return 0.0


@dataclass(frozen=True)
class Case:
    """A mass, its torque, and where it begins."""

    effects: Sequence[tuple[str, str]]
    pulled: Callable[[float], float]
    friction: Callable[[float], float]
    torque: Array
    start: tuple[float, float]
    events: int


CASES = {
    "a stick-slip block on a spring drawn at constant speed": Case(
        [COULOMB, STRIBECK, SPRING], sprung, stribeck, 2.0 * 0.1 * TIME, (0.0, 0.0), 6
    ),
    "a Coulomb block that rests": Case(
        [COULOMB], free, dry, 0.3 * np.sin(2 * TIME), (0.0, 0.0), 15
    ),
    "a Coulomb block that never rests": Case(
        [COULOMB], free, dry, 1.5 * np.sin(3 * TIME), (0.0, 0.1), 11
    ),
    "a pendulum that comes to rest": Case([COULOMB, WEIGHT], hung, dry, 0 * TIME, (2.5, 0.1), 7),
    "a pendulum that is pushed": Case(
        [COULOMB, WEIGHT], hung, dry, 0.8 * np.sin(1.7 * TIME), (0.0, 0.0), 5
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_dry_friction_is_that_of_scipy(tmp_path: Path, name: str) -> None:
    case = CASES[name]
    angle, speed = case.start
    pushed = torque_run(case.torque, angle=angle)
    run = forward(
        profile_of(tmp_path, AXIS, *case.effects), torque=pushed, initial_speed=speed,
        tolerance=1e-12,
    )  # fmt: skip
    law = Mass(case.pulled, case.friction, 1.0 if speed else 0.0)
    expected, count = by_scipy(run, case.torque, law, case.start)
    assert count == case.events
    np.testing.assert_allclose(run["motor_angle"], expected, atol=1e-9)


@dataclass
class Rotor:
    """A rotor with Coulomb friction that moves a hanging load through a gear with a gap: the drum
    stands while the rotor is between the flanks. States: angle, speed, place in the gap."""

    half: float
    """Of the gap at the motor, rad."""
    held: float
    """Share of the load's torque between the flanks, which rises evenly in the last fiftieth."""
    friction: float
    sign: float = 1.0
    is_closed: bool = False
    is_near: bool = False
    """Whether it is in one of these fiftieths, or at a flank."""

    def force(self, torque: float, state: State) -> float:
        near = self.is_near * (abs(float(state[2])) / self.half - 0.98) / 0.02
        return torque - (self.held + (1 - self.held) * near) * MASS * GRAVITY * ARM

    def rates(self, torque: float, state: State) -> list[float]:
        if not self.sign:
            return [0.0, 0.0, 0.0]
        inertia = ROTOR + self.is_closed * MASS * ARM**2
        force = self.force(torque, state) - self.sign * self.friction
        return [state[1], force / inertia, (not self.is_closed) * state[1]]

    def events(self, torque: float, state: State) -> list[float]:
        if not self.sign:
            return [
                self.friction - self.force(torque, state),
                self.friction + self.force(torque, state),
            ]
        reversal, away = self.sign * state[1], abs(state[2]) - 0.98 * self.half
        if self.is_closed:
            return [reversal]
        return [reversal, self.half - self.sign * state[2], away if self.is_near else -away]

    def behind(self, event: int, torque: float, state: State) -> State:
        angle, speed, place = state
        if not self.sign:
            self.sign = 1.0 - 2.0 * event
        elif event == 0:
            speed = 0.0
            force = self.force(torque, state)
            self.sign = float(np.sign(force)) if abs(force) > self.friction else 0.0
        elif event == 1:
            place, self.is_closed = self.sign * self.half, True
            speed *= ROTOR / (ROTOR + MASS * ARM**2)
        else:
            self.is_near = not self.is_near
        if speed == 0.0:
            self.is_closed = abs(place) == self.half and self.sign * place > 0.0
        return [angle, speed, place]


@pytest.mark.parametrize("held", [0.0, 0.7])
@pytest.mark.parametrize("friction", [0.0, 0.05])
def test_backlash_is_that_of_scipy(tmp_path: Path, friction: float, held: float) -> None:
    """The rotor strikes the flanks, rests at them and between; without a share between the flanks
    the load throws it back from either side of the last fiftieth."""
    gap = 0.02
    profile = profile_of(
        tmp_path, WINCH, ("gear-backlash", f'gap = "{gap} rad"\nheld = {held}\nstart = 0.2'),
        ("motor-coulomb", f'torque = "{friction} N m"'),
    )  # fmt: skip
    waves = 0.4 * np.sin(40 * TIME[:400]) + 0.3 * np.sin(7 * TIME[:400])
    torque = MASS * GRAVITY * ARM * (1 + waves)
    run = forward(
        profile, torque=torque_run(torque), load_mass=MASS, initial_speed=3.0, tolerance=1e-12
    )
    # The gap at the motor is ten times that of the drum, which is ahead of the rotor by a fifth.
    law = Rotor(10 * gap / 2, held, friction)
    expected, count = by_scipy(run, torque, law, [0.0, 3.0, -0.2 * 10 * gap])
    assert (count > 40) == (friction > 0.0)
    np.testing.assert_allclose(run["motor_angle"], expected, rtol=0.0, atol=1e-9 * np.ptp(expected))
