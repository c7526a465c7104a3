"""Effects whose oracle is an equation solver, a stack or another run, not a closed form."""

from __future__ import annotations

from math import cos, exp, pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from effect_lines import CATALOGUE, predict, profile_with
from winchkit.effects.on_length.drum_winding_tension import stored
from winchkit.effects.reference_motion import STANDARD_PROFILE
from winchkit.model.line import Line
from winchkit.model.stages import Signals

RATIO, DEAD, LENGTH = 20.4, 1.5, 6.0
WRAPS = (pi / 2, pi)


def test_dahl_friction_follows_its_differential_equation() -> None:
    """Two pulleys one after the other, a slow ride at constant load, against an ODE solver."""
    profile = profile_with("grooved")
    time = np.linspace(0, 4, 401)
    angle = 2.0 * np.sin(2.0 * time)
    signals = Signals(time, angle, load=np.full_like(time, 300.0))
    values = {"friction": 0.04, "stiffness": 900.0}
    motion = Line(profile).motion(signals)
    found = predict(profile, motion, CATALOGUE["pulley-dahl"], values)["tension"]

    per_radian = np.hypot(0.06, 0.007 / (2 * pi)) / RATIO
    limits = []
    tension = 300.0
    for wrap in reversed(WRAPS):
        after = brentq(
            lambda t1, t0=tension, w=wrap: (
                t1 - t0 - 0.04 * np.sqrt(t0**2 - 2 * t0 * t1 * cos(w) + t1**2)
            ),
            tension,
            1.5 * tension,
            xtol=1e-12,
        )
        limits.append((after - tension) / tension)

    def rate(t: float, forces: np.ndarray) -> list[float]:
        moving = per_radian * 4.0 * cos(2.0 * t)
        first = limits[0] * 300.0
        second = limits[1] * (300.0 + forces[0])
        return [
            900.0 * moving * (1 - np.sign(moving) * force / limit)
            for force, limit in zip(forces, (first, second), strict=True)
        ]

    solved = solve_ivp(rate, (0, 4), [0, 0], t_eval=time, rtol=1e-9, atol=1e-9, max_step=0.005)
    assert np.allclose(found, 300.0 + solved.y.sum(axis=0), atol=0.05)
    assert np.ptp(found) > 10


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_presliding_of_the_motor_follows_its_differential_equation(share: float) -> None:
    """A share of static friction falls with the speed over 2 rad/s."""
    profile = profile_with("grooved")
    time = np.linspace(0, 4, 2001)
    signals = Signals(time, 2.0 * np.sin(2.0 * time), load=np.full_like(time, 300.0))
    line = Line(profile)
    values = {"torque": 0.05, "distance": 0.7, "start": -0.4}
    motion = line.motion(signals)
    effect = CATALOGUE["motor-lugre" if share else "motor-dahl"]
    if share:
        values |= {"static_share": share, "stribeck_speed": 2.0}
    found = predict(profile, motion, effect, values)["motor_torque"]

    def limit(t: float) -> float:
        return 0.05 * (1.0 + share * exp(-((4.0 * cos(2.0 * t) / 2.0) ** 2)))

    def rate(t: float, friction: np.ndarray) -> list[float]:
        moving = 4.0 * cos(2.0 * t)
        return [moving * 0.05 * (1.0 - np.sign(moving) * float(friction[0]) / limit(t)) / 0.7]

    solved = solve_ivp(
        rate, (0, 4), [-0.4 * limit(0.0)], t_eval=time, rtol=1e-9, atol=1e-9, max_step=0.005
    )
    added = found - line.predict(motion)["motor_torque"]
    assert np.allclose(added, solved.y[0], atol=1e-4 if share else 1e-5)


def test_presliding_of_a_gear_follows_its_differential_equation() -> None:
    profile = profile_with("grooved")
    time = np.linspace(0, 4, 2001)
    load = 300.0 + 80.0 * np.sin(3.0 * time)
    signals = Signals(time, 2.0 * np.sin(2.0 * time), load=load)
    line = Line(profile)
    values = {"efficiency": 0.8, "distance": 0.7, "start": -0.4}
    motion = line.motion(signals)
    found = predict(profile, motion, CATALOGUE["gear-dahl"], values)["motor_torque"]
    length = line.predict(motion)["cable_length"]
    way = np.sign(length[0] - length[100])  # The motor turns forward at first.

    def rate(t: float, state: np.ndarray) -> list[float]:
        moving = way * 4.0 * cos(2.0 * t)
        return [moving * (1 - np.sign(moving) * float(state[0])) / 0.7]

    solved = solve_ivp(rate, (0, 4), [-0.4], t_eval=time, rtol=1e-9, atol=1e-9, max_step=0.005)
    expected = line.predict(motion)["motor_torque"] * 0.8 ** -solved.y[0]
    assert np.allclose(found, expected, rtol=2e-5)


def test_an_instrument_that_is_late_shows_the_length_of_a_moment_ago() -> None:
    profile = profile_with("grooved")
    time = np.linspace(0, 10, 501)

    def angle(t: np.ndarray) -> np.ndarray:
        return 40.0 * np.sin(0.8 * t)

    line = Line(profile)
    for delay in (0.033, -0.05, 0.4):
        signals = Signals(time, angle(time))
        effect = CATALOGUE["length-time-offset"]
        found = predict(profile, line.motion(signals), effect, {"delay": delay})["cable_length"]
        exact = line.predict(line.motion(Signals(time, angle(time - delay))))["cable_length"]
        inside = (time - delay > 0.1) & (time - delay < 9.9)
        assert np.allclose(found[inside], exact[inside], atol=1e-7)
        end = 0 if delay > 0 else -1
        assert found[end] == line.predict(line.motion(signals))["cable_length"][end]


def test_the_commanded_torque_is_that_of_a_moment_later() -> None:
    time = np.linspace(0, 10, 501)
    line = Line(profile_with("grooved"))

    def torque(t: np.ndarray) -> np.ndarray:
        signals = Signals(time, 40.0 + 0.0 * time, load=200.0 + 90.0 * np.sin(0.8 * t))
        return line.predict(line.motion(signals))["motor_torque"]

    for lead in (0.004, 0.4):
        signals = Signals(time, 40.0 + 0.0 * time, load=200.0 + 90.0 * np.sin(0.8 * time))
        told = predict(line.profile, line.motion(signals), CATALOGUE["torque-lead"], {"lead": lead})
        inside = (time > 0.1) & (time + lead < 9.9)
        exact = torque(time + lead)
        assert np.allclose(told["motor_torque"][inside], exact[inside], rtol=1e-6)
        assert not np.allclose(exact[inside], torque(time)[inside], rtol=1e-4)


def test_noise_of_the_encoder_opens_no_play_at_rest() -> None:
    """Teeth that bear go on to bear while the winch stands, whatever the encoder's last digits."""
    time = np.linspace(0, 10, 501)
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(time))
    moved = 40.0 * np.clip(time / 5.0, 0.0, 1.0)
    line = Line(profile_with("grooved"))
    motion = line.motion(Signals(time, moved + noise, load=np.full(len(time), 200.0)))
    play = {"gap": 0.01, "held": 0.0}
    torque = predict(line.profile, motion, CATALOGUE["gear-backlash"], play)["motor_torque"]
    bearing = time > 1.0
    assert np.allclose(torque[bearing], line.predict(motion)["motor_torque"][bearing], rtol=1e-6)
    assert np.any(torque[~bearing] == 0.0)


def _stack(wound: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """Cable on the drum as a list of pieces, last in first out."""
    before = float(np.mean(strain))
    pieces: list[tuple[float, float]] = []
    bottom, out = wound[0], [before * wound[0]]
    for now, last, here in zip(wound[1:], wound[:-1], strain[1:], strict=True):
        moved = now - last
        if moved > 0:
            pieces.append((moved, here))
        while moved < 0 and pieces:
            size, piece = pieces.pop()
            if size > -moved:
                pieces.append((size + moved, piece))
                moved = 0.0
            else:
                moved += size
        bottom += min(moved, 0.0)
        out.append(before * bottom + sum(size * piece for size, piece in pieces))
    return np.array(out)


@pytest.mark.parametrize("seed", range(5))
def test_cable_on_the_drum_is_paid_out_last_in_first_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wound = np.cumsum(rng.normal(0, 0.1, 400) * rng.integers(0, 2, 400)) - rng.random()
    strain = rng.random(400) * 1e-3
    assert np.allclose(stored(wound, strain), _stack(wound, strain), atol=1e-12)


def test_winding_in_tight_and_paying_out_slack_leaves_a_longer_cable_while_wound() -> None:
    time = np.linspace(0, 20, 1001)
    angle = 60.0 * np.sin(2 * pi * time / 40.0)
    load = np.where(time < 10, 400.0, 200.0)
    motion = Line(STANDARD_PROFILE).motion(Signals(time, angle, load=load))
    bare = Line(STANDARD_PROFILE).predict(motion)["cable_length"]
    effect = CATALOGUE["drum-winding-tension"]
    change = predict(STANDARD_PROFILE, motion, effect, {"fraction": 0.005})["cable_length"] - bare
    wound = LENGTH - bare
    assert np.allclose(change, 0.005 * 400 / 500 * wound, atol=1e-9)


@pytest.mark.parametrize("bend", [(-300.0, 0.0, 0.0), (80.0, -5e4, 1e6), (0.0, 0.0, -1e9)])
def test_a_cable_law_that_would_fold_back_stays_monotone(bend: tuple[float, ...]) -> None:
    time = np.linspace(0, 1, 200)
    load = np.linspace(0, 3000, 200)
    profile = profile_with("grooved")
    motion = Line(profile).motion(Signals(time, np.zeros(200), load=load))
    values = dict(zip(("k1", "b2", "b3", "b4"), (1e5, *bend), strict=True))
    found = predict(profile, motion, CATALOGUE["cable-elongation-quartic"], values)
    strain = (found["cable_length"] - LENGTH) / (LENGTH + DEAD)
    assert strain[0] == 0.0
    assert np.all(np.diff(strain) > 0)
    assert np.all(np.diff(strain) < 10.001 * np.diff(load) / 1e5)
