"""What ``winchkit diagnose`` prints, the report of its fit, and how Ctrl-C ends it."""

from __future__ import annotations

import json
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from calibration_cases import rows
from command_line import done, invoke
from model_files import record_files, side_by_side, write_runs
from report_answers import answer_of, diagnosis_of, recorded
from robot_poses.truth import csv
from sim_process import start
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.results import Estimate, Step
from winchkit.runs import read_run, write_run


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Runs of a bench with an elastic cable."""
    return write_runs(tmp_path_factory.mktemp("elastic"), recorded("demo-elastic-rope"))


def test_the_answer_with_the_next_command_is_one_screen(elastic: list[Path]) -> None:
    result = done("diagnose", *elastic, "-p", "bench-spiral")
    lines = [*result.stdout.splitlines(), *result.stderr.splitlines()]
    assert len(lines) <= 30
    assert lines[0] == "EXPLAINED"
    assert lines[1].startswith("The cable is elastic. With it, the cable length error falls from")
    assert "power" not in result.stdout
    assert "next: winchkit add cable-elongation-linear --fit" in result.stderr


def test_no_programme_is_planned_for_an_axis(tmp_path: Path) -> None:
    """Motion programmes are in cable length; the answer lists the next runs."""
    time = np.arange(600) / 100
    head = "time [s],motor_angle [rad],motor_torque [N m]"
    runs = [tmp_path / f"run{n}.csv" for n in range(2)]
    for seed, path in enumerate(runs):
        torque = 0.5 * np.tanh(6 * np.cos(2 * time) / 0.1)
        torque += np.random.default_rng(seed).normal(0, 0.01, len(time))
        table = np.column_stack([time, 3 * np.sin(2 * time), torque])
        np.savetxt(path, table, "%.6f", ",", header=head, comments="")
    profile = tmp_path / "axis.toml"
    profile.write_text(
        'schema = 1\nkind = "axis"\nname = "joint"\n'
        '[[effect]]\nid = "motor-coulomb"\ntorque = "0.5 N m"\ntransition = "0.1 rad/s"\n'
    )
    result = done("diagnose", *runs, "-p", profile)
    assert result.stdout.startswith("ADEQUATE")
    assert "winchkit plan" not in result.stderr


def test_verbose_adds_how_it_was_reached(elastic: list[Path]) -> None:
    short = done("diagnose", *elastic, "-p", "bench-spiral").stdout
    long = done("diagnose", *elastic, "-p", "bench-spiral", "-v").stdout
    assert long.startswith(short.splitlines()[0])
    for part in ("detectable with these runs (90 % power)", "highest evidence", "correlation"):
        assert part in long
        assert part not in short


def test_a_robot_whose_geometry_differs_as_a_whole_is_calibrated_next(
    elastic: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    moved = {"exit-point": {"x": Estimate(0.1, 0.01, "m")}}
    whole = Step(("exit-point", "anchor-point"), moved, 0.9, whole=True)
    real = answer_of("demo-adequate")
    found = WinchAnswer(real.engine, real.result, diagnosis_of("explained", whole))
    monkeypatch.setattr("winchkit.diagnosis.diagnose.diagnose", lambda *_, **__: found)
    result = done("diagnose", *elastic, "-p", "bench-spiral")
    assert "Calibrate the robot first" in result.stdout
    assert "next: winchkit calibrate bench-spiral" in result.stderr


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return write_runs(tmp_path_factory.mktemp("runs"), recorded("demo-thick-layers"))


@pytest.mark.slow
def test_a_diagnosis_prints_its_fit(runs: list[Path]) -> None:
    options = ["diagnose", *runs, "--profile", "bench-spiral"]
    shown = done(*options, "--fit-report")
    assert re.search(r"layer-thickness\.thickness_error: +4\.9\d+e-05 \+/- ", shown.stdout)
    found = json.loads(invoke(*options, "--json").stdout)["fit"]
    assert found["dof"] == found["n_observations"] - found["n_unknowns"]
    assert f"= {found['chi_square']:.6g}" in shown.stdout
    assert "[[Fit" not in invoke(*options).stdout


def test_a_calibration_prints_its_fit(tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text(csv(rows()))
    options = ["calibrate", "cabtive", str(poses), "-o", str(tmp_path / "new.toml")]
    shown = done(*options, "--fit-report")
    assert "[[Variables]]\n    1.exit_point.x:" in shown.stdout
    assert "reduced chi-square" in shown.stdout


SLOW = """
from pathlib import Path
from time import sleep
from winchkit.effects.effect import Effect, Parameter
from winchkit.model.stages import Stage

def apply(length, at, values):
    Path({marker!r}).touch()
    sleep(600)
    return length

EFFECT = Effect(
    "slow", Stage.LENGTH_INSTRUMENT, (Parameter("size", "m", 0.0, 1e-3),), apply,
    ("cable_length",), what="never ends", formula="x", source="none", looks_like="nothing",
    told_apart="nothing",
)
"""
PATIENCE = 60


@pytest.mark.slow
@pytest.mark.parametrize("winch", ["all", "A"])
def test_an_interrupted_diagnosis_waits_for_nothing(winch: str, tmp_path: Path) -> None:
    runs, both = record_files(tmp_path), tmp_path / "both.csv"
    write_run(side_by_side(read_run(runs[0]), read_run(runs[2])), both)
    marker, effects = tmp_path / "begun", tmp_path / "slow.py"
    effects.write_text(SLOW.format(marker=str(marker)), encoding="utf-8")
    asked = ("diagnose", both, "-p", "bench-spiral", "--winch", winch, "--effects", effects)
    process = start(*asked)
    try:
        until = time.monotonic() + PATIENCE
        while not marker.exists() and time.monotonic() < until and process.poll() is None:
            time.sleep(0.05)
        assert marker.exists()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130
    assert told.split("\n")[-2:] == ["winchkit: interrupted", ""]
    assert "Traceback" not in told
