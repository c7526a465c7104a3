"""Bad files and bad words: a message with its place, nothing on stdout, never a traceback."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from command_line import done, invoke, own_process
from model_files import edited
from winchkit.catalog import find
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.read import read_profile

ROWS = 200
HEADER = 2
"""Lines above the first row: one of metadata and the header."""


def good_lines() -> list[str]:
    """A run of the bench's winch; columns are time, angle, torque, tension, length."""
    random = np.random.default_rng(1)
    time = np.arange(ROWS) / 50
    angle = 150 * (1 - np.cos(np.pi * np.clip(time - 0.5, 0, 3) / 1.5))
    line = Line(read_profile(find("profiles", "bench-spiral")))
    told = line.predict(line.motion(Signals(time, angle, load_mass=10.0)))
    sizes = (("motor_torque", 5e-3), ("tension", 0.8), ("cable_length", 3e-4))
    columns = [time, angle, *(told[n] + s * random.standard_normal(ROWS) for n, s in sizes)]
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    header = "time [s],motor_angle [rad],motor_torque [N m],tension [N],cable_length [m]"
    return ["# load_mass: 10 kg", header, *rows]


GOOD = good_lines()


def with_column(name: str, cells: list[str]) -> list[str]:
    """Lines with every cell of one column replaced."""
    column = GOOD[1].split(",").index(name)
    out = list(GOOD)
    for row, cell in enumerate(cells):
        out = edited(out, HEADER + row, column, cell) if cell is not None else out
    return out


CASES: dict[str, tuple[list[str], str]] = {
    "of the reader, with its line": (edited(GOOD, 41, 3, "n/a"), ":42: column 'tension' has 'n/a'"),
    "of the whole file": ([], ": the file is empty"),
    "of what can be compared": (
        with_column("tension [N]", ["12.5"] * ROWS),
        ": column 'tension': constant at 12.5 in all 200 samples",
    ),
}
"""The other faults: tests/runs/formats/test_csv.py, tests/diagnosis/data/test_validation.py."""


@pytest.mark.parametrize("command", ["compare", "diagnose"])
@pytest.mark.parametrize("case", CASES)
def test_a_bad_run(command: str, case: str, tmp_path: Path) -> None:
    lines, said = CASES[case]
    file = tmp_path / "lift.csv"
    file.write_text("".join(f"{line}\n" for line in lines))
    result = invoke(command, file, "--profile", "bench-spiral", "--json")
    assert (result.exit_code, result.stdout) == (3, "")
    assert result.stderr.startswith(f"{file}")
    assert said in result.stderr
    assert "Traceback" not in result.stderr
    assert "internal error" not in result.stderr


@pytest.fixture
def good(tmp_path: Path) -> Path:
    file = tmp_path / "good.csv"
    file.write_text("".join(f"{line}\n" for line in GOOD))
    return file


def refused(code: int, said: str, *arguments: object) -> None:
    result = invoke(*arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert said in result.stderr
    assert "Traceback" not in result.stderr


def test_the_good_run_is_good(good: Path) -> None:
    assert invoke("compare", good, "-p", "bench-spiral").exit_code == 0


def test_the_good_run_alone_lacks_nothing(good: Path) -> None:
    result = invoke("diagnose", good, "-p", "bench-spiral", "--json")
    assert json.loads(result.stdout)["verdict"] == "adequate"


def test_faults_of_all_files_come_at_once(good: Path, tmp_path: Path) -> None:
    empty, none = tmp_path / "empty.csv", tmp_path / "none.csv"
    empty.write_text("")
    result = done("compare", good, empty, none, "-p", "bench-spiral", code=3)
    assert result.stderr.splitlines() == [
        f"{empty}: the file is empty",
        f"{none}: there is no such file",
    ]


def test_stretches_without_values_are_counted_and_not_filled(tmp_path: Path) -> None:
    file = tmp_path / "holes.csv"
    lines = with_column("tension [N]", [None] * 80 + [""] * 40)
    file.write_text("".join(f"{line}\n" for line in lines))
    result = done("compare", file, "-p", "bench-spiral", "--json")
    assert '"samples": 1' in result.stdout
    assert "NaN samples not compared: tension 40" in result.stdout


def test_an_unknown_profile(good: Path) -> None:
    refused(3, "bench-spirl", "compare", good, "-p", "bench-spirl")
    refused(3, "bench-spiral", "compare", good, "-p", "bench-spirl")


def test_a_profile_with_a_fault(good: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(find("profiles", "bench-spiral").read_text().replace('"60 mm"', '"60 kg"'))
    refused(3, f"{bad}:8: drum.winding_radius: ", "diagnose", good, "-p", bad)
    effect = '\n[[effect]]\nid = "drum-radius"\nradius_error = "1 N"\n'
    bad.write_text(find("profiles", "bench-spiral").read_text() + effect)
    refused(3, "effect drum-radius.radius_error: ", "compare", good, "-p", bad)


def test_an_unknown_effect(good: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    arguments = ("-p", "bench-spiral", "--fit", good, "-o", new)
    refused(2, "did you mean 'motor-coulomb'?", "add", "motor-colomb", *arguments)
    assert not new.exists()


@pytest.mark.parametrize(
    ("effect", "lacks"),
    [
        ("cable-thermal", "a temperature channel in every run"),
        ("guide-offset", "a [guide] in the profile"),
    ],
)
def test_an_effect_that_cannot_be_seen(effect: str, lacks: str, good: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    said = f"effect '{effect}' cannot be seen in these runs: without {lacks}"
    refused(2, said, "add", effect, "-p", "bench-spiral", "--fit", good, "-o", new)
    assert not new.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("compare", "-p", "bench-spiral"), "RUN..."),
        (("compare", "RUN"), "--profile"),
        (("compare", "RUN", "-p", "bench-spiral", "--band", "wide"), "'wide' is not a valid float"),
        (("add", "motor-coulomb", "-p", "bench-spiral", "-o", "new.toml"), "--fit"),
        (("add", "motor-coulomb", "-p", "bench-spiral", "--fit", "RUN"), "--output"),
        (("diagnose", "RUN", "-p", "bench-spiral", "--bend", "2"), "--band"),
    ],
    ids=["no run", "no profile", "no number", "no fit", "no output", "no such option"],
)
def test_usage(arguments: tuple[str, ...], said: str, good: Path) -> None:
    refused(2, said, *(good if word == "RUN" else word for word in arguments))


@pytest.mark.parametrize("band", ["0", "-5", "nan"])
def test_a_band_that_filters_nothing_or_all(band: str, good: Path) -> None:
    refused(2, "band", "compare", good, "-p", "bench-spiral", "--band", band)


@pytest.mark.slow
def test_a_process_ends_with_the_code_and_no_traceback(tmp_path: Path) -> None:
    file = tmp_path / "bin.csv"
    file.write_bytes(bytes(range(256)))
    start = "from winchkit.cli import main; main()"
    command = [sys.executable, "-c", start, "compare", str(file), "-p", "bench-spiral"]
    result = own_process(*command, code=None)
    assert (result.returncode, result.stdout) == (3, "")
    assert result.stderr.startswith(f"{file}: ")
    assert "Traceback" not in result.stderr
