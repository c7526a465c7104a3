"""Answers for one of several files, columns of columns, single rows out of order, one table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from winchkit import import_runs
from winchkit.arrays import Array
from winchkit.cli import main
from winchkit.errors import RunError, UsageError
from winchkit.runs import read_run
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run

TIME = np.arange(200) / 50 + 0.01
ANGLE = 30 * np.sin(TIME)


def write(path: Path, head: str, *columns: Array) -> Path:
    np.savetxt(path, np.column_stack(columns), "%.6f", ",", header=head, comments="")
    return path


def command(*arguments: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["import", *map(str, arguments)])
    return result.exit_code, result.output


def test_a_column_of_one_of_several_files_without_names(tmp_path: Path) -> None:
    paths = []
    for name, values in (("pos1", ANGLE), ("tau1", 2 + np.cos(TIME))):
        paths.append(tmp_path / f"{name}.t")
        np.savetxt(paths[-1], np.column_stack([TIME, values]), "%.6f")
    given = ("-c", "pos1.t:motor_angle=2 [deg]", "-c", "tau1:motor_torque=2 [N m]")
    code, output = command(*paths, *given, "--lag", "0 s", "-o", tmp_path / "runs", "-y")
    assert code == 0, output
    run = read_run(tmp_path / "runs" / "pos1.csv")
    assert run["motor_angle"] == pytest.approx(np.radians(ANGLE), abs=1e-6)
    assert run["motor_torque"] == pytest.approx(2 + np.cos(TIME), abs=1e-6)
    mapping = tmp_path / "runs" / "mapping.toml"
    again = command(*paths, "--mapping", mapping, "--lag", "0 s", "-o", tmp_path / "again")
    assert again[0] == 0, again[1]
    same = read_run(tmp_path / "again" / "pos1.csv")
    assert np.array_equal(same["motor_torque"], run["motor_torque"])
    code, output = command(*paths, "-c", "pos2.t:motor_angle=2 [deg]")
    assert code == 2
    assert "there is no file 'pos2.t'" in output


@pytest.mark.parametrize("join", [(), ("--join",)])
def test_a_recording_given_twice_is_no_repeat(tmp_path: Path, join: tuple[str, ...]) -> None:
    head = "time [s],angle [deg],torque [N m]"
    one = write(tmp_path / "one.csv", head, TIME, ANGLE, np.cos(TIME))
    copy = write(tmp_path / "copy.csv", head, TIME, ANGLE, np.cos(TIME))
    repeat = write(tmp_path / "repeat.csv", head, TIME, ANGLE + 0.01, np.cos(TIME))
    same = f"has the same numbers as {one}, and is no repeat of it"
    for other, why in ((one, "is named twice"), (copy, same)):
        code, output = command(one, other, "-o", tmp_path / "runs", *join)
        assert code == 3
        assert f"{other}: {why}: give it once" in output
        assert not (tmp_path / "runs").exists()
    code, output = command(one, repeat, "-o", tmp_path / "runs", *join)
    assert code == 0, output


def imported(path: Path, *given: str) -> Run:
    guess = guess_columns(read_table(path), Answers(tuple(map(read_column, given))))
    assert not guess.questions, guess.questions
    return run_of(streams_of(guess), {})


@pytest.mark.parametrize(
    ("expression", "weights", "constant"),
    [
        ("tau_meas-tau_model", (1, -1), 0),
        ("tau_meas - tau_model*2", (1, -2), 0),
        ("-tau_meas+tau_model", (-1, 1), 0),
        ("tau_meas + 0.5*tau_model - 3", (1, 0.5), -3),
        ("2-tau_meas", (-1, 0), 2),
    ],
)
def test_sums_of_columns(
    expression: str, weights: tuple[float, float], constant: float, tmp_path: Path
) -> None:
    meas, model = np.sin(TIME), np.cos(3 * TIME)
    path = write(
        tmp_path / "a.csv", "time [s],q [deg],tau_meas,tau_model", TIME, ANGLE, meas, model
    )
    run = imported(path, f"motor_torque={expression} [mN m]")
    wanted = weights[0] * meas + weights[1] * model + constant
    assert run["motor_torque"] == pytest.approx(1e-3 * wanted, abs=1e-8)


def test_units_of_a_sum_are_converted_and_must_be_of_one_kind(tmp_path: Path) -> None:
    head = "time [s],q [deg],a [N m],b [mN m],c [N]"
    path = write(tmp_path / "a.csv", head, TIME, ANGLE, np.sin(TIME), 100 * np.cos(TIME), TIME)
    run = imported(path, "motor_torque=a-b")
    assert run["motor_torque"] == pytest.approx(np.sin(TIME) - 0.1 * np.cos(TIME), abs=1e-6)
    for expression, told in (
        ("a-c", "a sum of [N m] and [N] has no unit"),
        ("a-d*2", "there is no column 'd' for 'a-d*2.0'"),
    ):
        answers = Answers((read_column(f"motor_torque={expression}"),))
        assert told in guess_columns(read_table(path), answers).questions[0].text


def test_a_name_with_a_minus_is_that_column(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "time [s],q [deg],a-b,a,b", TIME, ANGLE, 7 * TIME, TIME, TIME)
    run = imported(path, "motor_torque=a-b [N m]")
    assert run["motor_torque"] == pytest.approx(7 * TIME, abs=1e-5)


@pytest.mark.parametrize("shift", [-3.5, 2.5])
def test_a_single_row_out_of_order_is_left_out(shift: float, tmp_path: Path) -> None:
    time = TIME.copy()
    time[77] += shift / 50
    path = write(tmp_path / "a.csv", "time [s],q [deg]", time, ANGLE)
    run = imported(path)
    assert len(run) == len(TIME) - 1
    assert run["motor_angle"] == pytest.approx(np.radians(np.delete(ANGLE, 77)), abs=1e-6)
    assert any("1 of 200 rows (line 79)" in note for note in run.notes)


@pytest.mark.parametrize("is_reversed", [False, True])
@pytest.mark.parametrize("count", [2, 3])
def test_a_few_rows_without_a_time_are_left_out(
    count: int, is_reversed: bool, tmp_path: Path
) -> None:
    time = TIME.copy()
    time[[77, 120, 140][:count]] = np.nan
    step = -1 if is_reversed else 1
    path = write(tmp_path / "a.csv", "time [s],q [deg]", time[::step], ANGLE[::step])
    if count > 2:
        with pytest.raises(RunError, match="time is missing here"):
            imported(path)
        return
    run = imported(path)
    assert run["motor_angle"] == pytest.approx(np.radians(np.delete(ANGLE, [77, 120])), abs=1e-6)
    assert any("2 of 200 rows" in note and "have no time" in note for note in run.notes)


@pytest.mark.parametrize("back", [1.5, 3.0, 60.0])
def test_a_clock_that_is_set_back_is_refused(back: float, tmp_path: Path) -> None:
    time = np.where(np.arange(200) < 100, TIME, TIME - back / 50)
    path = write(tmp_path / "a.csv", "time [s],q [deg]", time, ANGLE)
    with pytest.raises(RunError, match=r"goes back|increase"):
        imported(path)


@pytest.mark.parametrize("is_uneven", [False, True])
def test_sixteen_files_of_one_kind_are_one_table(is_uneven: bool, tmp_path: Path) -> None:
    paths = []
    for n in range(16):
        # Every file with a length, a number of wraps, missing numbers and a row of its own.
        size = len(TIME) - n * is_uneven
        time, angle = TIME[:size].copy(), (1 + n * is_uneven) * ANGLE[:size] + n
        time[40 + n] -= 0.07 * is_uneven
        torque = np.where(np.arange(size) < n * is_uneven, np.nan, angle)
        path = tmp_path / f"run{n:02}.csv"
        paths.append(write(path, "time [s],q [deg],tau [N m]", time, np.mod(angle, 360), torque))
    code, output = command(*paths, "-o", tmp_path / "runs", "-y")
    assert code == 0
    assert output.count("motor_angle  ") == 1
    assert len(output.splitlines()) <= 40
    turned = [(path, 5 * ANGLE + n) for n, path in enumerate(paths)]
    _, shown = command(*[write(p, "time [s],q,tau [N m]", TIME, q, TIME) for p, q in turned])
    assert shown.count("? 'q'") == 1


@pytest.mark.parametrize("sign", [1, -1])
def test_a_linear_axis_whose_force_is_in_a_file_of_its_own(sign: int, tmp_path: Path) -> None:
    """A force that is given, here with its sign, leaves the motion of the others as it is."""
    motion = write(tmp_path / "m.csv", "time [s],pos [mm],velocity [m/s]", TIME, ANGLE, TIME)
    force = write(tmp_path / "f.csv", "time [s],Kraft [kN]", TIME, sign * TIME)
    given = ["-c", "force=-Kraft"] if sign < 0 else []
    join = [*given, "--join", "--lag", "0 s", "-o", tmp_path / "runs", "-y"]
    code, _ = command(motion, force, *join)
    assert code == 0
    run = read_run(tmp_path / "runs" / "m.csv")
    assert set(run) == {"position", "velocity", "force"}
    assert run["force"] == pytest.approx(1000 * TIME, abs=1e-6)
    assert run["position"] == pytest.approx(ANGLE / 1000, abs=1e-8)


def test_a_mapping_is_not_of_a_file_in_other_units(tmp_path: Path) -> None:
    """The numbers of mN m and rad came in as N m and degrees."""
    first = write(tmp_path / "a.csv", "time [s],q [deg],tau [Nm]", TIME, ANGLE, TIME)
    other = write(tmp_path / "b.csv", "time [s],q [rad],tau [mNm]", TIME, ANGLE / 57.3, 1e3 * TIME)
    mapping = tmp_path / "runs" / "mapping.toml"
    command(first, "-o", mapping.parent)
    code, output = command(other, "--mapping", mapping, "-o", tmp_path / "others")
    assert code == 3
    assert "column 'q' is in rad, and the mapping" in output
    assert "column 'tau' is in mNm, and the mapping" in output
    # A unit that the user corrects stays corrected, in this file and in the next.
    given = ("-c", "motor_angle=q [deg]", "-c", "motor_torque=tau*0.5 [N m]")
    code, output = command(other, *given, "-o", mapping.parent, "--replace")
    assert code == 0, output
    (run,) = import_runs(other, mapping=mapping)
    assert run["motor_torque"] == pytest.approx(500 * TIME, rel=1e-5)


def test_the_runs_of_the_command_in_python(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", "time [s],q [deg],tau [%]", TIME, ANGLE, TIME)
    with pytest.raises(UsageError, match="--rated-torque"):
        import_runs(path)
    (run,) = import_runs(path, rated_torque="2 N m", columns=["motor_angle=-q"], load_mass="3 kg")
    folder = tmp_path / "runs"
    command(path, "--rated-torque", "2 N m", "-c", "motor_angle=-q", "-o", folder, "-y")
    (again,) = import_runs(path, mapping=folder / "mapping.toml")
    for name in run:
        assert np.array_equal(run[name], again[name])
        assert np.array_equal(run[name], read_run(folder / "a.csv")[name])
    with pytest.raises(UsageError, match="has no rated"):
        import_runs(path, rated="2 N m")
    assert run["motor_torque"] == pytest.approx(0.02 * TIME)
    assert run["motor_angle"] == pytest.approx(-np.radians(ANGLE), abs=1e-7)
    assert run.metadata["load_mass"] == "3 kg"
