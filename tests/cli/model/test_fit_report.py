"""``--fit-report``: the report of the fit below the answer, and the same figures in the JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from calibration_cases import rows
from report_answers import recorded
from robot_poses.truth import csv
from winchkit.cli import main
from winchkit.runs.writer import write_run


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("runs")
    files = []
    for run in recorded("demo-thick-layers"):
        files.append(str(folder / f"{run.name}.csv"))
        write_run(run, files[-1])
    return files


@pytest.mark.slow
def test_a_diagnosis_prints_its_fit(runs: list[str]) -> None:
    options = ["diagnose", *runs, "--profile", "bench-spiral"]
    shown = CliRunner().invoke(main, [*options, "--fit-report"])
    assert shown.exit_code == 0, shown.output
    assert re.search(r"layer-thickness\.thickness_error: +4\.9\d+e-05 \+/- ", shown.stdout)
    found = json.loads(CliRunner().invoke(main, [*options, "--json"]).stdout)["fit"]
    assert found["dof"] == found["n_observations"] - found["n_unknowns"]
    assert f"= {found['chi_square']:.6g}" in shown.stdout
    assert "[[Fit" not in CliRunner().invoke(main, options).stdout


def test_a_calibration_prints_its_fit(tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text(csv(rows()))
    options = ["calibrate", "cabtive", str(poses), "-o", str(tmp_path / "new.toml")]
    shown = CliRunner().invoke(main, [*options, "--fit-report"])
    assert shown.exit_code == 0, shown.output
    assert "[[Variables]]\n    1.exit_point.x:" in shown.stdout
    assert "reduced chi-square" in shown.stdout
