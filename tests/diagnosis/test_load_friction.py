"""Friction in proportion to the torque of a servo's joint, and waves of a direct drive.

The generators know equations only, no effect of the catalogue.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_profile

Array = NDArray[np.float64]
SHARE, GRAVITY = 0.25, 9.80665
AXIS = 'schema = 1\nkind = "axis"\nname = "joint"\n'
WINCH = """schema = 1
kind = "winch"
name = "w"
[drum]
kind = "grooved"
winding_radius = "50 mm"
groove_pitch = "5 mm"
[reference]
cable_length = "3 m"
wound_turns = 4
"""


def found(folder: Path, profile: str, runs: list[Run]) -> Diagnosis:
    path = folder / "profile.toml"
    path.write_text(profile)
    return diagnose(runs, read_profile(path)).diagnosis


def swung(law: str) -> list[Run]:
    """A pendulum of 6 N m with Coulomb and viscous friction and that of its gear, twice."""
    time = np.arange(0, 40, 0.01)
    angle = 1.3 * np.sin(2 * np.pi * time / 9) + 0.5 * np.sin(2 * np.pi * time / 3.7 + 1)
    rate = np.gradient(angle, time)
    load = 6.0 * np.sin(angle)
    direction = np.tanh(rate / 0.02)
    transmitted = load
    if law == "load":
        transmitted = load + SHARE * direction * np.abs(load)
    if law == "motor":
        # τ_m = τ + s μ |τ_m|, by iteration; a contraction since μ < 1.
        for _ in range(60):
            transmitted = load + SHARE * direction * np.abs(transmitted)
    torque = transmitted + 0.08 * np.gradient(rate, time) + 0.15 * direction + 0.08 * rate
    return [run_of(time, angle, torque, 0.03, seed) for seed in range(2)]


def run_of(time: Array, angle: Array, torque: Array, noise: float, seed: int) -> Run:
    random = np.random.default_rng(seed)
    measured = torque + random.normal(0, noise, len(time))
    return Run(
        f"run-{seed}",
        time,
        {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(measured, "N m")},
    )


@pytest.mark.parametrize(
    ("law", "effect"), [("load", "friction-of-load"), ("motor", "friction-of-torque")]
)
def test_the_side_and_the_share_of_a_load_friction_are_found(
    law: str, effect: str, tmp_path: Path
) -> None:
    said = found(tmp_path, AXIS, swung(law))
    steps = {step.effects[0]: step for step in said.steps}
    assert said.verdict == "explained"
    share = steps[effect].parameters[effect]["share"]
    assert share.value == pytest.approx(SHARE, abs=0.01)
    assert not {"friction-of-load", "friction-of-torque"} & (set(steps) - {effect})


def test_no_load_friction_where_there_is_none(tmp_path: Path) -> None:
    said = found(tmp_path, AXIS, swung("none"))
    assert said.verdict == "explained"
    assert not {e for step in said.steps for e in step.effects if e.endswith(("-load", "-torque"))}


def lifted(masses: tuple[float, ...]) -> list[Run]:
    """A motor with cogging of order 7 drives a drum of 50 mm directly."""
    time = np.arange(0, 40, 0.01)
    angle = 7.5 * (1 - np.cos(2 * np.pi * time / 20))
    rate = np.gradient(angle, time)
    arm = np.hypot(0.05, 0.005 / (2 * np.pi))
    runs = []
    for mass in masses:
        force = mass * (GRAVITY + arm * np.gradient(rate, time))
        torque = force * arm + 0.3 * np.sin(7 * angle + 0.5) + 0.5 * np.tanh(rate / 0.01)
        for _ in range(2):
            run = run_of(time, angle, torque, 0.03, len(runs))
            runs.append(Run(run.name, time, run.channels, metadata={"load_mass": f"{mass} kg"}))
    return runs


WAVES = {"motor-cogging", "torque-ripple"}


def test_waves_of_a_direct_drive_are_one_set_with_one_load_and_two_separate_them(
    tmp_path: Path,
) -> None:
    one = found(tmp_path, WINCH, lifted((20.0,)))
    (wave,) = [step for step in one.steps if WAVES & set(step.effects)]
    assert set(wave.effects) == WAVES
    assert not wave.certain
    two = found(tmp_path, WINCH, lifted((5.0, 20.0)))
    (wave,) = [step for step in two.steps if WAVES & set(step.effects)]
    assert wave.effects == ("motor-cogging",)


def test_a_gearbox_makes_its_transmission_error_a_member(tmp_path: Path) -> None:
    geared = WINCH + "[gearbox]\nratio = 1.0001\n"
    said = found(tmp_path, geared, lifted((20.0,)))
    (wave,) = [step for step in said.steps if WAVES & set(step.effects)]
    assert set(wave.effects) == {*WAVES, "gear-transmission-error"}
