"""A certain value contains what it is with another member of another step's set."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made, with_channel
from winchkit.diagnosis.diagnose import diagnose

STIFFNESS = 60e3
"""EA, N."""
DEAD, GRAVITY = 1.5, 9.80665
RIDE = Ride(samples=800, stroke=1000.0, period=8.0)


def runs_with(frame: float) -> list[object]:
    """Closed form: each force F = m (g + a) lengthens by F (ℓ + dead)/EA + F/k."""
    rise = GROOVED.drum.winding_radius / GROOVED.gearbox.ratio
    acceleration = rise * np.gradient(np.gradient(RIDE.angle, RIDE.time), RIDE.time)
    runs = []
    for seed, mass in enumerate((5.0, 15.0, 30.0)):
        for repeat in range(2):
            run = made(10 * seed + repeat, GROOVED, load_mass=mass, ride=RIDE)
            force, free = mass * (GRAVITY + acceleration), run["cable_length"]
            longer = force * ((free + DEAD) / STIFFNESS + 1 / frame)
            runs.append(with_channel(run, "cable_length", free + longer, "m"))
    return runs


@pytest.mark.parametrize("frame", [250e3, 400e3])
def test_a_value_contains_what_another_member_of_a_set_makes_of_it(frame: float) -> None:
    """Beside a frame that is a hundredth of the elasticity, whichever name of it comes first."""
    found = diagnose(runs_with(frame), GROOVED).diagnosis
    step = next(s for s in found.steps if "cable-elongation-linear" in s.effects)
    assert "depends" in {doubt.code for doubt in step.doubts}
    value = step.parameters["cable-elongation-linear"]["axial_stiffness"]
    assert step.effects == ("cable-elongation-linear",)
    low, high = value.interval
    assert low <= STIFFNESS <= high
    assert abs(value.value - STIFFNESS) <= 2 * value.std


def test_a_value_that_depends_on_nothing_keeps_its_interval() -> None:
    found = diagnose(runs_with(np.inf), GROOVED).diagnosis
    (step,) = found.steps
    value = step.parameters["cable-elongation-linear"]["axial_stiffness"]
    assert step.certain
    assert not [doubt for doubt in step.doubts if doubt.code == "depends"]
    assert value.std < 0.01 * STIFFNESS
