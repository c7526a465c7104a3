"""Stamps in two columns, as ROS, C and EPICS write them, and counts from other epochs than 1970."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.formats.split_stamps import joined_stamps
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.importing.table import ColumnTable, FileColumn, named_apart
from winchkit.runs.importing.units.spelling import split_unit

START = 1_700_000_000
RESOLUTION = 2.4e-7
"""Of a number of 64 bits at seconds of 2026, s."""
STEPS = np.arange(400) * 7_300_000 + 912_345_678
"""ns after START: 2.92 s with a step of 7.3 ms."""
SECONDS, NANOSECONDS = START + STEPS // 10**9, STEPS % 10**9
TRUE = 7.3e-3 * np.arange(400)


def table(columns: dict[str, np.ndarray]) -> ColumnTable:
    parts = [(*split_unit(name), values) for name, values in columns.items()]
    return ColumnTable(
        "log.csv",
        "text",
        named_apart([FileColumn(name, np.asarray(x, float), unit) for name, unit, x in parts]),
    )


@pytest.mark.parametrize(
    ("whole", "part", "units_per_second"),
    [
        ("header.stamp.sec", "header.stamp.nanosec", 10**9),
        ("header.stamp.secs", "header.stamp.nsecs", 10**9),
        ("/joint_states/header/stamp/sec", "/joint_states/header/stamp/nanosec", 10**9),
        ("secs", "nsecs", 10**9),
        ("secondsPastEpoch", "nanoseconds", 10**9),
        ("stamp_sec", "stamp_nanosec", 10**9),
        ("Time [s]", "Time [ns]", 10**9),
        ("tv_sec", "tv_usec", 10**6),
        ("tv_sec", "tv_nsec", 10**9),
        ("Seconds", "Milliseconds", 10**3),
        ("Seconds", "Microseconds", 10**6),
    ],
)
def test_both_columns_are_one_clock(whole: str, part: str, units_per_second: int) -> None:
    fraction = NANOSECONDS * units_per_second // 10**9
    found = joined_stamps(table({whole: SECONDS, part: fraction, "tension [N]": TRUE}))
    assert len(found.columns) == 2
    assert found.columns[0].unit == "s"
    truth = START + 0.912345678 + TRUE
    assert np.abs(found.columns[0].values - truth).max() < 1 / units_per_second + RESOLUTION
    assert len(found.notes) == 1


@given(st.lists(st.integers(0, 2**31 * 10**9 - 1), min_size=1, max_size=50, unique=True))
def test_every_moment_is_kept_within_the_resolution_of_the_numbers(moments: list[int]) -> None:
    times = sorted(moments)
    split = {"sec": [t // 10**9 for t in times], "nanosec": [t % 10**9 for t in times]}
    joined = joined_stamps(table({k: np.array(v) for k, v in split.items()})).columns[0].values
    errors = [abs(float(x) - t / 10**9) for x, t in zip(joined, times, strict=True)]
    assert max(errors) <= 5e-7
    assert np.all(np.diff(joined) >= 0)


@pytest.mark.parametrize(
    "columns",
    [
        {"time [s]": TRUE, "time [ns]": NANOSECONDS},
        {"t_s": SECONDS, "t_ms": SECONDS * 1000},
        {"a.sec": SECONDS, "b.nanosec": NANOSECONDS},
        {"motor.sec": SECONDS, "nanosec": NANOSECONDS},
        {"position [m]": TRUE, "loss": TRUE},
    ],
    ids=["seconds-with-a-fraction", "two-clocks", "two-devices", "two-levels", "no-times"],
)
def test_other_columns_stay_as_they_are(columns: dict[str, np.ndarray]) -> None:
    given = table(columns)
    assert joined_stamps(given) is given


def test_a_topic_of_ros_is_imported_with_its_own_stamps(tmp_path: Path) -> None:
    """The stamps of the header, to the nanosecond, and not its whole seconds."""
    path = tmp_path / "joint_states.csv"
    head = "header.stamp.sec,header.stamp.nanosec,header.frame_id,name[0],position[0],effort[0]\n"
    rows = zip(SECONDS, NANOSECONDS, TRUE, strict=True)
    path.write_text(head + "".join(f"{s},{n},,drum,{x:.9g},{2 * x:.9g}\n" for s, n, x in rows))
    guess = guess_columns(read_table(path))
    assert guess.questions == ()
    run = run_of(streams_of(guess), {})
    assert np.abs(run.time - TRUE).max() < 2 * RESOLUTION
    assert np.allclose(run["motor_torque"], 2 * run["motor_angle"])


def test_messages_of_ros_as_lines_of_json_have_the_stamps_of_their_header(tmp_path: Path) -> None:
    path = tmp_path / "joint_states.jsonl"
    path.write_text(
        "".join(
            json.dumps(
                {
                    "header": {"stamp": {"sec": int(s), "nanosec": int(n)}, "frame_id": ""},
                    "name": ["drum"],
                    "position": [float(x)],
                    "effort": [float(2 * x)],
                }
            )
            + "\n"
            for s, n, x in zip(SECONDS, NANOSECONDS, TRUE, strict=True)
        )
    )
    run = run_of(streams_of(guess_columns(read_table(path))), {})
    assert np.abs(run.time - TRUE).max() < 2 * RESOLUTION
    assert np.allclose(run["motor_angle"], TRUE)


def archive(name: str, unit: str, values: np.ndarray) -> dict[str, object]:
    """A process variable as the archiver of EPICS answers (its getData.json)."""
    rows = zip(SECONDS, NANOSECONDS, values, strict=True)
    return {
        "meta": {"name": name, "PREC": "3", "EGU": unit},
        "data": [
            {"secs": int(s), "val": float(x), "nanos": int(n), "severity": 0, "status": 0}
            for s, n, x in rows
        ],
    }


def test_an_archive_of_epics_has_a_channel_for_each_process_variable(tmp_path: Path) -> None:
    path = tmp_path / "archive.json"
    angle = archive("WINCH1:MotorPos", "deg", np.degrees(TRUE))
    torque = archive("WINCH1:MotorTorque", "Nm", 2 * TRUE)
    path.write_text(json.dumps([angle, torque]))
    guess = guess_columns(read_table(path))
    assert guess.questions == ()
    run = run_of(streams_of(guess), {})
    assert np.abs(run.time - TRUE).max() < 2 * RESOLUTION
    assert np.allclose(run["motor_angle"], TRUE)
    assert np.allclose(run["motor_torque"], 2 * TRUE, atol=1e-9)


def test_one_process_variable_keeps_its_name_and_unit(tmp_path: Path) -> None:
    """An archive answers for one variable in a file of its own."""
    path = tmp_path / "torque.json"
    path.write_text(json.dumps([archive("WINCH1:MotorTorque", "Nm", TRUE)]))
    found = {item.name: item.unit for item in read_table(path).columns}
    assert found == {"time": "s", "WINCH1:MotorTorque": "Nm"}


def test_rows_beside_the_names_of_their_cells_are_a_table(tmp_path: Path) -> None:
    """Of InfluxDB; pandas writes ``split`` so as well."""
    path = tmp_path / "query.json"
    names = ["time", "motor_angle", "tension"]
    rows = [
        [int(START * 10**9 + t), float(x), None if n % 4 else 5.0]
        for n, (t, x) in enumerate(zip(STEPS, TRUE, strict=True))
    ]
    series = [{"name": "winch", "columns": names, "values": rows}]
    path.write_text(json.dumps({"results": [{"statement_id": 0, "series": series}]}))
    columns = read_table(path).columns
    assert [item.name for item in columns] == names
    assert columns[1].values.tolist() == TRUE.tolist()
    assert np.count_nonzero(np.isfinite(columns[2].values)) == 100


@pytest.mark.parametrize(("title", "digits"), [("Millisekunden", 3), ("ms", 3), ("usec", 6)])
def test_a_fraction_beside_times_of_day(tmp_path: Path, title: str, digits: int) -> None:
    """A controller's log: 594 of 600 stamps repeated the one before, and the file was refused."""
    path = tmp_path / "log.csv"
    lines = [f"Datum;Uhrzeit;{title};Istposition [deg]"]
    for k in range(400):
        whole, part = divmod(50_912_000 + 7_000 * k, 10**6)
        cells = (f"04.03.2025;11:59:{whole:02d}", part // 10 ** (6 - digits), f"{k / 9:.3f}")
        lines.append(";".join(map(str, cells)))
    path.write_text("\n".join(lines) + "\n")
    table = guess_columns(read_table(path))
    run = run_of(streams_of(table), {})
    assert np.allclose(np.diff(run.time), 7e-3, atol=1e-6)


@pytest.mark.parametrize(
    ("zero", "unit", "digits", "name"),
    [
        ("1601-01-01", 1e-7, 0, "100ns since 1601 (FILETIME of Windows)"),
        ("0001-01-01", 1e-7, 0, "100ns since the year 1 (ticks of .NET)"),
        ("1904-01-01", 1.0, 6, "s since 1904 (LabVIEW)"),
        ("0000-01-01", 86_400.0, 11, "d since the year 0 (datenum)"),
    ],
)
def test_numbers_of_other_epochs_are_an_assumption(
    tmp_path: Path, zero: str, unit: float, digits: int, name: str
) -> None:
    """Against numpy's calendar; datenum is 1 at the start of the year 0."""
    at, time = np.datetime64("2026-09-21T14:13:20"), np.arange(300) * 0.01
    since = (at - np.datetime64(zero)) / np.timedelta64(1, "s") + (unit == 86_400.0) * unit
    rows = [f"{(since + t) / unit:.{digits}f},{np.sin(t):.5f}" for t in time]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,angle [rad]", *rows]) + "\n")
    found = guess_columns(read_table(path))
    (clock,) = (item for item in found.used if item.channel == "time")
    assert (clock.confidence, clock.reason) == ("assumed", f"{name} by its numbers")
    streams = streams_of(found)
    assert streams.is_absolute
    unix = (at - np.datetime64("1970-01-01")) / np.timedelta64(1, "s")
    assert streams.origin == pytest.approx(unix, abs=1e-3)
    assert streams.streams[0].time == pytest.approx(time, abs=2e-5)
