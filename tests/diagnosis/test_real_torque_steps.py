"""Torque steps of a bench of two coupled motors, recorded by others for system identification.

The data are no part of the project: ``Data/Identification/idf_*.mat`` of the repository
``malik-robert/HSM150-data`` (no licence) are looked for in ``hsm150`` of the folder that
WINCHKIT_REAL names; the tests are skipped where there are none. Inertia and viscous friction of a
motor by its catalogue are variables of the same files.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest
from scipy.io import loadmat

from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

PLACE = Path(os.environ.get("WINCHKIT_REAL", "")) / "hsm150"
FILES = sorted(PLACE.glob("idf_*.mat"))
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        "WINCHKIT_REAL" not in os.environ or not FILES,
        reason="the recordings are not here; WINCHKIT_REAL names the folder that has them",
    ),
]


def run_of(path: Path) -> Run:
    """Columns as the authors' README gives them: time, angle, velocity, measured torque."""
    data = loadmat(path)["data"]
    channels = {
        "motor_angle": Channel(data[:, 2], "rad"),
        "motor_velocity": Channel(data[:, 3], "rad/s"),
        "motor_torque": Channel(data[:, 5], "N m"),
    }
    return Run(path.stem, data[:, 0], channels, {})


def found(inertia: float) -> Diagnosis:
    axis = AxisProfile(name="motor")
    axis = replace(axis, motor=replace(axis.motor, inertia=inertia))
    return diagnose([run_of(path) for path in FILES], axis).diagnosis


def test_friction_is_named_with_the_viscosity_of_the_catalogue() -> None:
    catalogue = loadmat(FILES[0])
    said = found(float(catalogue["J"].item()))
    assert said.verdict == "explained"
    named = {effect: step.parameters[effect] for step in said.steps for effect in step.effects}
    assert 0.02 < named["motor-coulomb"]["torque"].value < 0.045
    interval = named["motor-viscous"]["viscosity"].interval
    assert interval is not None
    assert interval[0] < float(catalogue["B"].item()) < interval[1]
    (torque,) = said.outputs.values()
    assert torque.heldout_rms_after < 0.15 * torque.heldout_rms_before


@pytest.mark.parametrize("inertia", [1e-6, 1e-3])
def test_another_inertia_in_the_profile_is_no_wrong_unit(inertia: float) -> None:
    said = found(inertia)
    assert not {"wrong-factor", "inverted-sign"} & set(said.caveats)
    named = {effect for step in said.steps for effect in step.effects}
    assert "motor-coulomb" in named
