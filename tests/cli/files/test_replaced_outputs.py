"""Outputs of commands replace no earlier file unless ``--replace`` says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import invoke

MOTION = """\
schema = 1
kind = "programme"
name = "m"

[[step]]
winch = "A"
by = "-0.1 m"
speed = "0.2 m/s"
acceleration = "0.5 m/s^2"
"""
ROWS = "\n".join(f"{k / 100},{k % 50},{k % 7}" for k in range(120))


def test_simulated_runs_of_another_seed_replace_none(tmp_path: Path) -> None:
    motion = tmp_path / "m.toml"
    motion.write_text(MOTION)
    words = ("sim", "record", "spiral-bench", motion, "--rate", "10 Hz", "-o", tmp_path / "runs")
    assert invoke(*words).exit_code == 0
    [run] = (tmp_path / "runs").glob("*.csv")
    first = run.read_bytes()
    refused = invoke(*words, "--seed", "1")
    assert refused.exit_code == 2
    assert f"{run} contains a log already" in refused.stderr
    assert "--replace" in refused.stderr
    assert run.read_bytes() == first
    assert invoke(*words, "--seed", "1", "--replace").exit_code == 0
    assert run.read_bytes() != first


def test_a_mapping_of_other_columns_is_not_replaced(tmp_path: Path) -> None:
    """A further file of the same columns keeps the mapping that is there."""
    one, two, other = (tmp_path / name for name in ("one.csv", "two.csv", "other.csv"))
    for path in (one, two):
        path.write_text(f"time [s],motor angle [deg],torque [Nm]\n{ROWS}\n")
    other.write_text(f"time [s],motor angle [rad],torque [mNm]\n{ROWS}\n")
    runs = tmp_path / "runs"
    assert invoke("import", one, "-o", runs, "-y").exit_code == 0
    mapping = (runs / "mapping.toml").read_text()
    assert invoke("import", two, "-o", runs, "-y").exit_code == 0
    assert (runs / "mapping.toml").read_text() == mapping
    refused = invoke("import", other, "-o", runs, "-y")
    assert refused.exit_code == 2
    assert "mapping.toml exists already, with other columns or units" in refused.stderr
    assert not (runs / "other.csv").exists()
    own = tmp_path / "own.toml"
    assert invoke("import", other, "-o", runs, "-y", "--save-mapping", own).exit_code == 0
    assert own.exists()
    assert (runs / "mapping.toml").read_text() == mapping


@pytest.mark.parametrize(
    "words",
    [
        ("export-model", "bench-spiral", "--to", "c", "-o"),
        ("plan", "none.csv", "-p", "bench-spiral", "-o"),
    ],
)
def test_an_output_is_refused_before_the_work(words: tuple[str, ...], tmp_path: Path) -> None:
    there = tmp_path / "there.toml"
    there.write_text("mine")
    refused = invoke(*words, there)
    assert refused.exit_code == 2
    assert "there.toml exists already" in refused.stderr
    assert there.read_text() == "mine"
