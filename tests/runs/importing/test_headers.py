"""Rows above the numbers: the unit of a time below its name, titles of rows above the times."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from winchkit.runs.importing.assignment import Assignment
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns

COUNT, STEP = 200, 0.667
"""Rows, and their interval in ms."""


def used(path: Path, text: str) -> dict[str, Assignment]:
    path.write_text(text)
    return {item.channel: item for item in guess_columns(read_table(path)).used}


def rows(*columns: object) -> str:
    """Times in ms and the sine of an angle in the further columns."""
    lines = []
    for k in range(COUNT):
        angle = 100 * math.sin(k / 20)
        lines.append(",".join([f"{k * STEP:.6g}", *(f"{angle:.5g}" for _ in columns)]))
    return "\n".join(lines) + "\n"


def test_the_unit_of_the_time_may_stand_in_the_row_of_the_names(tmp_path: Path) -> None:
    """A drive's monitor: numbers of its inputs above, what they record below."""
    head = (
        "Axis1\nNumber of sampling data,200\nSampling time interval(ms),0.667\n"
        "Time,Analog 1,Analog 2,Digital 1\nms,Position feedback (deg),Droop pulses,INP\n"
    )
    found = used(tmp_path / "monitor.csv", head + rows(1, 2, 3))
    assert (found["time"].unit, found["time"].factor) == ("ms", 1e-3)
    assert found["motor_angle"].source.startswith("Position feedback")


@pytest.mark.parametrize("quoted", [True, False])
def test_titles_of_the_rows_of_a_header_may_stand_above_the_times(
    quoted: bool, tmp_path: Path
) -> None:
    """LabVIEW SignalExpress: every channel has its own times, below the same title."""
    names = ['"Motor angle"', '"Force"'] if quoted else ["Motor angle", "Force"]
    head = (
        "Timestamp,2026-03-16 17:04:51,Timestamp,2026-03-16 17:04:51\n"
        "Interval,0.000667,Interval,0.000667\n"
        f"Channel name,{names[0]},Channel name,{names[1]}\nUnit,deg,Unit,N\n"
    )
    lines = [
        f"{k * STEP / 1e3:.9g},{100 * math.sin(k / 20):.5g},{k * STEP / 1e3:.9g},{k % 7}"
        for k in range(COUNT)
    ]
    found = used(tmp_path / "daq.csv", head + "\n".join(lines) + "\n")
    assert (found["time"].unit, found["time"].confidence) == ("s", "named")
    assert found["motor_angle"].factor == pytest.approx(math.pi / 180)
    assert found["tension"].factor == 1.0


@pytest.mark.parametrize(
    "head",
    [
        "time,q_m,omega_m,tau_m\n",
        "time,q_m,omega_m,tau_m\ns,rad,rad/s,Nm\n",
        "time [s],theta_m [rad],dq_s [rad/s],tau_m [Nm]\n",
    ],
)
def test_a_length_or_a_time_behind_another_quantity_is_an_index(head: str, tmp_path: Path) -> None:
    """``tau_m`` is the torque of a motor: it was the cable length in metres."""
    found = used(tmp_path / "joint.csv", head + rows(1, 2, 3))
    assert set(found) == {"time", "motor_angle", "motor_velocity", "motor_torque"}
    assert found["motor_torque"].source == "tau_m"
    assert found["motor_torque"].factor == 1


def test_an_index_behind_an_unknown_name_is_no_evidence_of_a_length(tmp_path: Path) -> None:
    found = used(tmp_path / "joint.csv", "time_s,q_rad,i_m\n" + rows(1, 2))
    assert set(found) == {"time", "motor_angle"}
    lengths = used(tmp_path / "axis.csv", "time_s,pos_m,force_N\n" + rows(1, 2))
    assert lengths["position"].factor == 1


def test_titles_of_rows_are_read_where_a_column_is_empty(tmp_path: Path) -> None:
    """ControlDesk: the path, the name and the unit of each channel, and a title of the numbers."""
    head = (
        '"descriptor","Capture"\n\npath,,"Model Root/q","Model Root/tau"\n'
        "trace_name,time,q,tau_m\nunit,ms,deg,Nm\ntrace_values,,,\n"
    )
    text = "".join(f",{line}\n" for line in rows(1, 2).splitlines())
    found = used(tmp_path / "capture.csv", head + text)
    assert {item.source: item.unit for item in found.values()} == {
        "time": "ms",
        "q": "deg",
        "tau_m": "N m",
    }


def test_rows_of_a_header_beside_an_empty_column_are_no_numbers(tmp_path: Path) -> None:
    """An oscilloscope's: counts and sizes stand in the rows above the numbers."""
    head = (
        "Model,DLM\nTraceName,Speed,Torque\nVUnit,rpm,Nm\nHResolution,1.0e-2\nHUnit,s,s\n"
        "DisplayPointNo.,200,200\n"
    )
    text = "".join(f",{20 + k % 9},{k % 7}\n" for k in range(COUNT))
    path = tmp_path / "scope.csv"
    path.write_text(head + text)
    table = read_table(path)
    assert table.interval == 0.01
    assert {len(column) for column in table.columns} == {COUNT}
    assert {"Speed": "rpm", "Torque": "Nm"}.items() <= {
        c.name: c.unit for c in table.columns
    }.items()


def test_remarks_may_stand_between_names_and_numbers(tmp_path: Path) -> None:
    head = "Recorder\nTime [ms],Angle [deg],Torque [Nm]\nT0 = 11.05.2023 10:11:12\n\n"
    found = used(tmp_path / "recorder.csv", head + rows(1, 2))
    assert (found["time"].unit, found["motor_torque"].unit) == ("ms", "N m")


def test_the_unit_of_a_row_counts_before_that_of_a_name(tmp_path: Path) -> None:
    found = used(tmp_path / "axis.csv", "t_s,pos_m,F_N\nms,mm,N\n" + rows(1, 2))
    assert (found["time"].factor, found["position"].factor) == (1e-3, 1e-3)


OF_OTHERS = {
    # Dynamometers of a planetary gearbox, of motors, and of a joint.
    "# Test started\n# limit = 25.0 A\ntime [s],velocity setpoint [Hz],velocity measured [Hz],"
    "motor torque measured [Nm],load cell weight [g],brake torque [Nm]\n": {
        "motor_velocity": "velocity measured",
        "motor_torque": "motor torque measured",
        "tension": "load cell weight",
    },
    "2026-05-11 15:22:21.215\nInput time, Input voltage, Output Torque, Output Speed, Output Speed "
    "set-point\nms, V, N.mm, rad.s, rad.s\n": {
        "motor_torque": "Output Torque",
        "motor_velocity": "Output Speed",
    },
    "Elapsed Time(ms),R_knee_fault,R_knee_enc,R_knee_T_des\n": {"motor_angle": "R_knee_enc"},
    # A winch of a glider, a machine for tension tests, and two oscilloscopes.
    "Time_ms;dt_ms;CurrentEncoderReading;AngularIncrement_deg;RopeVelocity_kmh;RopeLength_m;"
    "DesiredVelocity_kmh\n": {
        "motor_angle": "CurrentEncoderReading",
        "cable_length": "RopeLength",
    },
    "Results Table 1\n\n\nTime,Displacement,Force\n(ms),(mm),(kN)\n": {
        "position": "Displacement",
        "force": "Force",
    },
    "in s,C2 in V\n": {},
}
"""Heads as other labs have them, and the right columns; none is taken for another channel."""


@pytest.mark.parametrize("head", OF_OTHERS)
def test_columns_of_other_labs(head: str, tmp_path: Path) -> None:
    names = head.splitlines()[-2 if head.endswith(("(kN)\n", "rad.s\n")) else -1]
    delimiter = ";" if ";" in names else ","
    table = rows(*names.split(delimiter)[1:]).replace(",", delimiter)
    found = used(tmp_path / "log.csv", head + table)
    assert {c: i.source for c, i in found.items() if c != "time"} == OF_OTHERS[head]


@pytest.mark.parametrize("names", [("", "", ""), ("time ", "angle ", "torque ")])
def test_a_line_per_signal_is_a_column_per_signal(tmp_path: Path, names: tuple[str, ...]) -> None:
    """As numpy.savetxt writes an array of signals; its lines are named or not."""
    time = [k * 0.01 for k in range(COUNT)]
    signals = time, [math.sin(t) for t in time], [math.cos(t) for t in time]
    lines = [
        name + " ".join(f"{value:.9e}" for value in signal)
        for name, signal in zip(names, signals, strict=True)
    ]
    path = tmp_path / "signals.txt"
    path.write_text("\n".join(lines) + "\n")
    table = read_table(path)
    assert table.layout == "text, blanks, a line per signal"
    assert [column.source for column in table.columns] == [
        name.strip() or str(number) for number, name in enumerate(names, start=1)
    ]
    for column, signal in zip(table.columns, signals, strict=True):
        assert column.values == pytest.approx(signal, abs=1e-9)


def test_of_many_columns_a_question_lists_the_first(tmp_path: Path) -> None:
    path = tmp_path / "wide.csv"
    head = ",".join(f"signal_{k}" for k in range(500))
    path.write_text("\n".join([head, *(",".join([str(k)] * 500) for k in range(20))]) + "\n")
    (question,) = [
        one for one in guess_columns(read_table(path)).questions if "no column is a ch" in one.text
    ]
    assert question.text.endswith("'signal_29' and 470 more")


def test_a_column_in_the_unit_of_its_channel_is_taken_before_one_in_volts(tmp_path: Path) -> None:
    """A test stand that writes the voltage of every sensor beside its quantity."""
    head = "Time (ms),Force (V),Force (N),Displacement (V),Displacement (mm)\n"
    found = used(tmp_path / "stand.csv", head + rows(1, 2, 3, 4))
    assert {channel: found[channel].unit for channel in ("force", "position")} == {
        "force": "N",
        "position": "mm",
    }
