"""Simulated motion against closed forms, scipy's solvers with events, MuJoCo, and the simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from winchkit import forward, read_profile, read_programme, read_simbench, simulate
from winchkit.errors import RunError, UsageError
from winchkit.runs import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile

AXIS = """\
schema = 1
kind = "axis"
name = "axis"

[motor]
inertia = "0.5 kg m^2"
"""
WINCH = """\
schema = 1
kind = "winch"
name = "winch"

[drum]
kind = "grooved"
winding_radius = "50 mm"
groove_pitch = "0 mm"

[gearbox]
ratio = 10

[motor]
inertia = "0.0004 kg m^2"

[reference]
cable_length = "4 m"
"""
INERTIA, MASS, ARM, ROTOR, GRAVITY = 0.5, 10.0, 5e-3, 4e-4, 9.80665


def profile_of(folder: Path, text: str, *effects: tuple[str, str]) -> WinchProfile:
    tables = "".join(f'\n[[effect]]\nid = "{name}"\n{values}\n' for name, values in effects)
    path = folder / "machine.toml"
    path.write_text(text + tables)
    return read_profile(path)


def torque_run(
    torque: NDArray[np.float64], rate: float = 100.0, angle: float = 0.0, **metadata: str
) -> Run:
    time = np.arange(len(torque)) / rate
    channels = {
        "motor_angle": Channel(np.full(len(time), angle), "rad"),
        "motor_torque": Channel(torque, "N m"),
    }
    return Run("pushed", time, channels, metadata)


def test_a_mass_on_a_spring_oscillates_as_in_closed_form(tmp_path: Path) -> None:
    profile = profile_of(tmp_path, AXIS, ("spring-balancer", 'stiffness = "8 N m/rad"'))
    run = forward(profile, torque=torque_run(np.zeros(1000), angle=0.3), initial_speed=0.7)
    omega = np.sqrt(8 / INERTIA)
    expected = 0.3 * np.cos(omega * run.time) + 0.7 / omega * np.sin(omega * run.time)
    np.testing.assert_allclose(run["motor_angle"], expected, atol=1e-6)


def test_a_coulomb_block_stops_and_stays(tmp_path: Path) -> None:
    """It slows down by c/J, stands, and is released only by a torque above c."""
    profile = profile_of(tmp_path, AXIS, ("motor-coulomb", 'torque = "0.2 N m"'))
    pushed = np.concatenate([np.zeros(300), np.full(100, 0.19), np.full(100, 0.3)])
    run = forward(profile, torque=torque_run(pushed), initial_speed=0.4)
    stop = 0.4 * INERTIA / 0.2
    slowing = np.minimum(run.time[:300], stop)
    expected = 0.4 * slowing - 0.2 / INERTIA * slowing**2 / 2
    np.testing.assert_allclose(run["motor_angle"][:300], expected, atol=1e-10)
    assert np.all(run["motor_velocity"][101:400] == 0.0)
    # From 3.99 s on the torque rises within one sample from 0.19 to 0.3 N m.
    since = run.time[401:] - 4.0
    began = 0.01 * (0.3 - 0.2) / (0.3 - 0.19)
    speed = (0.1 * began / 2 + 0.1 * since) / INERTIA
    np.testing.assert_allclose(run["motor_velocity"][401:], speed, atol=1e-9)


def pendulum(_: float, y: NDArray[np.float64], friction: float, sign: float) -> list[float]:
    return [y[1], (-2.0 * np.sin(y[0]) - sign * friction) / INERTIA]


def by_scipy(times: NDArray[np.float64], start: list[float], friction: float) -> NDArray[np.float64]:
    """A pendulum with dry friction by scipy's solver, restarted at every reversal, to 1e-12."""

    def reversal(t: float, y: NDArray[np.float64], *_: float) -> float:
        return float(y[1])

    reversal.terminal = True  # type: ignore[attr-defined]
    out, now, y = np.empty_like(times), times[0], np.array(start)
    out[0] = y[0]
    sign = float(np.sign(-np.sin(y[0]))) if y[1] == 0 else float(np.sign(y[1]))
    while now < times[-1]:
        if y[1] == 0.0 and abs(2.0 * np.sin(y[0])) <= friction:
            out[times > now] = y[0]
            break
        reversal.direction = -sign  # type: ignore[attr-defined]
        later = times[times > now]
        found = solve_ivp(
            pendulum, (now, times[-1]), y, "DOP853", later, events=reversal,
            args=(friction, sign), rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        out[np.isin(times, found.t)] = found.y[0]
        if not len(found.t_events[0]):
            break
        now, y, sign = float(found.t_events[0][0]), np.array([found.y_events[0][0][0], 0.0]), -sign
    return out


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.4])
def test_a_pendulum_with_dry_friction_is_that_of_scipy(tmp_path: Path, friction: float) -> None:
    profile = profile_of(
        tmp_path, AXIS,
        ("joint-gravity", 'amplitude = "2 N m"\nphase = "0 rad"'),
        ("motor-coulomb", f'torque = "{friction} N m"'),
    )  # fmt: skip
    pushed = torque_run(np.zeros(2000), angle=2.5)
    run = forward(profile, torque=pushed, initial_speed=0.0, tolerance=1e-12)
    np.testing.assert_allclose(
        run["motor_angle"], by_scipy(run.time, [2.5, 0.0], friction), atol=1e-9
    )


def test_a_hanging_load_falls_with_the_inertia_of_the_rotor(tmp_path: Path) -> None:
    run = forward(profile_of(tmp_path, WINCH), torque=torque_run(np.zeros(50)),
                  load_mass=MASS, initial_speed=0.0)  # fmt: skip
    fall = MASS * GRAVITY * ARM / (ROTOR + MASS * ARM**2)
    np.testing.assert_allclose(run["motor_angle"], -fall * run.time**2 / 2, rtol=1e-9)
    np.testing.assert_allclose(run["cable_length"], 4 + ARM * fall * run.time**2 / 2, rtol=1e-9)
    np.testing.assert_allclose(run["tension"], MASS * (GRAVITY - ARM * fall), rtol=1e-9)


def test_a_weight_moves_only_beyond_the_friction_of_every_part(tmp_path: Path) -> None:
    """Efficiency and a pulley make a band of torques in which the load stands."""
    pulley = '\n[[pulley]]\nradius = "40 mm"\nwrap = "180 deg"\n'
    profile = profile_of(
        tmp_path, WINCH + pulley, ("pulley-capstan", 'friction = "0.05"'),
        ("gear-efficiency", "efficiency = 0.8"),
    )  # fmt: skip
    weight = MASS * GRAVITY * ARM
    up, down = weight * np.exp(0.05 * np.pi) / 0.8, weight * np.exp(-0.05 * np.pi) * 0.8
    for torque, sign in ((up * 1.001, 1), (up * 0.999, 0), (down * 1.001, 0), (down * 0.999, -1)):
        run = forward(profile, torque=torque_run(np.full(20, torque)),
                      load_mass=MASS, initial_speed=0.0)  # fmt: skip
        assert np.sign(run["motor_velocity"][-1]) == sign


def test_backlash_closes_with_the_momentum_of_the_rotor(tmp_path: Path) -> None:
    """In the gap only the rotor moves; at the flank both continue with its momentum."""
    gap = 0.02
    profile = profile_of(
        tmp_path, WINCH, ("gear-backlash", f'gap = "{gap} rad"\nheld = 0\nstart = 0.5')
    )
    run = forward(profile, torque=torque_run(np.full(400, 0.1), 1000.0), load_mass=0.0001,
                  initial_speed=0.0)  # fmt: skip
    # The gap is at the drum, ten times larger at the motor.
    distance, pushed = gap * 10, 0.1 / ROTOR
    closed = np.sqrt(2 * distance / pushed)
    before = run.time < closed
    np.testing.assert_allclose(run["motor_angle"][before], pushed * run.time[before] ** 2 / 2,
                               rtol=1e-8)  # fmt: skip
    assert np.all(run["cable_length"][before] == pytest.approx(4.0 + 0.5 * gap * -0.05, abs=1e-9))
