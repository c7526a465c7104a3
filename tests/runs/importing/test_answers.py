"""Answers that contradict each other, spellings of constants, and mappings with equal logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from winchkit import import_runs
from winchkit.cli import main
from winchkit.errors import RunError, UsageError
from winchkit.runs import read_run
from winchkit.runs.importing.answers import (
    Answers,
    read_answers,
    read_column,
    read_constant,
    with_options,
)
from winchkit.runs.importing.clocks.joint import joined
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.session import guesses_of
from winchkit.runs.importing.streams import Stream, Streams

HEAD = "time [s],Pos [deg],M"
LOG = HEAD + "\n" + "\n".join(f"{k / 100},{k},{k % 7}" for k in range(90)) + "\n"


def command(*arguments: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(main, [*map(str, arguments)])
    return result.exit_code, result.output


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ("motor_torque=M [N m]", "tension=M [N]", "'M' is given as motor_torque and as tension"),
        ("motor_torque=M [N m]", "motor_torque=Pos*2", "motor_torque is given as column 'M' and"),
        ("motor_torque=M [N m]", "motor_torque=M [mN m]", "motor_torque=M is given twice"),
    ],
)
def test_two_answers_on_one_column_are_refused(
    first: str, second: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(LOG)
    code, output = command("import", path, "-c", first, "-c", second, "-o", tmp_path / "r", "-y")
    assert code == 2
    assert told in output


@pytest.mark.parametrize(
    ("text", "value"), [("2,4 Nm", 2.4), ("2.4Nm", 2.4), ("0,125 N m", 0.125), ("2400 mNm", 2.4)]
)
def test_constants_are_read_as_people_write_them(text: str, value: float) -> None:
    assert read_constant("rated_torque", text) == pytest.approx(value)
    assert read_column("motor_torque=u*2,5").factor == 2.5


def test_a_comma_that_may_separate_thousands_is_refused() -> None:
    with pytest.raises(UsageError, match="may separate thousands"):
        read_constant("capacity", "1,000 N")


def test_options_of_a_question_answer_it() -> None:
    found = with_options(
        Answers(), ('--signed "a b" --signed "c"', '--modulo "p=65536"', "--orientation vector")
    )
    expected = Answers(signed=("a b", "c"), modulo=(("p", 65536.0),), orientation="vector")
    assert found == expected
    with pytest.raises(UsageError, match="no option that answers"):
        with_options(Answers(), ("--body x",))


def test_degrees_fahrenheit_have_their_sign(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(LOG.replace(",M", ",Temp [°F]"))
    (item,) = [i for i in guess_columns(read_table(path)).used if i.channel == "temperature"]
    assert item.unit == "°F"
    assert 212 * item.factor + item.offset == pytest.approx(100)


def _mapping(path: Path, *logs: tuple[str, str, str]) -> Path:
    parts = ['schema = 1\nkind = "mapping"\nname = "m"\n']
    for name, source, unit in logs:
        parts.append(
            f'[[log]]\nname = "{name}"\n[[log.column]]\nsource = "time"\nchannel = "time"\n'
            f'unit = "s"\n[[log.column]]\nsource = {source}\nchannel = "motor_angle"\n'
            f'unit = "{unit}"\n'
        )
    path.write_text("".join(parts))
    return path


def test_the_number_of_a_column_needs_no_quotes(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(LOG)
    run = read_run(path, mapping=_mapping(tmp_path / "m.toml", ("a", "2", "deg")))
    assert run["motor_angle"][1] == pytest.approx(np.pi / 180)


def test_of_logs_with_equal_columns_the_one_of_the_file_is_used(tmp_path: Path) -> None:
    mapping = _mapping(tmp_path / "m.toml", ("one", '"Pos"', "deg"), ("two", '"Pos"', "rad"))
    for name, factor in (("one", np.pi / 180), ("two", 1.0)):
        path = tmp_path / f"{name}.csv"
        path.write_text(LOG.replace("[deg]", ""))
        assert read_run(path, mapping=mapping)["motor_angle"][1] == pytest.approx(factor)
    path = tmp_path / "three.csv"
    path.write_text(LOG.replace("[deg]", ""))
    with pytest.raises(RunError, match="fits the logs 'one' and 'two'"):
        read_run(path, mapping=mapping)


def test_a_lag_that_the_signals_contradict_is_reported_or_refused() -> None:
    """The clock of the second file is 20 s ahead; the motion does not repeat."""
    time = np.arange(3000) / 100
    angle = np.cumsum(np.random.default_rng(3).normal(size=3000)) / 10
    rows = np.arange(3000)

    def part(name: str, channel: str, start: float) -> Streams:
        stream = Stream(time, {channel: angle}, rows)
        return Streams(name, (stream,), start, False, True, lambda _row: None)

    first, second = part("a", "motor_angle", 0.0), part("b", "cable_length", 20.0)
    _, (right,) = joined((first, second), -20.0)
    assert "beside it" not in right.text
    _, (near,) = joined((first, second), -18.0)
    assert "2800 of 3000 rows are in both files" in near.text
    assert "follow each other -2 s beside it" in near.text
    with pytest.raises(RunError, match="the lag cannot be right"):
        joined((first, second), 0.0)
    moved = replace(second, origin=0.0)
    assert joined((first, moved), 0.0)[1][0].text == "joined with a lag of 0 s"


def test_a_trace_of_frames_is_reported_by_every_command(tmp_path: Path) -> None:
    path = tmp_path / "bus.log"
    path.write_text("".join(f"(1.{k:06d}) can0 181#{k:04X}00FF\n" for k in range(20)))
    for words in (("check",), ("log", "info"), ("import",)):
        _, output = command(*words, path)
        assert "is a trace of CAN frames" in output


@pytest.mark.parametrize("column", ["motor_torque=q", "motor_torque=load cell", "tension=tau"])
def test_a_unit_of_the_file_that_is_none_of_the_channel_is_a_question(
    tmp_path: Path, column: str
) -> None:
    file = tmp_path / "a.csv"
    rows = "".join(f"{k / 100},{k / 50},{k % 7},{k % 5}\n" for k in range(200))
    file.write_text(f"time [s],q [rad],tau [Nm],load cell [N]\n{rows}", encoding="utf-8")
    with pytest.raises(UsageError, match=r"a unit of \w+, and \w+ is a"):
        import_runs(file, columns=[column])
    (run,) = import_runs(file, columns=["motor_angle=q", "motor_torque=load cell*0.1"])
    assert run["motor_torque"].max() == pytest.approx(0.4)
    (run,) = import_runs(file, columns=["motor_angle=q", "motor_torque=tau*q [N m]"])
    assert run["motor_torque"] == pytest.approx((np.arange(200) % 7) * np.arange(200) / 50)


def test_a_factor_may_stand_before_its_column() -> None:
    first, last = "motor_torque=-0.12*Iq [N m]", "motor_torque=-Iq*0.12 [N m]"
    assert read_column(first) == read_column(last)


def test_a_constant_that_no_column_needs_is_said(tmp_path: Path) -> None:
    notes = []
    for unit in ("N m", "%"):
        path = tmp_path / "a.csv"
        path.write_text(LOG.replace(",M", f",torque [{unit}]"))
        (guess,) = guesses_of([read_table(path)], read_answers({"rated_torque": "2.4 N m"}))
        notes.append(" ".join(guess.notes))
    assert notes[0] == (
        "--rated-torque is not used: no column is in a share of the rated torque; --column "
        '"motor_torque=COLUMN [%]" where one is'
    )
    assert "is not used" not in notes[1]
