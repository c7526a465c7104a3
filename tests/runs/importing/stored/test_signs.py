"""Signs that the user gives: every combination, with and without units, in every format."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from mcap.writer import Writer
from scipy.io import savemat

from winchkit.arrays import Array
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")

NAMES = {"q": "motor_angle", "dq": "motor_velocity", "tau": "motor_torque"}
UNITS = {"q": "deg", "dq": "rpm", "tau": "mN m"}
SI = {"q": np.pi / 180, "dq": np.pi / 30, "tau": 1e-3}


def truth() -> dict[str, Array]:
    time = np.arange(400) / 100 + 0.003
    speed = 2 * np.pi * 0.4
    angle = 5 * np.sin(speed * time)
    return {
        "time": time,
        "q": angle,
        "dq": 5 * speed * np.cos(speed * time),
        "tau": 0.4 * np.tanh(np.gradient(angle, time)) + 0.02 * angle,
    }


def _text(delimiter: str, decimal: str) -> Callable[[Path, Mapping[str, Array]], None]:
    def write(path: Path, columns: Mapping[str, Array]) -> None:
        rows = zip(*columns.values(), strict=True)
        lines = [delimiter.join(f"{v:.12g}".replace(".", decimal) for v in row) for row in rows]
        path.write_text("\n".join([delimiter.join(columns), *lines]) + "\n")

    return write


def _json(path: Path, columns: Mapping[str, Array]) -> None:
    path.write_text(json.dumps({name: values.tolist() for name, values in columns.items()}))


def _xlsx(path: Path, columns: Mapping[str, Array]) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for row in (tuple(columns), *zip(*(c.tolist() for c in columns.values()), strict=True)):
        sheet.append(row)
    book.save(path)


def _mcap(path: Path, columns: Mapping[str, Array]) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("state", "jsonschema", b"{}")
        channel = writer.register_channel("/state", "json", schema)
        for row in zip(*columns.values(), strict=True):
            stamp = int(row[0] * 1e9)
            fields = dict(zip(columns, map(float, row), strict=True))
            del fields["time"]
            writer.add_message(channel, stamp, json.dumps(fields).encode(), stamp)
        writer.finish()


WRITERS: dict[str, Callable[[Path, Mapping[str, Array]], None]] = {
    "comma.csv": _text(",", "."),
    "decimal.csv": _text(";", ","),
    "log.json": _json,
    "log.mat": lambda path, columns: savemat(path, dict(columns)),
    "log.npz": lambda path, columns: np.savez(path, **columns),
    "log.xlsx": _xlsx,
    "log.parquet": lambda path, columns: pq.write_table(pa.table(dict(columns)), path),
    "log.mcap": _mcap,
}


def imported(path: Path, given: tuple[str, ...]) -> Run:
    answers = Answers(columns=tuple(map(read_column, given)))
    guess = guess_columns(read_table(path), answers)
    assert not guess.questions, guess.questions
    again = guess_by(read_table(path), mapping_of("m", [("log", guess)]))
    run, repeated = run_of(streams_of(guess), {}), run_of(streams_of(again), {})
    for name in NAMES.values():
        assert np.array_equal(run[name], repeated[name], equal_nan=True)
    return run


@pytest.mark.parametrize("with_unit", [False, True])
@pytest.mark.parametrize("file", WRITERS)
def test_every_combination_of_signs_gives_the_true_channels(
    file: str, with_unit: bool, tmp_path: Path
) -> None:
    """The file has the other sign of the columns that the user gives with a minus."""
    true = truth()
    for signs in product((1.0, -1.0), repeat=len(NAMES)):
        by_name = dict(zip(NAMES, signs, strict=True))
        scale = {n: s / (SI[n] if with_unit else 1.0) for n, s in by_name.items()}
        columns = {"time": true["time"], **{n: scale[n] * true[n] for n in NAMES}}
        WRITERS[file](tmp_path / file, columns)
        given = tuple(
            f"{NAMES[n]}={'-' if s < 0 else ''}{n}" + (f" [{UNITS[n]}]" if with_unit else "")
            for n, s in by_name.items()
            if s < 0 or with_unit
        )
        run = imported(tmp_path / file, given)
        for name, channel in NAMES.items():
            assert run[channel] == pytest.approx(true[name], abs=1e-9), (signs, channel)


def test_the_velocity_follows_the_angle_whose_sign_alone_is_given(tmp_path: Path) -> None:
    true = truth()
    WRITERS["comma.csv"](tmp_path / "a.csv", true)
    run = imported(tmp_path / "a.csv", ("motor_angle=-q",))
    assert run["motor_angle"] == pytest.approx(-true["q"], abs=1e-9)
    assert run["motor_velocity"] == pytest.approx(-true["dq"], abs=1e-9)
    assert run["motor_torque"] == pytest.approx(true["tau"], abs=1e-9)


@pytest.mark.parametrize("sign", ["", "-"])
def test_counts_are_found_from_the_velocity_with_any_sign(sign: str, tmp_path: Path) -> None:
    """The resolution comes from the ratio of the two, the sense from the user."""
    true = truth()
    counts = np.round(true["q"] * 4096 / (2 * np.pi)) * (-1 if sign else 1)
    columns = {"time [s]": true["time"], "position": counts, "speed [rad/s]": true["dq"]}
    WRITERS["comma.csv"](tmp_path / "a.csv", columns)
    guess = guess_columns(
        read_table(tmp_path / "a.csv"), Answers((read_column(f"motor_angle={sign}position"),))
    )
    run = run_of(streams_of(guess), {})
    assert run["motor_angle"] == pytest.approx(true["q"], abs=2 * np.pi / 4096)
    assert run["motor_velocity"] == pytest.approx(true["dq"], abs=1e-9)


def test_a_minus_is_no_factor_of_an_amplifier(tmp_path: Path) -> None:
    """Volts need a factor; their sign alone gives none."""
    true = truth()
    columns = {"time [s]": true["time"], "q [rad]": true["q"], "F [V]": true["tau"]}
    WRITERS["comma.csv"](tmp_path / "a.csv", columns)
    answers = Answers((read_column("tension=-F [V]"),))
    (question,) = guess_columns(read_table(tmp_path / "a.csv"), answers).questions
    assert "how many N is 1?" in question.text
