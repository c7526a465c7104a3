"""Joints and motors that others recorded: cogging of a motor, gravity of a joint.

The recordings are no part of the project: they are looked for in the folder that WINCHKIT_REAL
names, and beside the checkout in ``shared/data/real``; the tests are skipped where there are none.
The amplitudes to compare with are least squares on the raw samples, in the README beside them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from recordings_of_others import folder
from winchkit.diagnosis.add import add
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import series_orders
from winchkit.diagnosis.write import write_addition
from winchkit.runs import read_run
from winchkit.runs.run import Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.read import read_profile

VARIABLE = "WINCHKIT_REAL"
AXIS = AxisProfile(name="axis")
COGGING = {7: 0.048, 28: 0.031, 14: 0.019, 36: 0.016, 12: 0.015, 84: 0.007}
"""Amplitudes of the largest orders per turn, N m."""
MAPS = ("map-a_16", "map-b_16", "map-d_16")
"""In map-c orders 7 and 21 have the opposite sign (phase + π): it is no repeat of the others."""
DATA = folder(VARIABLE, "real", "odrive-cogging", "openarm-j4")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        DATA is None, reason=f"the recordings are not here; {VARIABLE} names their folder"
    ),
]


def runs_of(name: str, *files: str) -> list[Run]:
    assert DATA is not None
    return [read_run(DATA / name / f"{file}.csv") for file in files]


def test_cogging_of_a_motor_is_one_effect_with_its_orders() -> None:
    found = diagnose(runs_of("odrive-cogging", *MAPS), AXIS).diagnosis
    first, *others = found.steps
    assert first.effects == ("motor-cogging",)
    amplitudes = {k: size.value for k, size in series_orders(first.parameters["motor-cogging"])}
    for order, expected in COGGING.items():
        assert amplitudes[order] == pytest.approx(expected, rel=0.1)
    # The motor turns one way at one speed: its friction may be any of the family.
    assert all("motor-coulomb" in step.effects for step in others)
    assert len(others) <= 1
    assert found.outputs["motor_torque"].heldout_rms_after < 0.006


def test_the_orders_are_written_as_one_effect_each(tmp_path: Path) -> None:
    source, better = tmp_path / "axis.toml", tmp_path / "better.toml"
    source.write_text('schema = 1\nkind = "axis"\n')
    addition = add("motor-cogging", runs_of("odrive-cogging", *MAPS), read_profile(source))
    write_addition(source, addition, ["map.csv"], better)
    orders = [table.values["order"] for table in read_profile(better).effect]
    assert set(COGGING) <= set(orders)
    assert len(orders) == len(set(orders))


def test_a_joint_that_carries_an_arm_has_gravity_first() -> None:
    found = diagnose(runs_of("openarm-j4", "collect"), AXIS).diagnosis
    assert found.candidates[0].effect == "joint-gravity"
    assert "joint-gravity" in found.steps[0].effects


def test_a_joint_at_three_speeds_has_offsets_presliding_and_gravity() -> None:
    """They are named although a fifth is unexplained; that rest is located over the position."""
    found = diagnose(runs_of("franka-q2", "case3_slow", "case3_middle", "case3_high"), AXIS)
    diagnosis = found.diagnosis
    assert diagnosis.verdict == "partly"
    assert [step.effects for step in diagnosis.steps] == [("motor-dahl",), ("joint-gravity",)]
    friction = diagnosis.steps[0].parameters["motor-dahl"]["torque"]
    assert 0.25 < friction.value < 0.48
    # The constant part of gravity is an offset too: only their differences are determined.
    offsets = {offset.run: offset.value for offset in diagnosis.run_offsets}
    for other in ("case3_slow", "case3_high"):
        assert offsets["case3_middle"] - offsets[other] == pytest.approx(0.4, abs=0.15)
    assert diagnosis.unexplained_share < 0.3
    assert {"drum_angle", "motor_angle", "directed_length"} & {w.variable for w in diagnosis.where}


def test_gravity_is_a_step_with_its_size() -> None:
    """As a winch, the joint may carry a spring or a heavy cable: in 0.5 rad each is a line."""
    assert DATA is not None
    runs = runs_of("franka-q2", "case3_slow", "case3_middle", "case3_high")
    found = diagnose(runs, read_profile(DATA / "franka-q2" / "profile.toml")).diagnosis
    friction, gravity = found.steps
    assert friction.effects == ("motor-dahl",)
    assert gravity.effects[0] == "joint-gravity"
    assert set(gravity.effects) <= {"joint-gravity", "cable-weight", "spring-balancer"}
    assert 1.0 < gravity.parameters["joint-gravity"]["amplitude"].value < 5.0
    assert not gravity.certain


@pytest.mark.campaign
def test_a_joint_at_two_speeds_has_presliding() -> None:
    """Gravity is offered: two speeds contradict each other by more than its size."""
    found = diagnose(runs_of("franka-q2", "case3_slow", "case3_high"), AXIS).diagnosis
    assert found.verdict == "partly"
    assert found.steps[0].effects == ("motor-dahl",)
    assert not any(step.certain for step in found.steps)
