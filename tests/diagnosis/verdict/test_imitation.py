"""A load on a lever, whose ratio follows the cable length: no effect of the catalogue.

The closed form of a drum with a motor on its shaft. Many effects imitate the lever in part; one
curve over the load times the cable length is the lever.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from winchkit import diagnose, read_profile
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run

GRAVITY, ARM, PITCH, LENGTH = 9.80665, 0.06, 5e-3, 4.0
PER_RADIAN = float(np.hypot(ARM, PITCH / (2 * np.pi)))
NOISE = {"tension": 0.8, "motor_torque": 0.05, "cable_length": 3e-4}
COULOMB = 0.2
PROFILE = f"""schema = 1
kind = "winch"
name = "w"
[drum]
kind = "grooved"
winding_radius = "{ARM} m"
groove_pitch = "{PITCH} m"
[reference]
cable_length = "{LENGTH} m"
wound_turns = 6
"""


def runs(bend: float, coulomb: float) -> list[Run]:
    """Three loads, each lifted twice over 1.5 m; ``bend``: 1/m², of the ratio over the length."""
    time = np.arange(0.0, 30.0, 0.01)
    speed = 0.35 * np.sin(2 * np.pi * time / 10) ** 3 + 0.1 * np.sin(2 * np.pi * time / 30)
    wound = cumulative_trapezoid(speed, time, initial=0.0)
    length = LENGTH - wound
    ratio = 1 + bend * (length - LENGTH) ** 2
    out = []
    for number, mass in enumerate((5.0, 5.0, 10.0, 10.0, 20.0, 20.0)):
        random = np.random.default_rng(number)
        force = mass * (GRAVITY + np.gradient(speed, time)) * ratio
        true = {
            "tension": force,
            "motor_torque": force * PER_RADIAN + coulomb * np.tanh(speed / 0.002),
            "cable_length": length,
        }
        units = {"tension": "N", "motor_torque": "N m", "cable_length": "m"}
        channels = {"motor_angle": Channel(wound / PER_RADIAN, "rad")}
        for name, values in true.items():
            noise = random.normal(0.0, NOISE[name], len(time))
            channels[name] = Channel(values + noise, units[name])
        out.append(Run(f"r{number}", time, channels, metadata={"load_mass": f"{mass} kg"}))
    return out


def diagnosed(folder: Path, recorded: list[Run]) -> Diagnosis:
    path = folder / "winch.toml"
    path.write_text(PROFILE, encoding="utf-8")
    return diagnose(recorded, read_profile(path)).diagnosis


def test_one_open_law_takes_the_place_of_effects_that_imitate_a_curve(tmp_path: Path) -> None:
    (step,) = diagnosed(tmp_path, runs(0.25, 0.0)).steps
    assert step.law == "open"
    assert step.curve == "load times cable length"
    assert not step.certain


@pytest.mark.parametrize("coulomb", [0.0, COULOMB])
def test_laws_of_the_catalogue_are_no_imitation(coulomb: float, tmp_path: Path) -> None:
    found = diagnosed(tmp_path, runs(0.0, coulomb))
    assert [step.effects[0] for step in found.steps] == ["motor-coulomb"] * bool(coulomb)
    assert not any(step.curve for step in found.steps)
