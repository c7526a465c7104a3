"""Tables in which each row is one value of one channel, in the layouts of common programs."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.names import meaning_of
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of

UNITS = {"motor_angle": "rad", "motor_torque": "Nm", "tension": "N"}
BEGIN = datetime(2024, 5, 1, 12, tzinfo=UTC)
Rows = list[tuple[float, str, float]]


def value(name: str, time: Array | float) -> Array:
    scale, level = {"motor_angle": (9, 0), "motor_torque": (0.3, 1), "tension": (5, 200)}[name]
    return level + scale * np.sin(1.1 * np.asarray(time))


def rows() -> Rows:
    """Angle and torque at 100 Hz, tension at 40 Hz with other moments, in the order of time."""
    quick, slow = np.arange(0.0, 20.0, 0.01), np.arange(0.003, 20.0, 0.025)
    clocks = {"motor_angle": quick, "motor_torque": quick, "tension": slow}
    return sorted((float(t), name, float(value(name, t))) for name in UNITS for t in clocks[name])


def stamp(time: float) -> str:
    return (BEGIN + timedelta(seconds=time)).isoformat(timespec="microseconds")


def monitor(of: Rows) -> str:
    """As EPICS camonitor prints: no names, process variables of a device."""
    return "".join(
        f"BENCH:W1:{name:24} {stamp(t)[:10]} {stamp(t)[11:26]} {x:.7g}\n" for t, name, x in of
    )


def database(of: Rows) -> str:
    """As InfluxDB exports: annotations, the limits of the query, a table for each channel."""
    text = "#group,false,false,true,true,false,false,true,true\n"
    text += "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,"
    text += "string,string\n#default,_result,,,,,,,\n"
    text += ",result,table,_start,_stop,_time,_value,_field,_measurement\n"
    for number, own in enumerate(UNITS):
        text += "".join(
            f",,{number},{stamp(0)},{stamp(60)},{stamp(t)},{x:.7g},{name},winch\n"
            for t, name, x in of
            if name == own
        )
    return text


def tidy(of: Rows) -> str:
    """A column of units: as many texts as numbers in a row."""
    rows = (f"{t:.4f},{name},{x:.7g},{UNITS[name]}\n" for t, name, x in of)
    return "time [s],signal,value,unit\n" + "".join(rows)


def lines(of: Rows) -> str:
    """A record for each line."""
    return "".join(json.dumps({"t": t, "name": name, "value": x}) + "\n" for t, name, x in of)


@pytest.mark.parametrize("layout", [monitor, database, tidy, lines])
def test_channels_are_separated_with_their_own_stamps(
    tmp_path: Path, layout: Callable[[Rows], str]
) -> None:
    path = tmp_path / "log.txt"
    path.write_text(layout(rows()))
    table = read_table(path)
    units = {"motor_torque": "N m"}
    answers = [read_column(f"{name}={name} [{units.get(name, UNITS[name])}]") for name in UNITS]
    guess = guess_columns(table, Answers(columns=tuple(answers)))
    assert guess.questions == ()
    run = run_of(streams_of(guess), {})
    # The slowest channel determines the rows; the others are interpolated at its moments.
    assert len(run) == 800
    for name in UNITS:
        close = np.abs(run[name] - value(name, run.time + 0.003))
        assert close.max() < (1e-4 if name != "motor_angle" else 1e-3)
    again = run_of(streams_of(guess_by(table, mapping_of("m", [("log", guess)]))), {})
    assert np.array_equal(again["tension"], run["tension"])


def test_units_of_a_column_and_of_the_names_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "tidy.csv"
    path.write_text(tidy(rows()))
    assert {c.name: c.unit for c in read_table(path).columns if c.name in UNITS} == UNITS
    path.write_text(tidy(rows()).replace("tension,", "tension [kN],"))
    assert {c.name: c.unit for c in read_table(path).columns}["tension"] == "kN"


def test_rows_with_an_alarm_behind_the_value_are_read(tmp_path: Path) -> None:
    """Every fifth row, then most rows: the alarm is no reason to lose a value."""
    found = []
    for share in (0.2, 0.8):
        lines = monitor(rows()).splitlines()
        texts = [f"{x} LOLO MAJOR" if n % 10 < 10 * share else x for n, x in enumerate(lines)]
        path = tmp_path / f"alarms-{share}.txt"
        path.write_text("\n".join(texts) + "\n")
        table = read_table(path)
        assert table.faults == ()
        found.append({c.name: c.values.tolist() for c in table.columns if c.name in UNITS})
    path.write_text(monitor(rows()))
    assert found[0] == found[1]
    assert found[0] == {
        c.name: c.values.tolist() for c in read_table(path).columns if c.name in UNITS
    }


@pytest.mark.parametrize(
    ("name", "channel"),
    [("TARGET_DU:Rotation-PosAct", "motor_angle"), ("W1:TORQUE:ACT", "motor_torque")],
)
def test_the_device_of_a_process_variable_is_no_quantity(name: str, channel: str) -> None:
    found = meaning_of(name)
    assert found is not None
    assert found.channel == channel


def test_a_quality_beside_the_values_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "quality.csv"
    head = "timestamp,tag,value,quality\n"
    lines = [f"{t:.3f},{name},{x:.6g},{192 + n % 2}" for n, (t, name, x) in enumerate(rows())]
    path.write_text(head + "\n".join(lines) + "\n")
    assert {c.name for c in read_table(path).columns} == {"timestamp", *UNITS}


def test_two_winches_keep_their_names(tmp_path: Path) -> None:
    path = tmp_path / "two.txt"
    text = monitor(rows())
    path.write_text(text + text.replace(":W1:", ":W2:"))
    table = read_table(path)
    given = tuple(read_column(f"1.{name}=W1:{name} [{UNITS[name]}]") for name in ("tension",))
    found = {item.channel for item in guess_columns(table, Answers(columns=given)).assignments}
    assert {"1.tension", "2.tension", "1.motor_angle", "2.motor_torque"} <= found


@pytest.mark.parametrize(
    "head", ["time [s],axis,position [rad]", "time [s],state,tension [N]", "time,valve,value"]
)
def test_other_tables_with_a_column_of_text_stay(tmp_path: Path, head: str) -> None:
    """Axes with one named quantity; a state beside a signal; an unsteady column beside no clock."""
    names = ("left", "right") if "axis" in head else ("run", "stop")
    time = "{0:.2f}" if "valve" not in head else "{2:.3f}"
    path = tmp_path / "a.csv"
    rows = [
        (time + ",{1},{2:.3f}").format(0.01 * n, names[n // (1 if "axis" in head else 50) % 2], x)
        for n, x in enumerate(np.sin(np.arange(200) * 0.1))
    ]
    path.write_text("\n".join([head, *rows]) + "\n")
    assert [c.name for c in read_table(path).columns] == [h.split(" ")[0] for h in head.split(",")]
