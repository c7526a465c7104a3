"""What a strong law leaves: its own error is not explained by others, a further effect is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from campaign.family.case import write_case
from campaign.family.run import Job
from winchkit import diagnose, read_profile, read_run
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile


@pytest.mark.slow
def test_the_reversal_of_a_strong_friction_is_not_explained_by_other_effects(
    tmp_path: Path,
) -> None:
    """Sharp friction through a logger, 40 times the noise: five effects were found for it."""
    paths, profile = write_case(Job("friction", 6402, 1, 300.0).case(), tmp_path)
    found = diagnose([read_run(path) for path in paths], read_profile(profile)).diagnosis
    assert found.verdict == "explained"
    (step,) = found.steps
    assert set(step.effects) <= {"pulley-coulomb", "pulley-capstan"}


@pytest.mark.slow
def test_friction_and_viscosity_beside_a_weight_are_found() -> None:
    """They make a thousandth of what the weight does; each is a half of what that leaves."""
    gravity, coulomb, viscosity, noise = 8.0, 0.15, 0.1, 0.02
    time, recorded = np.arange(0.0, 30.0, 0.01), []
    for number, cycle in enumerate((6.0, 6.0, 11.0, 11.0)):
        speed = 1.5 * np.sin(2 * np.pi * time / cycle) * np.cos(0.21 * time)
        angle = cumulative_trapezoid(speed, time, initial=0.0)
        torque = gravity * np.sin(angle + 0.3) + coulomb * np.tanh(speed / 1e-3)
        torque += viscosity * speed + np.random.default_rng(number).normal(0.0, noise, len(time))
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        recorded.append(Run(f"r{number}", time, channels))
    found = diagnose(recorded, AxisProfile(name="joint")).diagnosis
    values = {step.effects[0]: step.parameters[step.effects[0]] for step in found.steps}
    assert values["joint-gravity"]["amplitude"].value == pytest.approx(gravity, rel=0.01)
    assert values["motor-coulomb"]["torque"].value == pytest.approx(coulomb, abs=0.02)
    assert values["motor-viscous"]["viscosity"].value == pytest.approx(viscosity, abs=0.02)
