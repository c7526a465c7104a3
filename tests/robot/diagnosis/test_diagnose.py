"""Robots diagnosed as a user does it, on files that benchmarks/robot_poses wrote."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import invoke
from model_files import answer
from robot_poses.cases import CASES
from robot_poses.hidden import BASE, profile_text, record
from robot_poses.truth import HOME, turn
from winchkit.schema.read import read_robot

BY_NAME = {case.name: case for case in CASES}


def files(folder: Path, case: str, **how: Any) -> tuple[Path, Path]:
    """A robot's profile with its true geometry, and poses with something hidden."""
    profile = folder / "robot.toml"
    profile.write_text(profile_text())
    return profile, record(BY_NAME[case], folder, "poses.csv", **how)


def diagnosed(folder: Path, case: str, **how: Any) -> dict[str, Any]:
    profile, run = files(folder, case, **how)
    return answer("diagnose", run, "--profile", profile)


def named(found: dict[str, Any]) -> list[str]:
    return [
        effect + (f"/{line}" if line else "")
        for step in found["steps"]
        for effect, lines in step["lines"].items()
        for line in lines
    ]


@pytest.mark.parametrize(
    "case",
    [
        "exit point",
        pytest.param("payload mass", marks=pytest.mark.campaign),
        pytest.param("elastic ropes", marks=pytest.mark.campaign),
        pytest.param("home length", marks=pytest.mark.campaign),
    ],
)
def test_what_is_hidden_is_named_and_the_held_out_error_falls(case: str, tmp_path: Path) -> None:
    found = diagnosed(tmp_path, case)
    assert found["verdict"] == "explained"
    assert found["geometry"] == "file"
    assert named(found) == list(BY_NAME[case].answers)
    output = found["outputs"]["tension" if "payload" in case else "platform_position"]
    assert output["heldout_rms_after"] < 1.2 * output["noise_rms"]
    assert output["heldout_rms_before"] > 1.2 * output["heldout_rms_after"]
    assert output["noise_source"] == "repeats"
    (step,) = found["steps"]
    assert (step["law"], step["certain"], step["doubts"]) == ("established", True, [])
    assert step["share"] > 0.9
    acts = "tension" if "payload" in case else "cable_length"
    line = BY_NAME[case].answers[0].partition("/")[2] or None
    assert [(place["output"], place["line"]) for place in step["place"]] == [(acts, line)]


def test_two_effects_on_different_equations_share_what_was_unexplained(tmp_path: Path) -> None:
    """The shares of two effects that act on different equations add up to one."""
    found = diagnosed(tmp_path, "home length, payload")
    assert found["verdict"] == "explained"
    assert sorted(named(found)) == ["home-length/4", "payload-mass"]
    assert all(step["certain"] for step in found["steps"])
    assert sum(step["share"] for step in found["steps"]) == pytest.approx(1.0, abs=0.05)
    (payload,) = (step for step in found["steps"] if step["effects"] == ["payload-mass"])
    assert (payload["law"], payload["doubts"]) == ("established", [])
    assert [(place["output"], place["line"]) for place in payload["place"]] == [("tension", None)]
    tension = found["outputs"]["tension"]
    assert tension["heldout_rms_after"] < 1.2 * tension["noise_rms"]
    assert tension["heldout_rms_before"] > 1.2 * tension["heldout_rms_after"]


def test_a_wrong_value_of_the_profile_is_a_step_beside_that_of_the_file(tmp_path: Path) -> None:
    profile, run = files(tmp_path, "home length")
    table = '\n[[effect]]\nid = "home-length"\nlength = { 4 = "2 mm" }\n'
    profile.write_text(profile_text() + table)
    found = answer("diagnose", run, "--profile", profile)
    assert found["verdict"] == "explained"
    (step,) = found["steps"]
    assert (step["lines"], step["refitted"]) == ({"home-length": ["4"]}, True)
    assert step["file_values"] == {"length": pytest.approx(2e-3)}
    length = step["parameters"]["home-length"]["length"]
    assert abs(length["value"] - 0.5e-3) < 4 * length["std"]
    place = found["outputs"]["platform_position"]
    assert place["heldout_rms_before"] > 3 * place["heldout_rms_after"]
    profile.write_text(profile_text() + table.replace("2 mm", "0.5 mm"))
    assert answer("diagnose", run, "--profile", profile)["verdict"] == "adequate"


def test_without_repeats_an_error_beyond_usual_instruments_is_not_adequate(tmp_path: Path) -> None:
    """Waves of 0.3 mm that no effect has: without repeats they are in the estimated noise."""
    found = diagnosed(tmp_path, "outside: waves, no repeats", count=40)
    assert found["verdict"] in ("undecided", "unknown")
    assert not any(step["certain"] for step in found["steps"])
    place = found["outputs"]["platform_position"]
    assert place["noise_rms"] < 0.5 * place["heldout_rms_after"]
    assert place["noise_upper"] >= place["rms_after"]
    if found["verdict"] == "undecided":
        assert "twice" in found["next_runs"][0]["repeat"]


def test_nothing_is_named_where_nothing_is_hidden(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, "none")
    assert found["verdict"] == "adequate"
    assert found["steps"] == []
    range_of_runs = {row["effect"]: row["smallest"] for row in found["detectable"]}
    assert 1e-6 < range_of_runs["home-length"] < 1e-4


@pytest.mark.campaign  # in .ci/run it is tests/robot/report/test_diagnosis.py's
def test_what_no_effect_explains_is_unknown(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, "outside: waves")
    assert found["verdict"] in ("unknown", "partly")
    assert not any(step["certain"] for step in found["steps"])
    assert all(step["doubts"] for step in found["steps"])
    assert found["unexplained"]["share"] > 0.1


@pytest.mark.campaign
def test_a_geometry_that_fits_another_cause_is_never_certain(tmp_path: Path) -> None:
    """A tracker whose metre is 2 mm long: the geometry imitates it, and nothing is certain."""
    found = diagnosed(tmp_path, "outside: tracker's metre")
    assert found["geometry"] == "refitted"
    step = found["steps"][0]
    assert step["whole"]
    assert (step["law"], step["certain"]) == ("open", False)
    assert [doubt["code"] for doubt in step["doubts"]] == ["whole"]


def test_calibrate_then_diagnose_names_the_elasticity_that_calibrating_hid(tmp_path: Path) -> None:
    """The sentence of the plan: the held-out error falls with the effect, geometry refitted."""
    run = record(BY_NAME["elastic ropes"], tmp_path, "poses.csv", count=80, repeats=12)
    calibrated = tmp_path / "calibrated.toml"
    assert invoke("calibrate", "cabtive", run, "-o", calibrated).exit_code == 0
    found = answer("diagnose", run, "--profile", calibrated)
    assert found["verdict"] == "explained"
    assert found["geometry"] == "refitted"
    assert named(found) == ["cable-elongation-linear"]
    stiffness = found["steps"][0]["parameters"]["cable-elongation-linear"]["axial_stiffness"]
    assert abs(stiffness["value"] - 2e5) < 4 * stiffness["std"]
    output = found["outputs"]["platform_position"]
    assert output["heldout_rms_after"] < 0.7 * output["heldout_rms_before"]
    # The tracker that the poses were made with; a dozen repeats alone know it to a quarter.
    assert output["heldout_rms_after"] < 1.2 * 2e-5 * 3**0.5
    assert output["noise_rms"] == pytest.approx(2e-5 * 3**0.5, rel=0.3)


def test_an_effect_is_added_on_its_line_and_taken_back(tmp_path: Path) -> None:
    profile, run = files(tmp_path, "swivel radius", count=40)
    better, back = tmp_path / "better.toml", tmp_path / "back.toml"
    before = answer("compare", run, "--profile", profile)["outputs"]["platform_position"]
    assert invoke("add", "swivel-radius", "--fit", run, "-p", profile, "-o", better).exit_code == 2
    added = answer(
        "add", "swivel-radius", "--winch", "6", "--fit", run, "-p", profile, "-o", better
    )
    value = added["parameters"]["swivel-radius/6"]["radius_error"]
    assert abs(value["value"] - 1.5e-3) < 4 * value["std"]
    table = read_robot(better).effect[0]
    assert (table.id, table.values["line"]) == ("swivel-radius", "6")
    after = answer("compare", run, "--profile", better)["outputs"]["platform_position"]
    assert after["rms"] < 0.6 * before["rms"]
    assert invoke("check", better).exit_code == 0
    steps = answer("ledger", "-p", better)["steps"]
    assert steps[0]["after"]["platform_position"] < steps[0]["before"]["platform_position"]
    assert invoke("undo", "-p", better, "-o", back).exit_code == 0
    assert read_robot(back).effect == ()


def test_effects_are_added_removed_and_taken_back_with_the_others_refitted(tmp_path: Path) -> None:
    """A cable's law brings home lengths along; each line has one, whatever comes after."""
    profile, run = files(tmp_path, "elastic, exit point", count=40, repeats=12)
    names = ("rope", "both", "rope-again", "back")
    rope, both, again, back = (tmp_path / f"{name}.toml" for name in names)
    first = answer("add", "cable-elongation-linear", "--fit", run, "-p", profile, "-o", rope)[
        "outputs"
    ]["platform_position"]
    answer("add", "exit-point/3", "--fit", run, "-p", rope, "-o", both)
    assert invoke("check", both).exit_code == 0
    assert len(read_robot(both).effect) == 3
    removed = answer("remove", "exit-point/3", "--fit", run, "-p", both, "-o", again)
    assert invoke("check", again).exit_code == 0
    left = removed["outputs"]["platform_position"]
    assert left["heldout_rms_after"] == pytest.approx(first["heldout_rms_after"], rel=0.05)
    assert left["heldout_rms_after"] > 1.2 * left["heldout_rms_before"]
    before, after = (read_robot(path).effect[0].values for path in (rope, again))
    kilonewtons = [float(str(v["axial_stiffness"]).split()[0]) / 1e3 for v in (before, after)]
    assert kilonewtons[1] == pytest.approx(kilonewtons[0], rel=0.02)
    assert len(read_robot(again).effect) == 2
    steps = answer("ledger", "-p", again)["steps"]
    assert [step["did"] for step in steps] == ["add", "add", "remove"]
    errors = [step["after"]["platform_position"] for step in steps]
    assert errors[1] < errors[0]
    assert errors[1] < errors[2]
    assert "platform position" in invoke("ledger", "-p", again).output
    assert invoke("undo", "-p", again, "-o", back).exit_code == 0
    assert [table.id for table in read_robot(back).effect] == [
        table.id for table in read_robot(both).effect
    ]


def test_one_lines_home_length_is_taken_out_of_the_table_of_all(tmp_path: Path) -> None:
    profile = tmp_path / "robot.toml"
    lengths = '[[effect]]\nid = "home-length"\nlength = { 1 = "1 mm", 2 = "2 mm" }\n'
    profile.write_text(profile_text() + "\n" + lengths)
    one, none = tmp_path / "one.toml", tmp_path / "none.toml"
    assert invoke("remove", "home-length/2", "-p", profile, "-o", one).exit_code == 0
    assert dict(read_robot(one).effect[0].values["length"]) == {"1": "1 mm"}
    assert invoke("remove", "home-length", "--winch", "1", "-p", one, "-o", none).exit_code == 0
    assert read_robot(none).effect == ()
    result = invoke("remove", "home-length/3", "-p", profile, "-o", tmp_path / "x.toml")
    assert result.exit_code == 3
    assert "home-length/1, home-length/2" in result.output


def test_bad_input_is_reported_with_the_reason(tmp_path: Path) -> None:
    profile, run = files(tmp_path, "none", count=14, repeats=0)
    lines = run.read_text().splitlines()
    few = tmp_path / "few.csv"
    few.write_text("\n".join(lines[:6]) + "\n")
    result = invoke("diagnose", few, "--profile", profile)
    assert result.exit_code == 3
    assert "at least 10 are needed" in result.output
    assert invoke("diagnose", run, "--profile", profile, "--band", "5").exit_code == 2
    assert invoke("diagnose", run, "--profile", profile, "--winch", "1").exit_code == 2
    unknown = invoke(
        "add", "pulley-coulomb", "--fit", run, "-p", profile, "-o", tmp_path / "x.toml"
    )
    assert unknown.exit_code == 2
    assert "motion" in unknown.output


@pytest.mark.parametrize("interval", [1.0, 12.0])
def test_poses_along_a_path_with_a_time_of_each_are_poses(interval: float, tmp_path: Path) -> None:
    """Neighbouring poses that differ little look like samples of a motion, 44 of them."""
    truth, rng = BASE, np.random.default_rng(7)
    header = ["time [s]", *(f"{i + 1}.motor_angle [rad]" for i in range(8))]
    header += [f"platform_{name} [m]" for name in "xyz"]
    rows = []
    for number in range(44):
        a = number / 7
        place = (HOME[0] + 0.07 * np.cos(a), HOME[1] + 0.07 * np.sin(a), HOME[2] + 0.002 * number)
        angles = [truth.motor_angle(i, place, turn(0, 0, 0), 0.0) for i in range(8)]
        seen = np.array(place) + rng.normal(0, 1e-4, 3)
        rows.append([number * interval, *angles, *seen])
    profile, run = tmp_path / "robot.toml", tmp_path / "poses.csv"
    profile.write_text(profile_text())
    lines = [",".join(f"{value:.9f}" for value in row) for row in rows]
    run.write_text("\n".join([",".join(header), *lines]) + "\n")
    found = answer("compare", run, "--profile", profile)
    assert found["outputs"]["platform_position"]["samples"] == 44 * 3
    assert found["outputs"]["platform_position"]["rms"] < 5e-4
