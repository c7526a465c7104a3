"""Values that compensate each other, and laws that are a part of another: doubted, never certain.

The truth is a closed form: Coulomb, viscous and quadratic friction of a motor with an inertia.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lfilter

from diagnosis_runs import GROOVED, Ride, made, with_channel
from winchkit import diagnose, read_profile
from winchkit.arrays import Array
from winchkit.diagnosis.results import Diagnosis, Step
from winchkit.diagnosis.verdict.compensation import beside_unknown
from winchkit.report.words.sentence import headline
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import EffectTable

COULOMB, VISCOUS, QUADRATIC, INERTIA = 0.03, 4e-4, 8e-6, 2e-4
NOISE = 0.004
KNOWN = """
[motor]
inertia = "2 kg cm^2"
[[effect]]
id = "motor-coulomb"
torque = "30 mN m"
[[effect]]
id = "motor-viscous"
viscosity = "0.4 mN m s"
"""


STEP, EVERY = 1e-3, 10
"""Steps of the closed form, s, and how many there are in a sample."""


def motion(fastest: float) -> tuple[Array, Array]:
    """Time, s, and speed, rad/s: there and back at four speeds, with smooth ramps."""
    time = np.arange(0.0, 24.0, STEP)
    wanted = np.zeros_like(time)
    for number, share in enumerate((0.15, 0.4, 0.7, 1.0)):
        begin = 6.0 * number
        wanted[(time > begin + 0.3) & (time < begin + 2.6)] = share * fastest
        wanted[(time > begin + 3.1) & (time < begin + 5.4)] = -share * fastest
    bell = np.hanning(421)
    return time, np.convolve(wanted, bell / bell.sum(), mode="same")


def runs(
    coulomb: float,
    viscous: float,
    quadratic: float,
    *,
    factor: float = 1.0,
    lag: float = 0.0,
    late: float = 0.0,
) -> list[Run]:
    """Two motions, each recorded twice; ``lag`` is that of a low-pass of the torque, s, by which it
    may also be ``late`` without one.
    """
    out = []
    for number, fastest in enumerate((130.0, 130.0, 80.0, 80.0)):
        time, speed = motion(fastest)
        angle = cumulative_trapezoid(speed, dx=STEP, initial=0.0)
        torque = (
            INERTIA * np.gradient(speed, time)
            + coulomb * np.tanh(speed / 0.2)
            + viscous * speed
            + quadratic * speed * np.abs(speed)
        )
        kept = float(np.exp(-STEP / lag)) if lag else 0.0
        torque = np.asarray(lfilter([1 - kept], [1, -kept], torque))
        torque = np.interp(time - late, time, torque)
        seen = factor * torque[::EVERY]
        noise = np.random.default_rng(number).normal(0.0, NOISE, len(seen))
        channels = {
            "motor_angle": Channel(angle[::EVERY], "rad"),
            "motor_torque": Channel(seen + noise, "N m"),
        }
        out.append(Run(f"r{number}", time[::EVERY], channels))
    return out


def diagnosed(folder: Path, recorded: list[Run], known: str = KNOWN) -> Diagnosis:
    path = folder / "axis.toml"
    path.write_text(f'schema = 1\nkind = "axis"\nname = "axis"\n{known}', encoding="utf-8")
    return diagnose(recorded, read_profile(path)).diagnosis


def doubts(found: Diagnosis) -> set[str]:
    return {doubt.code for step in found.steps for doubt in step.doubts}


@pytest.mark.slow
def test_known_friction_that_moves_for_a_law_that_is_not_known_is_open(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, runs(COULOMB, VISCOUS, QUADRATIC))
    moved = [step for step in found.steps if step.effects[0] in {"motor-coulomb", "motor-viscous"}]
    assert moved
    assert "curve" in doubts(found)
    assert not any(step.certain for step in found.steps if step.law == "open")
    assert all(step.law == "open" for step in moved)


@pytest.mark.slow
@pytest.mark.parametrize("lag", [0.0, 0.02])
def test_a_factor_on_the_torque_is_named_with_the_values_that_it_changes(
    tmp_path: Path, lag: float
) -> None:
    """Beside a lag of the torque as well, which is a step of its own."""
    found = diagnosed(tmp_path, runs(COULOMB, VISCOUS, 0.0, factor=1.08, lag=lag))
    moved = [step for step in found.steps if step.refitted]
    assert len(moved) > 1
    assert all("factor" in {doubt.code for doubt in step.doubts} for step in moved)
    (text, *_) = [d.text for d in moved[0].doubts if d.code == "factor"]
    assert float(text.partition("wrong by +")[2].partition("%")[0]) == pytest.approx(8.0, abs=0.5)
    assert not any(step.certain for step in moved)
    assert "A torque constant that is wrong by +" in headline(found)


@pytest.mark.slow
def test_a_factor_is_named_beside_a_value_that_does_not_follow_it(tmp_path: Path) -> None:
    """Inertia and Coulomb friction have the same wrong ratio, viscous friction another one."""
    found = diagnosed(tmp_path, runs(COULOMB, 1.3 * VISCOUS, 0.0, factor=1.05))
    assert len(found.steps) > 1
    assert all("factor" in {doubt.code for doubt in step.doubts} for step in found.steps)
    assert not any(step.certain for step in found.steps)
    assert "A torque constant that is wrong by +5." in headline(found)


@pytest.mark.slow
@pytest.mark.parametrize(("late", "lag", "name"), [(0.02, 0.0, "lead"), (0.0, 0.02, "lag")])
def test_a_delay_and_a_low_pass_of_the_torque_have_names_of_their_own(
    tmp_path: Path, late: float, lag: float, name: str
) -> None:
    found = diagnosed(tmp_path, runs(COULOMB, VISCOUS, 0.0, lag=lag, late=late))
    (step,) = [step for step in found.steps if not step.refitted]
    assert step.effects == (f"torque-{name}",)
    ((_, size),) = step.parameters[step.effects[0]].items()
    assert size.value == pytest.approx(lag - late, rel=0.05)


@pytest.mark.slow
def test_values_that_do_change_are_not_doubted(tmp_path: Path) -> None:
    """Friction that grew by a third and viscous friction that halved: no curve, no factor."""
    found = diagnosed(tmp_path, runs(4 / 3 * COULOMB, VISCOUS / 2, 0.0))
    assert {step.effects[0] for step in found.steps} == {"motor-coulomb", "motor-viscous"}
    assert all(step.certain and step.refitted for step in found.steps)


@pytest.mark.slow
@pytest.mark.parametrize("quadratic", [0.0, 3e-5])
def test_a_law_that_leaves_its_own_variable_is_open(tmp_path: Path, quadratic: float) -> None:
    """Quadratic friction beside unknown viscous and Coulomb friction: no value of it is certain."""
    found = diagnosed(
        tmp_path, runs(COULOMB, VISCOUS, quadratic), '[motor]\ninertia = "2 kg cm^2"\n'
    )
    for step in found.steps:
        values = step.parameters[step.effects[0]]
        truth = {"motor-coulomb": ("torque", COULOMB), "motor-viscous": ("viscosity", VISCOUS)}
        if step.certain and step.effects[0] in truth:
            name, true = truth[step.effects[0]]
            assert abs(values[name].value - true) < 4 * values[name].std
    assert bool(doubts(found) & {"curve"}) == bool(quadratic)


@pytest.mark.parametrize(
    ("curve", "along", "certain"), [("speed", 1.0, False), ("speed", 0.0, True), ("", 1.0, True)]
)
def test_a_law_beside_an_unknown_one_that_changes_the_same_is_not_certain(
    curve: str, along: float, certain: bool
) -> None:
    torque = ("motor_torque",)
    viscous = Step(("motor-viscous",), {}, 0.5, certain=True)
    other = Step(("friction-growth",), {}, 0.1, law="open", curve=curve)
    changes = [np.array([3.0, 0.0]), np.array([along, 1.0])]
    judged, left = beside_unknown([viscous, other], [torque, torque], changes)
    assert judged.certain == certain
    assert bool(judged.doubts) != certain
    assert left == other
    # What acts on another output as well is known from there.
    both = [torque, ("motor_torque", "tension")]
    assert beside_unknown([viscous, other], both, changes)[0] == viscous


def test_steps_without_a_common_output_do_not_compensate_each_other() -> None:
    """A late length and a friction whose reversal the profile has sharp: both over the speed."""
    friction = EffectTable("motor-coulomb", {"torque": "25 mN m"})
    profile, ride = (
        replace(GROOVED, effect=(friction,)),
        Ride(samples=800, stroke=200.0, period=8.0),
    )
    rate = np.gradient(ride.angle, ride.time)
    made_runs = []
    for seed in range(2):
        run = made(seed, GROOVED, load_mass=10.0, ride=ride)
        torque = run["motor_torque"] + 0.025 * np.tanh(rate / 3.0)
        late = np.interp(ride.time - 0.1, ride.time, run["cable_length"])
        run = with_channel(run, "motor_torque", torque, "N m")
        made_runs.append(with_channel(run, "cable_length", late, "m"))
    steps = diagnose(made_runs, profile).diagnosis.steps
    delay = next(step for step in steps if step.effects == ("length-time-offset",))
    assert delay.certain
    assert not [doubt for step in steps for doubt in step.doubts if doubt.code == "curve"]
