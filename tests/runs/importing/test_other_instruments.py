"""Files of oscilloscopes, testing machines, CAN tools, MATLAB objects: traits made from scratch."""

from __future__ import annotations

import io
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from winchkit.can_trace import is_can_trace
from winchkit.errors import RunError
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.assignment import Assignment, Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.stored.sign_bits import lost_sign
from winchkit.runs.importing.streams import streams_of

COUNT, STEP = 300, 0.01


def guessed(path: Path, text: str, *columns: str) -> Guess:
    path.write_text(text)
    return guess_columns(
        read_table(path), Answers(columns=tuple(read_column(text) for text in columns))
    )


def by_source(guess: Guess) -> dict[str, Assignment]:
    return {item.source: item for item in guess.assignments}


def _frames() -> list[tuple[float, int, bytes]]:
    """PDOs of a drive: position and velocity in eight bytes, a SYNC without."""
    angles = (struct.pack("<ii", 1000 * k, 7 * k - 300) for k in range(COUNT))
    return [(k * STEP, 0x181 + k % 3, data) for k, data in enumerate(angles)]


def _hex(data: bytes) -> str:
    return " ".join(f"{byte:02X}" for byte in data)


TRACES = {
    "candump -L": lambda t, i, d: f"({1e9 + t:.6f}) can0 {i:03X}#{d.hex().upper()}",
    "candump": lambda _t, i, d: f"  can0  {i:03X}   [{len(d)}]  {_hex(d)}",
    "ASC": lambda t, i, d: f"   {t:.6f} 1  {i:X}             Rx   d {len(d)} {_hex(d)}",
    "TRC": lambda t, i, d: f"  {t:.0f})  {1e3 * t:.1f}  Rx         {i:04X}  {len(d)}  {_hex(d)}",
    "CSV": lambda t, i, d: f'"CAN-1","{t:.3f}","  ","{i:X}","{len(d)}","{_hex(d)}","........"',
    "decimal comma": lambda t, i, d: f"{t:.3f} {i:08X} {len(d)} {_hex(d)} ".replace(".", ","),
}


@pytest.mark.parametrize("name", TRACES)
def test_a_trace_of_can_frames_is_refused_with_what_to_do(name: str, tmp_path: Path) -> None:
    head = "date Thu Nov 26 10:00:00 2026\nbase hex  timestamps absolute\n" if name == "ASC" else ""
    lines = [TRACES[name](*frame) for frame in _frames()]
    path = tmp_path / "trace.txt"
    path.write_text(head + "\n".join(lines) + "\n")
    with pytest.raises(RunError, match=r"trace of CAN frames.*decode it first"):
        read_table(path)


@given(st.lists(st.lists(st.integers(0, 99), min_size=6, max_size=6), min_size=3, max_size=30))
def test_a_table_of_small_whole_numbers_is_no_trace(table: list[list[int]]) -> None:
    assert not is_can_trace(["100 4 " + " ".join(map(str, row)) for row in table])


def _opaque(name: str, kind: str) -> bytes:
    """A variable of class mxOPAQUE (17) of a MAT file of version 5: name, MCOS, class."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    reference = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 2, 1))
    reference += element(1, b"") + element(6, struct.pack("<II", 0xDD000000, 1))
    words = b"".join(element(1, text.encode()) for text in (name, "MCOS", kind))
    return element(14, element(6, struct.pack("<II", 17, 0)) + words + element(14, reference))


def test_objects_of_matlab_classes_are_left_out_of_a_mat_file(tmp_path: Path) -> None:
    stream = io.BytesIO()
    savemat(stream, {"q": np.linspace(0, 1, COUNT), "t": STEP * np.arange(COUNT)})
    path = tmp_path / "log.mat"
    path.write_bytes(stream.getvalue() + _opaque("T", "timetable"))
    table = read_table(path)
    assert {column.name for column in table.columns} == {"q", "t"}
    assert any("'T' is an object of the MATLAB class timetable" in note for note in table.notes)
    path.write_bytes(stream.getvalue()[:128] + _opaque("out", "Simulink.SimulationOutput"))
    with pytest.raises(RunError, match=r"'out' is an object of the MATLAB class Simulink.*save"):
        read_table(path)


def test_objects_and_empty_arrays_are_left_out_of_a_mat_file_of_version_73(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.mat"

    def write(*, with_numbers: bool) -> None:
        with h5py.File(path, "w") as file:
            if with_numbers:
                file["q"] = np.linspace(0, 1, COUNT)
            file["ts"] = np.array([[0xDD000000, 2, 1, 1, 6, 1]], dtype=np.uint32)
            file["ts"].attrs.update(MATLAB_class=np.bytes_(b"timeseries"), MATLAB_object_decode=3)
            file["tau"] = np.array([0, 0], dtype=np.uint64)
            file["tau"].attrs.update(MATLAB_class=np.bytes_(b"double"), MATLAB_empty=1)

    write(with_numbers=True)
    table = read_table(path)
    assert [column.name for column in table.columns] == ["q"]
    assert any("MATLAB class timeseries" in note for note in table.notes)
    write(with_numbers=False)
    with pytest.raises(RunError, match=r"'ts' is an object of the MATLAB class timeseries.*save"):
        read_table(path)


@pytest.mark.parametrize("first", ["0,1,2,3", "1,2,3,4", ",0,1,2,3"])
def test_a_first_row_that_counts_the_columns_is_no_sample(first: str, tmp_path: Path) -> None:
    index = first.startswith(",")
    rows = [f"{f'{k},' if index else ''}{k * STEP:g},5,{k % 9},7.5" for k in range(1, COUNT)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([first, *rows]) + "\n")
    table = read_table(path)
    assert {len(column) for column in table.columns} == {COUNT - 1}
    assert any("counts the columns" in note for note in table.notes)
    path.write_text("\n".join(rows) + "\n")
    assert {len(column) for column in read_table(path).columns} == {COUNT - 1}


OSCILLOSCOPES = {
    "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.0e+00,1.0e-02\n": "{k},{a:.4f},{b:.4f},",
    "Time(s),CH1(V),CH2(V),t0 = -1.0e+00, tInc = 1.0e-02,\n": ",{a:.4f},{b:.4f},,",
}


@pytest.mark.parametrize("head", OSCILLOSCOPES)
def test_an_oscilloscope_gives_its_interval_in_place_of_times(head: str, tmp_path: Path) -> None:
    angle = np.sin(np.arange(COUNT) / 20)
    row = OSCILLOSCOPES[head]
    text = head + "\n".join(row.format(k=k, a=a, b=-a) for k, a in enumerate(angle)) + "\n"
    guess = guessed(tmp_path / "scope.csv", text, "tension=CH1*50 [N]", "motor_angle=CH2*0.2 [rad]")
    assert not guess.questions
    assert guess.sample_rate == pytest.approx(1 / STEP)
    assert guess.table.column("CH1").values == pytest.approx(angle, abs=1e-4)
    assert {guess.table.column(name).unit for name in ("CH1", "CH2")} <= {"V", "Volt"}


def test_a_strain_is_no_length(tmp_path: Path) -> None:
    """A testing machine: both names say extension, one unit is that of a length."""
    head = "Time,Extension,Load,Strain (Extension)\n(s),(mm),(N),(mm/mm)\n"
    rows = [f"{k * STEP:g},{k / 90:.4f},{k / 3:.3f},{k / 9000:.6f}" for k in range(COUNT)]
    guess = guessed(tmp_path / "pull.csv", head + "\n".join(rows) + "\n")
    assert not guess.questions
    assert by_source(guess)["Extension"].channel == "position"
    assert not by_source(guess)["Strain (Extension)"].channel


def test_arrays_may_have_their_unit_in_the_name(tmp_path: Path) -> None:
    """A TDMS or Parquet file has names such as ``Angle [Deg.]``; SI is then no convention."""
    path = tmp_path / "log.npz"
    angle = np.linspace(0, 90, COUNT)
    np.savez(path, **{"Angle [Deg.]": angle, "Time [ms]": 10 * np.arange(COUNT)})
    found = by_source(guess_columns(read_table(path)))
    assert found["Angle"].factor == pytest.approx(np.pi / 180)
    assert found["Time"].factor == pytest.approx(1e-3)


def test_a_column_given_for_one_winch_is_chosen_for_the_others(tmp_path: Path) -> None:
    """Servos with two columns that may be the torque: the user names one of the first servo."""
    head = "time," + ",".join(f"pos ({n}),load ({n}),current ({n})" for n in (1, 2)) + "\n"
    rows = [
        f"{k * STEP:g},{k % 50},{k % 7}.5,{k % 3}.25,{k % 40},{k % 5}.5,{k % 4}.75"
        for k in range(COUNT)
    ]
    columns = ("1.motor_angle=pos (1) [deg]", "1.motor_torque=load (1)*0.5 [N m]")
    guess = guessed(tmp_path / "servos.csv", head + "\n".join(rows) + "\n", *columns)
    found = by_source(guess)
    assert (found["load (2)"].channel, found["load (2)"].factor) == ("2.motor_torque", 0.5)
    assert not found["current (2)"].channel


def test_the_ratio_is_used_with_a_time_in_seconds_by_convention(tmp_path: Path) -> None:
    """A velocity in tenths of the angle's unit is asked with its value, not left unknown."""
    time = STEP * np.arange(COUNT)
    rows = zip(time, 90 * np.sin(time), 9 * np.cos(time), strict=True)
    text = (
        "Time,Position,Velocity\n"
        + "\n".join(f"{t:.4f},{a:.5f},{v:.5f}" for t, a, v in rows)
        + "\n"
    )
    guess = guessed(tmp_path / "drive.csv", text, "motor_angle=Position [deg]")
    (question,) = guess.questions
    assert "by its ratio to the angle 1 is 0.1745 rad/s" in question.text


def test_quantities_of_the_tool_are_of_no_winch(tmp_path: Path) -> None:
    head = ",".join(
        ["timestamp", *(f"actual_q_{n},actual_TCP_force_{n},actual_current_{n}" for n in range(3))]
    )
    rows = [
        f"{k * STEP:.3f}," + ",".join(f"{k / 99:.4f},{k / 7:.4f},{k / 50:.4f}" for _ in range(3))
        for k in range(COUNT)
    ]
    guess = guessed(tmp_path / "arm.csv", head + "\n" + "\n".join(rows) + "\n")
    assert {item.channel.rpartition(".")[2] for item in guess.used} == {
        "time",
        "motor_angle",
        "motor_torque",
    }


def _stored(value: int, bits: int, how: str) -> int:
    if how == "two's complement":
        return value % 2**bits
    return value if value >= 0 else 2 ** (bits - 1) - value


@pytest.mark.parametrize(("bits", "how"), [(11, "sign and magnitude"), (16, "two's complement")])
def test_a_lost_sign_is_asked(bits: int, how: str, tmp_path: Path) -> None:
    """A servo's load of ±300 in a field without a sign."""
    head = "time,position,torque\n"
    loads = [round(300 * np.sin(k / 9)) for k in range(COUNT)]
    lines = [f"{k * STEP:g},{k}.5,{_stored(v, bits, how)}" for k, v in enumerate(loads)]
    columns = ("motor_angle=position [deg]", "motor_torque=torque*0.01 [N m]")
    path = tmp_path / "servo.csv"
    (question,) = guessed(path, head + "\n".join(lines) + "\n", *columns).questions
    assert f"{bits} bits stored without a sign ({how}" in question.text
    assert question.options == ('--signed "torque"', '--unsigned "torque"')
    answers = Answers(tuple(read_column(text) for text in columns), unsigned=("torque",))
    assert not guess_columns(read_table(path), answers).questions
    signed = guess_columns(read_table(path), replace(answers, unsigned=(), signed=("torque",)))
    torque = run_of(streams_of(signed), {})["motor_torque"]
    assert torque == pytest.approx(0.01 * np.array(loads))


@given(st.integers(0, 2**32 - 1), st.integers(8, 20))
def test_counts_and_levels_have_their_sign(seed: int, bits: int) -> None:
    """An encoder over its whole range, two levels of speed, and signed values."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 2**bits, 500).astype(float)
    levels = np.where(rng.random(500) < 0.5, 0, 1200) + rng.integers(0, 20, 500)
    signed = rng.integers(-(2**bits), 2**bits, 500).astype(float)
    for values in (counts, levels.astype(float), signed, np.full(500, 7.0)):
        assert not lost_sign(values)


def test_components_of_a_six_axis_cell_are_asked(tmp_path: Path) -> None:
    names = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]
    head = "Time [s]," + ",".join(f"{n} [{'N' if n[0] == 'F' else 'Nm'}]" for n in names) + "\n"
    rows = [
        f"{k * STEP:g}," + ",".join(f"{np.sin(k / 9 + n):.4f}" for n in range(6))
        for k in range(COUNT)
    ]
    guess = guessed(tmp_path / "cell.csv", head + "\n".join(rows) + "\n")
    assert {item.channel for item in guess.used} == {"time"}
    assert ["Fz" in question.text for question in guess.questions] == [True, False]
    alone = head.replace("Fx", "Ax").replace("Fy", "Ay").replace(" [N],Ay [N]", " [V],Ay [V]")
    guess = guessed(tmp_path / "cell.csv", alone + "\n".join(rows) + "\n")
    assert by_source(guess)["Fz"].channel == "tension"


def test_times_with_separators_of_thousands_are_one_fault(tmp_path: Path) -> None:
    """``0.000``, ``100.000``, …, ``1.000.000``: microseconds, or milliseconds of a spreadsheet."""
    stamps = [f"{100_000 * k:,}".replace(",", ".") for k in range(COUNT)]
    text = "\n".join(f"{stamp};3.658;{k % 9}.315" for k, stamp in enumerate(stamps)) + "\n"
    guess = guessed(tmp_path / "log.csv", text, "time=1 [ms]", "motor_angle=3 [deg]")
    (fault,) = streams_of(guess).faults
    assert "separators of thousands" in fault.message
    assert "'1.000.000'" in fault.message
