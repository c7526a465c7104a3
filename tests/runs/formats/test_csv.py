"""Runs in CSV: what they say in SI, what is refused and where, and that numbers survive."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from winchkit.errors import RunError
from winchkit.runs import Run, read_run, write_run
from winchkit.runs.info import info_of, summary_of
from winchkit.runs.read import read_log

PLAIN = "time [s],motor_angle [rad],tension [N]\n0,0,10\n0.1,1,11\n0.2,2,12\n"


def run_of(path: Path, text: str | bytes) -> Run:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_run(path)


def faults_of(path: Path, text: str | bytes) -> list[tuple[int | None, str]]:
    """Line and message of every fault."""
    with pytest.raises(RunError) as caught:
        run_of(path, text)
    assert caught.value.exit_code == 3
    assert all(fault.path == str(path) for fault in caught.value.faults)
    return [(fault.line, fault.message) for fault in caught.value.faults]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "lift.csv"


def test_metadata_channels_and_name(file: Path) -> None:
    run = run_of(file, "# load_mass: 15 kg\n# length_zeroed: true\n# just a remark\n\n" + PLAIN)
    assert (run.name, len(run), run.path) == ("lift", 3, str(file))
    assert run.load_mass == 15.0
    assert run.length_zeroed
    assert dict(run.metadata) == {"load_mass": "15 kg", "length_zeroed": "true"}
    assert run.time.tolist() == [0.0, 0.1, 0.2]
    assert run["tension"].tolist() == [10.0, 11.0, 12.0]
    assert run.channels["tension"].column == 3
    assert run.notes == ()


@pytest.mark.parametrize(
    ("column", "written", "si", "unit"),
    [
        ("time [ms]", "2", 2e-3, "s"),
        ("motor_angle [deg]", "180", math.pi, "rad"),
        ("motor_angle [turn]", "0.5", math.pi, "rad"),
        ("motor_velocity [rpm]", "60", 2 * math.pi, "rad/s"),
        ("motor_torque [mN m]", "250", 0.25, "N m"),
        ("tension [kN]", "0.3", 300.0, "N"),
        ("load [N]", "5", 5.0, "N"),
        ("cable_length [mm]", "1500", 1.5, "m"),
        ("temperature [degC]", "21.5", 21.5, "degC"),
        ("temperature [K]", "293.15", 20.0, "degC"),
        ("platform_x [mm]", "12", 0.012, "m"),
        ("platform_qw", "0.5", 0.5, "1"),
        ("platform_yaw [deg]", "90", math.pi / 2, "rad"),
        ("A.swivel [deg]", "90", math.pi / 2, "rad"),
        ("B.cable_length [cm]", "3", 0.03, "m"),
        ("valve [bar]", "3", 3.0, "bar"),
        ("valve", "3", 3.0, ""),
    ],
)
def test_units_become_si(file: Path, column: str, written: str, si: float, unit: str) -> None:
    others = {"time": "time [s]", "motor_angle": "motor_angle [rad]"}
    name = column.split(" ", maxsplit=1)[0]
    header = [column, *(text for other, text in others.items() if other != name)]
    rows = [[str(row), *(str(row) for _ in header[1:])] for row in (0, 1)]
    rows.append([written if name != "time" else "2", *("2" for _ in header[1:])])
    run = run_of(file, "\n".join(",".join(row) for row in [header, *rows]))
    if name == "time":
        assert run.time[-1] == pytest.approx(si)
        return
    assert run[name][-1] == pytest.approx(si)
    assert run.channels[name].unit == unit


def test_holes_are_counted_and_never_filled(file: Path) -> None:
    text = "time [s],motor_angle [rad],tension [N]\n0,0,\n1,nan,2\n2,NaN, \n7,3,4\n8,3,4\n"
    run = run_of(file, text)
    summary = summary_of(run)
    assert np.isnan(run["tension"]).tolist() == [True, False, True, False, False]
    assert dict(summary.missing) == {"motor_angle": 2, "tension": 2}
    assert (summary.rows, summary.gaps, summary.rate) == (5, 1, 1.0)
    assert summary.text == "5 rows, 8 s at 1 Hz, 1 gap, NaN: motor_angle 2, tension 2"


def test_constant_channels_are_reported(file: Path) -> None:
    run = run_of(file, PLAIN.replace(",11", ",10").replace(",12", ",10"))
    assert summary_of(run).constant == ("tension",)


def test_several_winches(file: Path) -> None:
    text = "time [s],A.motor_angle [rad],B.motor_angle [rad],B.tension [N],room [%]\n"
    run = run_of(file, text + "0,1,2,3,4\n1,5,6,7,8\n")
    assert run.winches() == ["A", "B"]
    only = run.of_winch("B")
    assert set(only) == {"motor_angle", "tension", "room"}
    assert only["motor_angle"].tolist() == [2.0, 6.0]
    with pytest.raises(RunError, match="it has A, B"):
        run.of_winch("C")
    with pytest.raises(RunError, match=r"no column 'tensio'.*did you mean 'tension'"):
        only["tensio"]


def test_poses_need_no_time(file: Path) -> None:
    run = run_of(file, "platform_x [m],1.motor_angle [rad]\n0.5,1\n0.6,2\n")
    assert run.time.tolist() == [0.0, 1.0]
    assert run.metadata["time"] == "row number"
    assert "time" in run.notes[0]
    assert math.isnan(summary_of(run).rate)


def test_other_columns_are_kept_and_text_is_left_out(file: Path) -> None:
    text = "time [s],motor_angle [rad],state,tensoin [N],wild\n0,0,OP,1,inf\n1,1,,2,3\n"
    run = run_of(file, text)
    assert set(run) == {"motor_angle", "tensoin", "wild"}
    assert run.notes == (
        "column 'tensoin' is kept and not used; did you mean 'tension'?",
        "column 3 'state' contains text and is left out",
    )


@pytest.mark.parametrize(
    "encode",
    [
        lambda text: text.encode("utf-8-sig"),
        lambda text: text.encode("utf-16"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: ("# ort: Köln\n" + text).encode("cp1252"),
        lambda text: text.replace("time [s],motor_angle [rad]", '"time [s]", motor_angle[rad]'),
        lambda text: text.rstrip("\n") + "\n\n  \n",
    ],
)
def test_whichever_program_wrote_it(file: Path, encode: object) -> None:
    assert callable(encode)
    run = run_of(file, encode(PLAIN))
    assert run["motor_angle"].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize(
    ("text", "line", "part"),
    [
        ("", None, "empty"),
        ("# load_mass: 15 kg\n", None, "no header"),
        ("time [s],motor_angle [rad]\n", None, "no rows"),
        ("time [s],motor_angle [rad]\n0,0\n", None, "one row only"),
        ("0,1,2\n1,2,3\n", 1, "the first line has numbers"),
        (PLAIN.replace(",", ";"), 1, "semicolons"),
        (PLAIN.replace(",", "\t"), 1, "tabs"),
        (PLAIN.replace("time [s]", "t [s]"), 1, "no column 'time [s]'"),
        (PLAIN.replace("motor_angle", "motor_angel"), 1, "did you mean 'motor_angel'"),
        (PLAIN.replace("tension [N]", "time [s]"), 1, "2 columns are called 'time': 1, 3"),
        (PLAIN.replace("tension [N]", "tension"), 1, "write 'tension [N]'"),
        (PLAIN.replace("tension [N]", "tension [m]"), 1, "a unit of length, not of force"),
        (PLAIN.replace("tension [N]", "tension [kg]"), 1, "load_mass: 15 kg"),
        (PLAIN.replace("tension [N]", "load [g]"), 1, "a mass, and a force is needed"),
        (PLAIN.replace("tension [N]", "tension [n]"), 1, "did you mean"),
        (PLAIN.replace("tension [N]", "tension [metre]"), 1, "the unknown unit [metre]"),
        (PLAIN.replace("tension [N]", "[N]"), 1, "column 3 is called '[N]'"),
        (PLAIN.replace("tension [N]", ""), 1, "column 3 is called ''"),
        (PLAIN.replace(",11", ",1l"), 3, "column 'tension' has '1l'"),
        (PLAIN.replace(",11", ",1_1"), 3, "column 'tension' has '1_1'"),
        (PLAIN.replace(",11", ",inf"), 3, "column 'tension' is infinite"),
        (PLAIN.replace("[N]", "[kN]").replace(",11", ",1e308"), 3, "'tension' is infinite"),
        (PLAIN.replace("0.2,", "1e400,"), 4, "column 'time' is infinite"),
        (PLAIN.replace("0.1,1", "0.1,1,1"), 3, "4 cells in this row, 3 columns"),
        (PLAIN.replace(",2,12\n", ",2\n"), 4, "is the file cut off?"),
        (PLAIN.replace("0.1,", ","), 3, "time is missing here"),
        (PLAIN.replace("0.2,", "0.1,"), 4, "time stands still at 0.1 s"),
        (PLAIN.replace("0.2,", "0.05,"), 4, "time goes back from 0.1 s to 0.05 s"),
        ("# load_mass: 15\n" + PLAIN, 1, "no unit"),
        ("# load_mass: -1 kg\n" + PLAIN, 1, "below zero"),
        ("# a: 1\n# length_zeroed: maybe\n" + PLAIN, 2, "neither true nor false"),
        ("# load_mass: 1 kg\n# load_mass: 2 kg\n" + PLAIN, 2, "a second time"),
        (b"\x89PNG\x00\x01\x02", None, "binary"),
        (b"\x81\x8d\xff", None, "not a text file"),
    ],
)
def test_what_is_refused(file: Path, text: str | bytes, line: int | None, part: str) -> None:
    ((where, message),) = faults_of(file, text)
    assert where == line
    assert part in message


def test_every_fault_in_line_order(file: Path) -> None:
    text = "# load_mass: x\ntime [s],motor_angle [kg],tension [kg]\n0,a,1\n\n1,2,b\n"
    faults = faults_of(file, text)
    assert [line for line, _ in faults] == [1, 2, 2, 3, 5]


def test_infinite_times_are_faults_and_no_arithmetic(file: Path) -> None:
    faults = faults_of(file, PLAIN.replace("0.1,", "inf,").replace("0.2,", "inf,"))
    assert [line for line, _ in faults] == [3, 4, 4]


def test_a_thousand_faults_are_capped_and_counted(file: Path) -> None:
    rows = "".join(f"{n},x\n" for n in range(1000))
    faults = faults_of(file, "time [s],motor_angle [rad]\n" + rows)
    assert len(faults) == 21
    assert faults[-1][1] == "and 980 more faults"


def test_other_files_are_no_runs(tmp_path: Path) -> None:
    for path, part in (
        (tmp_path / "none.csv", "no such file"),
        (tmp_path / "run.txt", "use one of .csv, .mcap"),
        (tmp_path, "is a folder; name the runs in it"),
    ):
        with pytest.raises(RunError, match=part):
            read_run(path)
    (tmp_path / "dir.csv").mkdir()
    with pytest.raises(RunError, match="is a folder"):
        read_run(tmp_path / "dir.csv")


NUMBERS = st.one_of(st.just(math.nan), st.floats(allow_nan=False, allow_infinity=False))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=2, max_size=30))
def test_numbers_survive_to_the_last_bit(
    rows: list[tuple[float, float, float]], tmp_path: Path
) -> None:
    file = tmp_path / "r.csv"
    header = "# programme: ladder\ntime [s],motor_angle [rad],tension [N],odd\n"
    text = "".join(
        f"{n * 0.1!r}," + ",".join(repr(v) for v in row) + "\n" for n, row in enumerate(rows)
    )
    first = run_of(file, header + text)
    assert np.array_equal(
        np.array([first["motor_angle"], first["tension"], first["odd"]]).T, rows, equal_nan=True
    )
    write_run(first, tmp_path / "copy.csv", replace=True)
    second = read_run(tmp_path / "copy.csv")
    assert np.array_equal(first.time, second.time)
    assert dict(first.metadata) == dict(second.metadata)
    for name in first:
        assert np.array_equal(first[name], second[name], equal_nan=True)
        assert first.channels[name].unit == second.channels[name].unit


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, len(PLAIN) - 1), what=st.binary(max_size=3))
def test_no_damage_brings_the_reader_down(place: int, what: bytes, tmp_path: Path) -> None:
    data = PLAIN.encode()
    with suppress(RunError):
        run = run_of(tmp_path / "d.csv", data[:place] + what + data[place + 1 :])
        assert (np.diff(run.time) > 0).all()
        assert len(run["motor_angle"]) == len(run.time)


def test_comments_between_the_rows_are_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    path.write_text(
        "time [s],motor_angle [rad],remark\n0,0,#1\n# stopped here, by hand, twice, at once\n"
        "1,2,#2\n# end\n",
        encoding="utf-8",
    )
    run = read_run(path)
    assert run["motor_angle"].tolist() == [0.0, 2.0]
    path.write_text("note,time [s],motor_angle [rad]\n#7,0,0\n#8,1,2\n", encoding="utf-8")
    assert read_run(path)["motor_angle"].tolist() == [0.0, 2.0]


def test_an_edited_event_is_read_as_far_as_it_is_one(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "# written by winchkit\ntime [s],motor_angle [rad]\n"
        '# event 0.5 s: {"winch": [1], "tare": 3, "tripped": 7}\n0,0\n# event x s: {}\n1,2\n',
        encoding="utf-8",
    )
    log = read_log(path)
    assert [note.time for note in log.events] == [0.5]
    assert info_of(log).commanders == info_of(log).events == info_of(log).tares == ()
