"""Units in unusual places: in every cell, in nested brackets; and angles in rad or degrees."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from winchkit.errors import RunError
from winchkit.runs.importing.assignment import Assignment, Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.importing.units.spelling import split_unit

COUNT, STEP = 200, 0.01
TIME = np.arange(COUNT) * STEP


def guessed(path: Path, head: str, *columns: list[str], mark: str = ",") -> Guess:
    rows = (mark.join(cells) for cells in zip(*columns, strict=True))
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return guess_columns(read_table(path))


def used(guess: Guess) -> dict[str, Assignment]:
    return {item.channel: item for item in guess.used}


def cells(values: np.ndarray, form: str = "{:.6f}") -> list[str]:
    return [form.format(value) for value in values]


@pytest.mark.parametrize(
    ("mark", "decimal", "gap"), [(",", ".", " "), (";", ",", ""), ("\t", ".", "")]
)
def test_cells_with_units_are_numbers(mark: str, decimal: str, gap: str, tmp_path: Path) -> None:
    angle, force = 90 * np.sin(3 * TIME), 50 + 5 * np.cos(3 * TIME)
    columns = [cells(TIME, "{:.2f} s"), cells(angle, f"{{:.6f}}{gap}deg"), cells(force, "{:.6f} N")]
    written = [[cell.replace(".", decimal) for cell in column] for column in columns]
    head = mark.join(("time", "position", "force"))
    guess = guessed(tmp_path / "log.csv", head, *written, mark=mark)
    assert not guess.questions
    found = used(guess)
    assert (found["motor_angle"].unit, found["tension"].unit) == ("deg", "N")
    (stream,) = streams_of(guess).streams
    assert stream.channels["motor_angle"] == pytest.approx(np.radians(angle), abs=1e-7)
    assert stream.channels["tension"] == pytest.approx(force, abs=1e-6)
    assert stream.time - stream.time[0] == pytest.approx(TIME)


def test_units_of_a_column_may_differ_in_their_prefix(tmp_path: Path) -> None:
    """A gauge that shows mN below 1 N and N above."""
    force = 1.0 + 0.9 * np.sin(5 * TIME)
    shown = [f"{f:.6f} N" if f >= 1 else f"{1e3 * f:.3f} mN" for f in force]
    guess = guessed(tmp_path / "log.csv", "time [s],force", cells(TIME), shown)
    (stream,) = streams_of(guess).streams
    assert stream.channels["tension"] == pytest.approx(force, abs=1e-6)


def test_a_cell_without_its_unit_is_a_fault_with_its_line(tmp_path: Path) -> None:
    force = cells(50 + TIME, "{:.4f} N")
    force[50] = "overload"
    guess = guessed(tmp_path / "log.csv", "time [s],force", cells(TIME), force)
    (fault,) = streams_of(guess).faults
    assert fault.line == 52
    assert "overload" in fault.message


@pytest.mark.parametrize("labels", [("1A", "2A", "3A"), ("3C", "1F", "2A", "5B"), ("up", "down")])
def test_labels_are_no_quantities(labels: tuple[str, ...], tmp_path: Path) -> None:
    names = [labels[k // 60 % len(labels)] for k in range(COUNT)]
    columns = (cells(TIME), names, cells(np.sin(TIME)))
    guess = guessed(tmp_path / "log.csv", "time [s],phase,angle [rad]", *columns)
    assert set(used(guess)) == {"time", "motor_angle"}


def test_names_with_numbers_and_units_are_a_header(tmp_path: Path) -> None:
    """A table by angle: ``0 deg``, ``90 deg`` are names."""
    columns = (cells(TIME), cells(np.sin(TIME)), cells(np.cos(TIME)))
    table_path = tmp_path / "log.csv"
    guessed(table_path, "time [s],0 deg,90 deg", *columns)
    table = read_table(table_path)
    assert len(table.columns[1]) == COUNT
    assert table.columns[1].name == "0"


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("Torque (filtered) [Nm]", "Torque (filtered)", "Nm"),
        ("Torque [Nm] (filtered)", "Torque (filtered)", "Nm"),
        ("pos[0] (rad)", "pos[0]", "rad"),
        ("pos[0]", "pos[0]", ""),
        ("quaternion [1]", "quaternion", ""),
        ("Force (Load Cell 1 (N))", "Force (Load Cell 1)", "N"),
        ("Force (N) (Load Cell 1)", "Force (Load Cell 1)", "N"),
        ("Position [deg (motor)]", "Position", "deg (motor)"),
        ("Current [A] (rms)", "Current (rms)", "A"),
        ("Winch (A) angle", "Winch (A) angle", ""),
        ("Kraft (N", "Kraft (N", ""),
        ("Speed [furlong]", "Speed", "furlong"),
    ],
)
def test_units_in_nested_brackets(text: str, name: str, unit: str) -> None:
    assert split_unit(text) == (name, unit)


ARM = 70 * np.sin(2 * TIME) - 15
"""Degrees of a joint that does not turn."""


@pytest.mark.parametrize("step", [0.01, 1e-6])
def test_degrees_of_a_joint_are_asked(step: float, tmp_path: Path) -> None:
    angles = cells(np.round(ARM / step) * step, "{:.6g}")
    columns = (cells(TIME), angles, angles, cells(np.cos(TIME)))
    guess = guessed(tmp_path / "log.csv", "time [s],q1,q2,tau1", *columns)
    asked = [question for question in guess.questions if "motor_angle" in question.text]
    assert asked
    assert "rad, deg" in asked[0].text
    assert "its values of -67.05 to 55" in asked[0].text
    assert ("steps of 0.01" in asked[0].text) == (step == 0.01)


@pytest.mark.parametrize(("speed", "unit"), [("dq1 [rad/s]", "deg"), ("dq1 [deg/s]", "rad")])
def test_a_velocity_with_a_unit_decides(speed: str, unit: str, tmp_path: Path) -> None:
    angle = np.radians(ARM)
    velocity = np.radians(140 * np.cos(2 * TIME))
    shown = angle if unit == "rad" else np.degrees(angle)
    velocity = np.degrees(velocity) if "deg" in speed else velocity
    columns = (cells(TIME), cells(shown), cells(velocity), cells(np.cos(TIME)))
    guess = guessed(tmp_path / "log.csv", f"time [s],q1,{speed},tau1", *columns)
    assert not guess.questions
    found = next(item for item in guess.used if item.source == "q1")
    assert found.factor == pytest.approx(math.pi / 180 if unit == "deg" else 1.0)


def test_radians_of_a_joint_are_not_asked(tmp_path: Path) -> None:
    columns = (cells(TIME), cells(np.radians(ARM)), cells(np.cos(TIME)))
    guess = guessed(tmp_path / "log.csv", "time [s],q1,tau1", *columns)
    assert not guess.questions
    assert next(item for item in guess.used if item.source == "q1").factor == 1.0


@pytest.mark.parametrize(
    ("name", "factor"),
    [("rpm", 2 * math.pi / 60), ("speed_rpm_left", 2 * math.pi / 60), ("rpm 2", 2 * math.pi / 60)],
)
def test_a_word_of_a_name_may_be_its_unit(name: str, factor: float, tmp_path: Path) -> None:
    columns = (cells(TIME), cells(np.cos(TIME)), cells(np.sin(TIME)))
    guess = guessed(tmp_path / "log.csv", f"time [s],{name},angle [rad]", *columns)
    found = next(item for item in guess.used if item.source == name)
    assert found.channel.endswith("motor_velocity")
    assert found.factor == pytest.approx(factor)


def test_a_word_that_is_also_a_unit_of_another_quantity_is_none(tmp_path: Path) -> None:
    """``min`` and ``count`` are words of names."""
    columns = (cells(TIME), cells(np.cos(TIME)), cells(np.sin(TIME)))
    guess = guessed(tmp_path / "log.csv", "time [s],force min left,torque count x", *columns)
    assert len(guess.questions) == 2


def test_a_quoted_cell_may_have_line_ends(tmp_path: Path) -> None:
    """Names with a line break, as of a spreadsheet, and numbers with one."""
    path = tmp_path / "log.csv"
    rows = (f'{t:.2f},"{math.sin(t):.6f}\n",{math.cos(t):.6f}' for t in TIME)
    head = 'time [s],"Motor angle\n[rad]","Force\n[N]"'
    path.write_text("\n".join([head, *rows]) + "\n")
    table = read_table(path)
    assert [column.name for column in table.columns] == ["time", "Motor angle", "Force"]
    assert table.columns[1].values == pytest.approx(np.sin(TIME), abs=1e-6)
    assert table.line_of(1) == 6


def test_inches_are_no_quoted_cells(tmp_path: Path) -> None:
    rows = (f'{t:.2f},{math.sin(t):.6f},5"' for t in TIME)
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time [s],angle [rad],diameter", *rows]) + "\n")
    table = read_table(path)
    assert len(table.columns[1]) == COUNT
    assert table.columns[1].values == pytest.approx(np.sin(TIME), abs=1e-6)


def test_a_bag_of_ros_1_is_named(tmp_path: Path) -> None:
    path = tmp_path / "log.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + bytes(500))
    with pytest.raises(RunError, match="rostopic echo"):
        read_table(path)
