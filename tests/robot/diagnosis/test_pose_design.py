"""Poses to take next: their power, the file of them, and what taking them comes to."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import invoke
from model_files import answer
from robot_poses.cases import CASES
from robot_poses.hidden import BASE, profile_text, record
from robot_poses.truth import turn
from winchkit.diagnosis.design.discrimination import SEPARATED_AT, power_of, separation
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.verdict.equivalence import pairs_of
from winchkit.robot.diagnosis.pose_design import pose_offers
from winchkit.runs import read_run
from winchkit.schema.read import read_robot

MOVED = next(case for case in CASES if case.name == "exit point")


def without_tensions(run: Path) -> Path:
    """A robot without cells: only they see what a shifted point does to moments."""
    rows = list(csv.reader(run.read_text().splitlines()))
    kept = [index for index, name in enumerate(rows[0]) if "tension" not in name]
    with run.open("w", newline="") as file:
        csv.writer(file).writerows([row[index] for index in kept] for row in rows)
    return run


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """An exit point off, on poses of a platform that never turned."""
    folder = tmp_path_factory.mktemp("flat")
    profile = folder / "robot.toml"
    profile.write_text(profile_text())
    run = record(MOVED, folder, "flat.csv", count=40, repeats=12, tilt=0.0)
    return profile, without_tensions(run)


@pytest.fixture(scope="module")
def planned(flat: tuple[Path, Path]) -> tuple[dict[str, Any], Path]:
    profile, run = flat
    out = run.with_name("next.csv")
    return answer("plan", run, "-p", profile, "-o", out), out


def test_points_that_only_turning_distinguishes_are_distinguished_by_turning(
    planned: tuple[dict[str, Any], Path],
) -> None:
    offers = {offer["kind"]: offer["separates"][0] for offer in planned[0]["offers"]}
    assert sorted(offers["turned"]["effects"]) == ["anchor-point/3", "exit-point/3"]
    assert offers["turned"]["power"] > 0.95
    assert offers["turned"]["power_so_far"] < 0.1
    assert offers["more"]["power"] < 0.1
    assert planned[0]["offers"][0]["kind"] == "turned"


def test_the_file_holds_poses_with_the_motor_angles_that_lead_there(
    planned: tuple[dict[str, Any], Path],
) -> None:
    """Angles by the generator's own geometry; what was fitted moves line 3 alone."""
    run = read_run(planned[1])
    assert len(run) == len(planned[0]["offers"][0]["poses"]) == 12
    turned = [run[f"platform_{name}"] for name in ("roll", "pitch", "yaw")]
    assert np.degrees(np.abs(turned).max()) > 8
    for row in range(len(run)):
        x, y, z = (float(run[f"platform_{axis}"][row]) for axis in "xyz")
        roll, pitch, yaw = (float(values[row]) for values in turned)
        for line in (0, 5):
            there = BASE.motor_angle(line, (x, y, z), turn(roll, pitch, yaw), 0.0)
            assert run[f"{line + 1}.motor_angle"][row] == pytest.approx(there, abs=2e-4)


def test_taking_such_poses_names_one_of_them(flat: tuple[Path, Path], tmp_path: Path) -> None:
    profile, run = flat
    tilt = math.radians(11.0)
    more = record(MOVED, tmp_path, "more.csv", count=12, repeats=0, seed=5, tilt=tilt)
    found = answer("diagnose", run, without_tensions(more), "-p", profile)
    assert [step["lines"] for step in found["steps"]] == [{"exit-point": ["3"]}]
    assert found["next_runs"] == []


def test_the_power_is_that_of_all_rows_at_once(flat: tuple[Path, Path]) -> None:
    """Pose by pose and in one least-squares problem: the same λ."""
    profile, run = flat
    found = diagnose([read_run(run)], read_robot(profile))
    (pair,) = pairs_of(found.sets)
    regression, final = found.engine.regression, found.result.final.hypothesis
    whole = separation(regression, *pair, lambda rows: np.ones(rows.n_rows))
    offers = pose_offers(regression, final, [pair], [SEPARATED_AT], count=3)
    assert offers[0].powers_so_far[0] == pytest.approx(power_of(whole), abs=0.01)
    assert all(len(offer.pose.position) == 3 for offer in offers)
    (run_offered,) = answer("diagnose", run, "-p", profile)["next_runs"]
    assert run_offered["power"] > 0.95
    assert "turned by up to" in run_offered["programme"]


def test_what_no_poses_distinguish_is_said_with_what_does(tmp_path: Path) -> None:
    """On half a turn of a drum its radius and its gear ratio are one."""
    profile = tmp_path / "robot.toml"
    profile.write_text(profile_text())
    case = next(case for case in CASES if case.name == "drum radius")
    run, out = record(case, tmp_path, "poses.csv", count=30, repeats=12), tmp_path / "next.csv"
    result = invoke("plan", run, "-p", profile, "-o", out)
    assert "What does: an" in result.stdout
    assert "an encoder on the drum" in " ".join(result.stdout.split())
    assert not out.exists()
    assert max(map(len, result.stdout.splitlines())) <= 80


def test_options_without_meaning_for_a_robot_are_refused_with_the_action(
    flat: tuple[Path, Path], tmp_path: Path
) -> None:
    profile, run = flat
    for option, words in (
        (("-o", tmp_path / "next.toml"), "name a .csv file"),
        (("--bench", "bench.toml"), "leave it out"),
        (("--band", "5"), "no torque"),
        (("--winch", "1"), "leave it out"),
    ):
        result = invoke("plan", run, "-p", profile, *option)
        assert result.exit_code == 2
        assert words in result.output
