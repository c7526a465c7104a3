"""Every piece of hidden physics: what it does, and that it vanishes at its null."""

from dataclasses import replace
from math import exp, pi, sin

import numpy as np
import pytest

from plant_benches import GRAVITY, GROOVED, SPIRAL, cruise, hide, plant
from winchkit.errors import FileError
from winchkit.schema.simbench import HiddenSpec
from winchkit.sim.physics.parameters import number_names, read_numbers, with_unit
from winchkit.sim.physics.table import PHYSICS, listed_physics, scaled
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand

SCALES = {"cable_length": 1e-4, "tension": 0.1, "motor_torque": 1e-3}
"""Differences that count as visible."""
INVISIBLE = 1e-4
SPEEDS = [0, 80, 80, -100, -100, -8, -8, 0, 0, 100, 100]
"""Of the motor, rad/s, at the corners of the motion."""


def signals(*hidden: HiddenSpec) -> dict[str, np.ndarray]:
    """Readings of a winch that winds in, creeps back, stops, and warms up."""
    layered = any(spec.physics == "thick layers" for spec in hidden)
    profile = SPIRAL if layered else GROOVED
    winch = plant(profile, *hidden, load_mass=22.0, cable_length=2.8, drift=7200.0)
    rows = []
    for step in range(650):
        time = step * 0.01
        speed = float(np.interp(time, [0, 0.4, 1.5, 2, 3, 3.4, 4.4, 4.6, 5.0, 5.4, 6.5], SPEEDS))
        winch.advance(0.01, DriveCommand(speed=speed))
        read = winch.measure()
        rows.append([getattr(read, name) for name in SCALES])
    return dict(zip(SCALES, np.array(rows).T, strict=True))


def change(spec: HiddenSpec) -> float:
    """Largest change of any reading, in units of what is visible."""
    kept = (hide("thick layers", growth_error="0 mm"),) if spec.physics == "thick layers" else ()
    nominal, other = signals(*kept), signals(spec)
    return max(float(np.max(np.abs(other[n] - nominal[n]))) / SCALES[n] for n in SCALES)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PHYSICS if name != "loose gear"])
def test_a_typical_one_shows(name: str) -> None:
    assert change(HiddenSpec(name, {"time": "2 s"} if name == "slip" else {})) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, kind in PHYSICS.items() if kind.size])
def test_it_vanishes_at_its_null(name: str) -> None:
    numbers = {}
    if name == "loose gear":
        numbers = {"drag": "0 N m"}
    if name == "creep-sticky pulleys":
        numbers = {"coulomb": 0.0}
    if name == "guide offset":
        numbers = {"offset": "0 m"}
    if name == "balancer":
        numbers = {"torque": "0 N m"}
    assert change(scaled(HiddenSpec(name, numbers), 1e-9)) < INVISIBLE


def test_a_giving_joint_does_not_open_below_its_load() -> None:
    assert change(hide("giving joint", above="600 N")) == 0.0


def test_play_opens_only_against_drag() -> None:
    held = signals(hide("loose gear", gap="1 deg", drag="0 N m"))
    assert held["cable_length"] == pytest.approx(signals()["cable_length"], abs=1.1e-3)
    spread = np.ptp(held["cable_length"] - signals()["cable_length"])
    assert spread == pytest.approx(0.0, abs=1e-9)
    free = signals(hide("loose gear", gap="1 deg", drag="40 N m"))
    assert np.ptp(free["cable_length"] - signals()["cable_length"]) == pytest.approx(
        pi / 180 * 0.06, rel=0.02
    )


def test_creep_follows_its_exponential() -> None:
    winch = plant(GROOVED, hide("creeping rope", creep_stiffness="300 kN", time_constant="2 s"))
    for seconds in (1, 2, 3):
        cruise(winch, 0.0, 1.0)
        strain = 20 * GRAVITY / 300e3 * (1 - exp(-seconds / 2))
        assert winch.cable_length - 4.0 == pytest.approx(strain * 5.5, rel=1e-6)


def test_heat_lengthens_the_stressed_cable() -> None:
    winch = plant(GROOVED, hide("warm rope", expansion="1e-5 1/K"), temperature=25, drift=3600)
    cruise(winch, 0.0, 3.0)
    assert winch.temperature == pytest.approx(28.0)
    assert winch.cable_length - 4.0 == pytest.approx(1e-5 * 8 * 5.5, rel=1e-6)


def test_a_slow_cell_is_first_order() -> None:
    winch = plant(GROOVED, hide("slow cell", time_constant="0.2 s"))
    cruise(winch, 0.0, 0.01)
    winch.hang(40.0)
    cruise(winch, 0.0, 0.2)
    assert winch.measure().tension == pytest.approx(GRAVITY * (40 - 20 * exp(-1)), rel=1e-9)


def test_a_late_length_is_the_length_of_before() -> None:
    winch = plant(GROOVED, hide("late length", delay="50 ms"))
    cruise(winch, 60.0, 1.0)
    there = winch.cable_length
    cruise(winch, 60.0, 0.05)
    assert winch.measure().cable_length == pytest.approx(there, abs=1e-9)


def test_a_slip_stays() -> None:
    winch = plant(GROOVED, hide("slip", step="0.1 rad", time="1 s"))
    cruise(winch, 0.0, 0.9)
    assert winch.cable_length == pytest.approx(4.0)
    cruise(winch, 0.0, 0.6)
    radius = np.hypot(0.06, 0.005 / 2 / pi)
    assert 4.0 - winch.cable_length == pytest.approx(0.1 * radius)


def test_a_clipped_cell_stops_at_its_limit() -> None:
    winch = plant(GROOVED, hide("clipping cell", limit="150 N"), load_mass=20.0)
    assert winch.measure().tension == 150.0
    assert winch.tension > 190.0


def test_cogging_is_a_sine_of_the_motor() -> None:
    winch = plant(GROOVED, hide("cogging", amplitude="0.1 N m", order=3, phase="0 rad"))
    nominal = plant(GROOVED)
    for each in (winch, nominal):
        cruise(each, 2.0, 0.37)
    extra = winch.motor_torque - nominal.motor_torque
    assert extra == pytest.approx(0.1 * sin(3 * winch.motor_angle), rel=1e-9)


def test_efficiency_works_both_ways() -> None:
    for speed, expected in ((50.0, 1 / 0.9), (-50.0, 0.9)):
        winch, nominal = plant(GROOVED, hide("lossy gear", efficiency=0.9)), plant(GROOVED)
        for each in (winch, nominal):
            cruise(each, speed, 0.5)
        assert winch.motor_torque / nominal.motor_torque == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("profile", "physics", "message"),
    [
        (GROOVED, "thick layers", "no layers"),
        (replace(GROOVED, guide=None), "guide offset", "no guide"),
    ],
)
def test_what_a_winch_cannot_hide(profile: object, physics: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        plant(profile, hide(physics))


@pytest.mark.parametrize("name", PHYSICS)
def test_every_number_can_be_written_and_read(name: str) -> None:
    kind = PHYSICS[name]
    texts = {n: with_unit(kind, n, getattr(kind(), n)) for n in number_names(kind)}
    read = read_numbers(kind, texts, name)
    assert read == {n: pytest.approx(getattr(kind(), n)) for n in number_names(kind)}
    assert not kind.size or kind.size in read


def test_the_list_of_physics_says_what_each_is() -> None:
    rows = listed_physics()
    assert [row.name for row in rows] == list(PHYSICS)
    assert all(row.description.endswith(".") for row in rows)


def test_memories_are_a_plants_own() -> None:
    spec = hide("creeping rope", time_constant="1 s")
    first: WinchPlant = plant(GROOVED, spec)
    cruise(first, 0.0, 5.0)
    assert plant(GROOVED, spec).cable_length == pytest.approx(4.0)
