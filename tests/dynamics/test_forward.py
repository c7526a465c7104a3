"""Simulated motion against closed forms and the simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from command_line import invoke
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
from snippets import ROOT
from winchkit import find, forward, load_catalogue, read_programme, read_simbench, simulate
from winchkit.dynamics.balance import ON_MOTION
from winchkit.dynamics.drives import Inputs
from winchkit.dynamics.forward import Setup, motion_of
from winchkit.effects import Effect, Values
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term
from winchkit.errors import FileError, RunError, UsageError
from winchkit.model.stages import At
from winchkit.runs import write_run
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.simbench import NoiseSpec
from winchkit.sim.bench import hiding, profiles_of

GAINS = """
[control]
position_gain = "25 1/s"
velocity_gain = "0.05 N m s"
integral_time = "20 ms"
"""


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


def test_a_payload_swings_on_its_lever_as_in_closed_form(tmp_path: Path) -> None:
    profile = profile_of(tmp_path, AXIS, ("joint-payload", 'lever = "0.5 m"\nphase = "0 rad"'))
    still = torque_run(np.zeros(1000), angle=1e-4)
    run = forward(profile, torque=still, load_mass=MASS, initial_speed=0.0)
    omega = np.sqrt(MASS * GRAVITY * 0.5 / (INERTIA + MASS * 0.5**2))
    np.testing.assert_allclose(run["motor_angle"], 1e-4 * np.cos(omega * run.time), atol=1e-9)
    with pytest.raises(UsageError, match="needs the load of every run"):
        forward(profile, torque=still, initial_speed=0.0)


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
    gap, speed = 0.02, 10.0
    profile = profile_of(
        tmp_path, WINCH, ("gear-backlash", f'gap = "{gap} rad"\nheld = 0\nstart = 0.4')
    )
    run = forward(profile, torque=torque_run(np.zeros(60), 1000.0), load_mass=MASS,
                  initial_speed=speed)  # fmt: skip
    # The gap is at the drum, ten times as wide at the motor. In its last fiftieth the weight
    # acts like a spring.
    weight = MASS * GRAVITY * ARM
    free, near = 0.89 * gap * 10, 0.01 * gap * 10
    omega = np.sqrt(weight / near / ROTOR)
    slowing = np.arcsin(near * omega / speed) / omega
    struck, closed = speed * np.cos(omega * slowing), free / speed + slowing
    both = ROTOR + MASS * ARM**2
    before = run.time < free / speed
    after = (run.time > closed) & (run["motor_velocity"] > 0.0)
    np.testing.assert_allclose(run["motor_velocity"][before], speed, rtol=1e-12)
    np.testing.assert_allclose(run["cable_length"][before], run["cable_length"][0], atol=1e-12)
    expected = struck * ROTOR / both - weight / both * (run.time[after] - closed)
    np.testing.assert_allclose(run["motor_velocity"][after], expected, atol=1e-5)


def test_the_simulated_bench_moves_alike_to_one_percent(tmp_path: Path) -> None:
    """The simulator's code is independent: its torque, with grease and a rotor that it hides."""
    declared = hiding(read_simbench(find("sim", "demo-motor-grease")), ("none",))
    declared = hiding(replace(declared, noise=NoiseSpec()), (
        "motor grease, viscosity=3 mN m s", "heavy rotor, inertia=2 kg cm^2",
    ))  # fmt: skip
    source = (ROOT / "profiles" / "bench-spiral.toml").read_text()
    profile = profile_of(
        tmp_path, source, ("motor-viscous", 'viscosity = "3 mN m s"'),
        ("rotor-inertia", 'inertia = "2 kg cm^2"'),
    )  # fmt: skip
    programme = read_programme(ROOT / "sim" / "programme-demo.toml")
    true = next(iter(simulate(declared, profiles_of(declared), programme, rate=1000.0)))
    run = forward(profile, torque=true, initial_speed=0.0)
    for name in ("motor_angle", "cable_length"):
        assert np.max(np.abs(run[name] - true[name])) < 0.01 * np.ptp(true[name]), name
    # The simulator rounds the steps of the spiral's radius, which are peaks of the tension.
    difference = run["tension"] - true["tension"]
    assert np.sqrt(np.mean(difference**2)) < 0.01 * np.ptp(true["tension"])


def test_the_loops_follow_a_programme_and_its_torque_repeats_the_motion(tmp_path: Path) -> None:
    profile = profile_of(tmp_path, WINCH + GAINS, ("motor-coulomb", 'torque = "20 mN m"'))
    programme = Programme("up", (
        ProgrammeStep(hold=0.2),
        ProgrammeStep(to=3.0, speed=0.5, acceleration=0.8),
        ProgrammeStep(hold=0.5),
    ))  # fmt: skip
    run = forward(profile, programme=programme, load_mass=MASS, rate=1000.0)
    assert run["cable_length"][-1] == pytest.approx(3.0, abs=1e-4)
    assert np.all(run["motor_velocity"][:200] == 0.0)
    again = forward(profile, torque=run)
    np.testing.assert_allclose(again["cable_length"], run["cable_length"], atol=1e-3)


@pytest.mark.parametrize(
    ("effects", "arguments", "said"),
    [
        ((), {}, "gives no initial speed"),
        ((), {"reference": True}, "has no gains"),
        ((), {"load_mass": 10.0, "initial_speed": 0.0}, "is an axis without a cable"),
        ((("cell-lag", ""),), {"initial_speed": 0.0}, ""),
        ((("torque-lag", 'time_constant = "5 ms"'),), {"initial_speed": 0.0}, ""),
    ],
)
def test_wrong_inputs_have_one_sentence(
    tmp_path: Path, effects: tuple[tuple[str, str], ...], arguments: dict[str, Any], said: str
) -> None:
    profile, run = profile_of(tmp_path, AXIS, *effects), torque_run(np.zeros(10))
    if arguments.pop("reference", False):
        arguments |= {"reference": run}
    else:
        arguments |= {"torque": run}
    if not said:
        assert len(forward(profile, **arguments)) == 10
        return
    with pytest.raises((RunError, UsageError), match=said) as raised:
        forward(profile, **arguments)
    assert "\n" not in str(raised.value)


def moves(*steps: tuple[str, float]) -> Programme:
    each = (ProgrammeStep(winch=w, to=to, speed=0.2, acceleration=0.5) for w, to in steps)
    return Programme("p", (ProgrammeStep(hold=0.5), *each))


def test_a_programme_begins_where_it_ends_whatever_its_first_step_is(tmp_path: Path) -> None:
    profile = profile_of(tmp_path, WINCH + GAINS)
    run = forward(profile, programme=moves(("A", 3.0), ("A", 2.0)), load_mass=MASS)
    assert run["cable_length"][0] == pytest.approx(2.0)
    assert np.ptp(run["cable_length"]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("programme", "arguments", "said"),
    [
        (moves(("A", 3.0), ("B", 2.0)), {}, "moves A, B, and one winch is simulated"),
        (moves(("A", 3.0)), {"initial_speed": 1.0}, "starts from rest"),
        (moves(("A", 3.0)), {"load_mass": -1.0}, "load_mass=-1 is not a positive number"),
    ],
)
def test_a_programme_of_another_machine_is_refused(
    tmp_path: Path, programme: Programme, arguments: dict[str, Any], said: str
) -> None:
    with pytest.raises(UsageError, match=said):
        forward(profile_of(tmp_path, WINCH + GAINS), programme=programme, **arguments)


def test_a_cable_that_is_wound_in_ends_the_simulation(tmp_path: Path) -> None:
    pulled = torque_run(np.full(400, 1.5))
    with pytest.raises(UsageError, match=r"all of the cable is wound in at 1\.\d+ s"):
        forward(profile_of(tmp_path, WINCH), torque=pulled, load_mass=MASS, initial_speed=0.0)


@pytest.mark.parametrize("speed", ["0", "1 m/s", "inf rad/s", "1e400 rad/s", ""])
def test_an_initial_speed_that_is_none_is_named(tmp_path: Path, speed: str) -> None:
    profile_of(tmp_path, AXIS)
    write_run(torque_run(np.zeros(10)), tmp_path / "run.csv")
    options = ["--torque", tmp_path / "run.csv", "-o", tmp_path / "out.csv"]
    result = invoke("forward", tmp_path / "machine.toml", *options, "--initial-speed", speed)
    assert result.exit_code == 2
    assert result.stderr.startswith("winchkit: --initial-speed: ")


def test_an_infinite_value_is_refused(tmp_path: Path) -> None:
    effect = ("rotor-inertia", 'inertia = "inf kg m^2"')
    bare = AXIS.partition("[motor]")[0]
    with pytest.raises(FileError, match=r"'inf kg m\^2' must be finite"):
        forward(profile_of(tmp_path, bare, effect), torque=torque_run(np.ones(10)))


def stepless(torque: NDArray[np.float64], at: At, values: Values) -> NDArray[np.float64]:
    return torque + values["torque"] * np.sign(np.cumsum(at.motor_rate))


def test_an_effect_without_a_step_is_refused_by_name(tmp_path: Path) -> None:
    base = load_catalogue()["motor-coulomb"]
    catalogue = Catalogue(
        [*load_catalogue().of_winches(), replace(base, id="mine", apply=stepless)]
    )
    profile = profile_of(tmp_path, AXIS, ("mine", 'torque = "0.1 N m"'))
    with pytest.raises(UsageError, match=r"^mine: no step is declared"):
        forward(profile, torque=torque_run(np.zeros(10)), catalogue=catalogue, initial_speed=0.0)


def test_a_slack_cable_ends_the_simulation(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the cable is slack at"):
        forward(profile_of(tmp_path, WINCH), torque=torque_run(np.full(50, -3.0)),
                load_mass=MASS, initial_speed=0.0)  # fmt: skip


MOVES = [
    e
    for e in load_catalogue().of_winches()
    if e.stage in ON_MOTION
    # Of a recorded column, none is simulated; of an axis, it swings above.
    and e.id not in {"prediction-delay", "joint-payload"}
]


@pytest.mark.parametrize("effect", MOVES, ids=lambda e: e.id)
def test_every_shipped_effect_on_the_motion_has_a_step(tmp_path: Path, effect: Effect) -> None:
    guide = '\n[[pulley]]\nradius = "40 mm"\n\n[guide]\nscrew_lead = "4 mm"\n'
    profile = profile_of(tmp_path, WINCH + guide)
    values = {p.name: p.typical if p.role == "amplitude" else p.null for p in effect.parameters}
    terms = [*terms_of(profile), Term(effect, values)]
    inputs = Inputs(np.array([0.0, 0.1]), {"torque": np.array([0.52, 0.52])})
    setup = Setup("pushed", inputs.time, 3.0, 2.0, inputs, MASS)
    motion = motion_of(profile, terms, setup)
    assert np.all(np.isfinite(motion.acceleration))
