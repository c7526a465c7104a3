"""Traces of CAN frames: written by python-can and by hand as each program writes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.can_trace import is_trace, read_trace
from winchkit.errors import FileError

START = 1.7e9
FRAMES = [
    (0.0, 0x701, b"\x00"),
    (0.25, 0x000, b"\x01\x01"),
    (0.5, 0x080, b""),
    (0.500300, 0x181, bytes.fromhex("370610270000ff09")),
    (1.75, 0x581, bytes.fromhex("80fe600102000106")),
]
WRITERS: dict[str, Callable[[str], can.listener.Listener]] = {
    "t.log": can.CanutilsLogWriter,
    "t.trc": can.TRCWriter,
    "t.asc": can.ASCWriter,
    "t.csv": can.CSVWriter,
    "t.blf": can.BLFWriter,
}


def written(folder: Path, name: str) -> Path:
    path = folder / name
    with WRITERS[name](str(path)) as writer:
        for time, identifier, data in FRAMES:
            message = can.Message(
                START + time, identifier, is_extended_id=False, data=data, channel=0
            )
            writer(message)
    return path


@pytest.mark.parametrize("name", WRITERS)
def test_frames_are_those_that_python_can_wrote(name: str, tmp_path: Path) -> None:
    path = written(tmp_path, name)
    frames = read_trace(path).frames
    assert [(one.identifier, one.data) for one in frames] == [frame[1:] for frame in FRAMES]
    times = [one.time - frames[0].time for one in frames]
    assert times == pytest.approx([frame[0] for frame in FRAMES], abs=1e-6)
    assert is_trace(path.read_bytes())


@pytest.mark.parametrize("name", ["t.asc", "t.log", "t.csv"])
def test_frames_of_can_fd_are_those_that_python_can_wrote(name: str, tmp_path: Path) -> None:
    contents = [bytes(range(size)) for size in (2, 8, 12, 16, 20, 24, 32, 48, 64)]
    with WRITERS[name](str(tmp_path / name)) as writer:
        for number, data in enumerate(contents):
            switched = number % 2 == 0
            writer(can.Message(START, 0x181, False, is_fd=True, bitrate_switch=switched, data=data))
    assert [one.data for one in read_trace(tmp_path / name).frames] == contents


@pytest.mark.parametrize("length", ["L", "l"])
def test_frames_of_can_fd_in_a_trc_have_a_code_or_a_number_of_bytes(
    length: str, tmp_path: Path
) -> None:
    path = tmp_path / "t.trc"
    lines = [f";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,{length},D"]
    sizes = {9: 12, 15: 64, 8: 8, 10: 16}
    for code, size in sizes.items():
        number, data = code if length == "L" else size, bytes(range(size)).hex(" ").upper()
        lines.append(f"      1      1283.231 FB 1      0181 Rx -  {number:<2}   {data}")
    path.write_text("\n".join(lines) + "\n")
    assert [len(one.data) for one in read_trace(path).frames] == [*sizes.values()]


BY_HAND = {
    "candump": "  can0  181   [3]  37 06 FF\n  can0  080   [0] \n  can0  5FF   [1]  01\n",
    "candump -x": "  can0  RX - -  181   [3]  37 06 FF\n can0 TX - - 080 [0]\n"
    " can0 RX - - 5FF [1] 01\n",
    "candump -ta": " (1700000000.250000)  can0  181   [3]  37 06 FF\n"
    " (1700000000.500000)  can0  080   [0] \n (1700000001.000000)  can0  5FF   [1]  01\n",
    "candump -tA": " (2023-11-14 22:13:20.250000)  can0  181   [3]  37 06 FF\n"
    " (2023-11-14 22:13:20.500000)  can0  080   [0] \n"
    " (2023-11-14 22:13:21.000000)  can0  5FF   [1]  01\n",
    "candump -td": " (000.250000)  can0  181   [3]  37 06 FF\n"
    " (000.250000)  can0  080   [0] \n (000.500000)  can0  5FF   [1]  01\n"
    " (000.000000)  can0  5FF  [1] 02\n",
    "TRC 1.0": ";$FILEVERSION=1.0\n     1)      250 0181  3  37 06 FF\n"
    "     2)      500 0080  0\n     3)     1000 05FF  1  01\n",
    "TRC 1.1": ";$FILEVERSION=1.1\n     1)       250.0  Rx         0181  3  37 06 FF\n"
    "     2)       500.0  Tx         0080  0\n     3)      1000.0  Rx         05FF  1  01\n",
    "TRC 1.3": ";$FILEVERSION=1.3\n     1)       250.0 1  Rx        0181 -  3    37 06 FF\n"
    "     2)       500.0 1  Tx        0080 -  0\n     3)    1000.0 1  Rx      05FF -  1    01\n",
    "TRC 2.0": ";$FILEVERSION=2.0\n;$COLUMNS=N,O,T,I,d,l,D\n"
    "      1       250.0 DT     0181 Rx 3  37 06 FF\n      2       500.0 DT     0080 Tx 0\n"
    "      3      1000.0 DT     05FF Rx 1  01\n",
    "ASC dec": "base dec  timestamps absolute\n   0.250000 1  385             Rx   d 3 55 6 255\n"
    "   0.500000 1  128             Tx   d 0\n   1.000000 1  1535            Rx   d 1 1\n",
    "ASC relative": "base hex  timestamps relative\n   0.250000 1  181         Rx   d 3 37 06 FF\n"
    "   0.250000 1  80              Tx   d 0\n   0.500000 1  5FF             Rx   d 1 01\n",
    "SavvyCAN": "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
    "250000,00000181,false,Rx,0,3,37,06,FF,,,,,\n500000,00000080,false,Rx,0,0,,,,,,,,\n"
    "1000000,000005FF,false,Rx,0,1,01,,,,,,,\n",
    "IXXAT": "ASCII Trace IXXAT MiniMon\nDate: 1.2.2025\nBaudrate: 500 kbit/s\n"
    '"Time";"Identifier (hex)";"Format";"Flags";"Data (hex)"\n'
    '"01:00:00.25";"181";"Std";"";"37 06 FF "\n"01:00:00.50";"80";"Std";"";""\n'
    '"01:00:00.75";"702";"Std";"Rtr ";"Remote request  DLC = 1 "\n'
    '"01:00:01.00";"5FF";"Std";"";"01 "\n',
    "CSV with units": "Time [ms];Channel;CAN ID;DLC;Data\n250;1;0x181;3;37 06 FF\n500;1;0x80;0;\n"
    "1000;1;0x5FF;1;01\n",
    "CSV in German": "Zeit [ms];Kanal;ID (hex);DLC;Daten (hex)\n250,0;1;181;3;37 06 FF\n"
    "500,0;1;80;0;\n1000,0;1;5FF;1;01\n",
    "CSV with another name of the time": "Uhr [ms];ID;DLC;Data\n250,0;0x181;3;37 06 FF\n"
    "500,0;0x80;0;\n1000,0;0x5FF;1;01\n",
    "CSV with decimal identifiers": "time (s),id,data\n0.25,385,3706FF\n0.5,128,\n1.0,1535,01\n",
}


@pytest.mark.parametrize("name", BY_HAND)
def test_frames_as_programs_write_them(name: str, tmp_path: Path) -> None:
    path = tmp_path / "t.txt"
    path.write_text(BY_HAND[name])
    frames = read_trace(path).frames[:3]
    assert [(one.identifier, one.data) for one in frames] == [
        (0x181, bytes.fromhex("3706FF")),
        (0x080, b""),
        (0x5FF, b"\x01"),
    ]
    if name in ("candump", "candump -x"):
        assert all(math.isnan(one.time) for one in frames)
        return
    first = {"candump -ta": START, "candump -tA": START, "IXXAT": 3600.0}.get(name, 0.0)
    assert [one.time - first for one in frames] == pytest.approx([0.25, 0.5, 1.0], abs=1e-6)


def test_remote_and_error_frames_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "t.log"
    path.write_text(
        "(0.1) can0 701#R\n(0.2) can0 701#05\n  can0  20000004   [8]  00 04 00 00 00 00 00 00   "
        "ERRORFRAME\n(0.3) can0 701#7F\n(0.4) can0 701#\n"
    )
    trace = read_trace(path)
    assert [one.data for one in trace.frames] == [b"\x05", b"\x7f", b""]
    assert trace.notes[0].startswith("lines that are no frames: 1")
    assert trace.notes[1].endswith("left out: 1")


def test_times_of_a_trace_without_a_head_are_said_to_be_seconds(tmp_path: Path) -> None:
    path = tmp_path / "t.txt"
    path.write_text("".join(f"{250 * n}.0 0x181 3 37 06 FF\n" for n in range(4)))
    trace = read_trace(path)
    assert (trace.layout, trace.frames[1].time) == ("text", 250.0)
    assert any("taken as seconds" in note for note in trace.notes)


def test_a_text_with_few_lines_like_frames_is_no_trace(tmp_path: Path) -> None:
    path = tmp_path / "t.txt"
    path.write_text(
        "".join(f'"12.{n:02}";"A";"4 0{n % 8}{n % 8} 10"\n11 10 1 07\n' for n in range(9))
    )
    with pytest.raises(FileError, match="has no CAN frames"):
        read_trace(path)


def test_whole_numbers_without_a_unit_are_no_times(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("time,id,data\n100,181,3706\n200,581,4B416000\n")
    trace = read_trace(path)
    assert all(math.isnan(one.time) for one in trace.frames)
    assert any("has no unit" in note for note in trace.notes)


@given(st.binary(min_size=1, max_size=400))
def test_any_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.mktemp("any") / "t.log"
    path.write_bytes(data)
    with suppress(FileError):
        assert read_trace(path).frames


@given(st.text(alphabet='0123456789ABCDEFabcdefRTxd #[]().,;"\n\t-', max_size=300))
def test_any_text_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("any") / "t.log"
    path.write_text(f"(0.1) can0 701#05\n{text}", encoding="utf-8")
    assert read_trace(path).frames


def test_a_cut_off_blf_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "t.blf"
    with can.BLFWriter(str(path)) as writer:
        for number in range(20_000):
            writer(can.Message(START + number, 0x181, is_extended_id=False, data=bytes(8)))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert any("is cut off" in note for note in read_trace(path).notes)
