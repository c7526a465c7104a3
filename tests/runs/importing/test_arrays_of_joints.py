"""Arrays of all joints of an arm, as programs of robots save them: ``q``, ``tau_measured``, …"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit.errors import UsageError
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns

JOINTS = 3


def arrays() -> dict[str, np.ndarray]:
    """One joint moves; the parts of the controller are recorded beside the measured torque."""
    random = np.random.default_rng(0)
    time = np.arange(0.0, 20.0, 0.02)
    angle = np.zeros((len(time), JOINTS))
    angle[:, 0] = np.sin(time)
    moving = (np.arange(JOINTS) == 0).astype(float)
    noise = 0.01 * random.normal(size=angle.shape)
    return {
        "time": time,
        "q": angle,
        "qd": np.gradient(angle, time, axis=0) + 1e-3 * random.normal(size=angle.shape),
        "tau_measured": np.cos(time)[:, None] * moving + noise,
        "tau_command": np.cos(time)[:, None] * moving,
        "tau_feedforward": 0.9 * np.cos(time)[:, None] * moving,
        "tau_feedback": 0.1 * np.cos(time)[:, None] * moving,
        "ee_pos": np.stack([np.cos(angle[:, 0]), np.sin(angle[:, 0]), 0.3 + time / 50], axis=1),
    }


def guess(folder: Path, answers: Answers | None = None, **other: np.ndarray) -> Guess:
    path = folder / "arm.npz"
    np.savez(path, **(arrays() | other))
    return guess_columns(read_table(path), answers)


def test_the_measured_torque_goes_before_the_parts_of_the_controller(tmp_path: Path) -> None:
    found = guess(tmp_path)
    channels = {item.channel: item.source for item in found.used}
    assert not found.questions
    assert [channels[f"{joint}.motor_torque"] for joint in range(JOINTS)] == [
        f"tau_measured[{joint}]" for joint in range(JOINTS)
    ]
    assert channels["0.motor_angle"] == "q[0]"


def test_the_place_of_the_end_effector_is_no_angle_of_a_joint_at_rest(tmp_path: Path) -> None:
    sources = {item.source for item in guess(tmp_path).used}
    assert not {source for source in sources if source.startswith("ee_pos")}


def test_the_options_that_a_question_proposes_are_read(tmp_path: Path) -> None:
    """Names with an index: a number in brackets is no unit."""
    torque = arrays()["tau_measured"]
    found = guess(tmp_path, tau_measured=torque, tau_actual=1.1 * torque)
    (question,) = [q for q in found.questions if "motor_torque" in q.text]
    options = [option.removeprefix('--column "').removesuffix('"') for option in question.options]
    assert "0.motor_torque=tau_measured[0]" in options
    for option in options[:2]:
        answer = read_column(option)
        assert (answer.channel, answer.source, answer.unit) == (*option.split("="), "")
        again = guess(
            tmp_path, Answers(columns=(answer,)), tau_measured=torque, tau_actual=1.1 * torque
        )
        assert not again.questions
        assert answer.source in {item.source for item in again.used}


@pytest.mark.parametrize(
    ("text", "source", "unit"),
    [
        ("motor_torque=tau[0]", "tau[0]", ""),
        ("motor_torque=tau[0] [mN m]", "tau[0]", "mN m"),
        ("motor_torque=tau[12]*35.1", "tau[12]", ""),
        ("motor_torque=-tau[3]", "tau[3]", ""),
        ("motor_torque=tau[N m]", "tau", "N m"),
        ("motor_angle=Pos [deg]", "Pos", "deg"),
    ],
)
def test_an_index_belongs_to_the_name(text: str, source: str, unit: str) -> None:
    answer = read_column(text)
    assert (answer.source, answer.unit) == (source, unit)


def test_a_number_apart_is_no_index_and_no_unit() -> None:
    with pytest.raises(UsageError, match="is no known unit"):
        read_column("motor_torque=tau [0]")
