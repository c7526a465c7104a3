"""Four joints of an arm that stick and slip, recorded by others for friction identification.

The data are no part of the project: ``real_uart_capture_collect_joint_N.npz`` of the repository
``YIZHIXIAOCANGSHU/Friction-Identification-for-Manipulators`` (folder ``results``, no licence) are
looked for in ``openarm-joints`` of the folder that WINCHKIT_REAL names; the tests are skipped where
there are none. The expected sizes are least squares on the samples at which the joint moves.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

PLACE = Path(os.environ.get("WINCHKIT_REAL", "")) / "openarm-joints"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        "WINCHKIT_REAL" not in os.environ or not PLACE.is_dir(),
        reason="the recordings are not here; WINCHKIT_REAL names the folder that has them",
    ),
]
FRICTION = "motor-coulomb", "motor-dahl", "motor-stribeck"
FASTER = 0.05
"""rad/s, at which the joint moves."""


def path_of(joint: int) -> Path:
    return PLACE / f"real_uart_capture_collect_joint_{joint}.npz"


def least_squares(joint: int) -> dict[str, float]:
    """Amplitudes of gravity and Coulomb friction, N m, of the samples that move."""
    saved = np.load(path_of(joint))
    angle, rate, torque = (saved[key][:, joint - 1] for key in ("q", "qd", "tau_measured"))
    moving = np.abs(rate) > FASTER
    columns = [np.ones_like(angle), np.sin(angle), np.cos(angle), np.sign(rate)]
    table = np.column_stack(columns)[moving]
    solution, *_ = np.linalg.lstsq(table, torque[moving], rcond=None)
    return {"sine": float(solution[1]), "friction": float(solution[3])}


@pytest.mark.parametrize("joint", [1, 3, 6, 7])
def test_friction_and_gravity_are_named_with_their_sizes(joint: int) -> None:
    saved = np.load(path_of(joint))
    channels = {
        "motor_angle": Channel(saved["q"][:, joint - 1], "rad"),
        "motor_torque": Channel(saved["tau_measured"][:, joint - 1], "N m"),
    }
    run = Run(f"joint-{joint}", saved["time"], channels, {})
    found = diagnose([run], AxisProfile(name="joint")).diagnosis
    assert found.verdict == "explained"
    named = {effect: step.parameters[effect] for step in found.steps for effect in step.effects}
    expected = least_squares(joint)
    (friction, *_) = [named[effect]["torque"].value for effect in FRICTION if effect in named]
    assert friction == pytest.approx(expected["friction"], rel=0.2)
    (torque,) = found.outputs.values()
    assert torque.heldout_rms_after < 0.5 * torque.heldout_rms_before
    if joint == 1:
        assert named["joint-gravity"]["amplitude"].value == pytest.approx(expected["sine"], rel=0.1)
    assert any(finding.code == "standstill" for finding in found.sanity)


@pytest.mark.parametrize("joint", [1, 3, 6, 7])
def test_the_columns_of_all_joints_are_found_without_a_question(joint: int) -> None:
    found = guess_columns(read_table(path_of(joint)))
    channels = {item.channel: item.source for item in found.used}
    assert not found.questions
    assert channels[f"{joint - 1}.motor_angle"] == f"q[{joint - 1}]"
    assert channels[f"{joint - 1}.motor_torque"] == f"tau_measured[{joint - 1}]"
    assert not {source for source in channels.values() if source.startswith("ee_")}
