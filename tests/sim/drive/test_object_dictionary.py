"""A simulated drive's dictionary over SDO, seen by canopen's client, and what small EDS lack."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import canopen
import pytest
from canopen.sdo.exceptions import SdoAbortedError
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import EDS, ENTRIES, NODE, SERVO, Flywheel, Rig
from winchkit.errors import FileError
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import Entry, Key, ObjectDictionary, read_eds

UNKNOWN, READ_ONLY, NO_SUB = 0x06020000, 0x06010002, 0x06090011
LENGTH, RANGE, TOGGLE, COMMAND = 0x06070010, 0x06090030, 0x05030000, 0x05040001


@pytest.fixture
def rig() -> Rig:
    return Rig()


def variables() -> list[canopen.objectdictionary.ODVariable]:
    found = []
    for thing in canopen.import_od(str(EDS), NODE).values():
        members = thing.subindices.values() if hasattr(thing, "subindices") else [thing]
        found += [one for one in members if one.index >= 0x1000]
    return found


def test_every_readable_object_answers_with_the_length_of_its_type(rig: Rig) -> None:
    checked = 0
    for variable in variables():
        if variable.access_type == "wo":
            continue
        data = rig.node.sdo.upload(variable.index, variable.subindex)
        if variable.data_type in canopen.objectdictionary.datatypes.NUMBER_TYPES:
            assert len(data) * 8 == len(variable), variable.name
        checked += 1
    assert checked > 200


def test_defaults_are_those_of_the_eds(rig: Rig) -> None:
    alive = {0x1001, 0x603F, 0x6041, 0x6061, 0x6062, 0x6064, 0x606B, 0x606C, 0x6077, 0x60F4, 0x6502}
    for variable in variables():
        if variable.index in alive or variable.default is None:
            continue
        data = rig.node.sdo.upload(variable.index, variable.subindex)
        expected = variable.default
        if isinstance(expected, str):
            assert data == expected.encode()
        else:
            assert variable.decode_raw(data) == expected, variable.name


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x5FFF, 0, b"\0", UNKNOWN),
        (0x607D, 3, b"\0\0\0\0", NO_SUB),
        (0x6041, 0, b"\0\0", READ_ONLY),
        (0x1008, 0, b"abcd", READ_ONLY),
        (0x6040, 0, b"\0\0\0\0", LENGTH),
        (0x60FF, 0, b"\0\0", LENGTH),
        (0x605A, 0, struct.pack("<h", 9), RANGE),
        (0x605A, 0, struct.pack("<h", -1), RANGE),
        (0x605D, 0, struct.pack("<h", 0), RANGE),
        (0x6007, 0, struct.pack("<h", 4), RANGE),
        (0x6060, 0, struct.pack("<b", 2), RANGE),
        (0x6060, 0, struct.pack("<b", 11), RANGE),
        (0x6098, 0, struct.pack("<b", 36), RANGE),
        (0x6085, 0, bytes(4), RANGE),
        (0x6076, 0, bytes(4), RANGE),
        (0x1010, 1, b"nope", 0x08000020),
        (0x1016, 1, struct.pack("<I", 200 << 16 | 100), RANGE),
    ],
)
def test_a_wrong_write_is_refused_and_changes_nothing(
    rig: Rig, index: int, sub: int, data: bytes, code: int
) -> None:
    there = code not in (UNKNOWN, NO_SUB)
    before = rig.node.sdo.upload(index, sub) if there else b""
    with pytest.raises(SdoAbortedError) as refusal:
        rig.node.sdo.download(index, sub, data)
    assert refusal.value.code == code
    if there:
        assert rig.node.sdo.upload(index, sub) == before


@pytest.mark.parametrize(("index", "sub", "code"), [(0x5000, 0, UNKNOWN), (0x1018, 9, NO_SUB)])
def test_reading_what_is_not_there_is_refused(rig: Rig, index: int, sub: int, code: int) -> None:
    with pytest.raises(SdoAbortedError) as refusal:
        rig.node.sdo.upload(index, sub)
    assert refusal.value.code == code


@settings(max_examples=30, deadline=None)
@given(st.integers(-(2**31), 2**31 - 1), st.booleans())
def test_what_is_written_is_read_back(value: int, segmented: bool) -> None:
    rig = Rig()
    rig.node.sdo.download(0x607A, 0, struct.pack("<i", value), force_segment=segmented)
    assert rig.node.sdo.upload(0x607A, 0) == struct.pack("<i", value)


def test_a_long_string_comes_in_segments(rig: Rig) -> None:
    assert rig.node.sdo[0x1008].raw == "generic CiA 402 drive"
    segments = [data for data in rig.sent(0x580 + NODE) if data[0] >> 5 == 0]
    assert len(segments) == 3
    assert [data[0] & 0x10 for data in segments] == [0, 0x10, 0]


def test_a_segment_with_the_wrong_toggle_bit_aborts(rig: Rig) -> None:
    rig.raw_sdo(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    answer = rig.raw_sdo(bytes((0x70,)) + bytes(7))
    assert struct.unpack("<BHBI", answer) == (0x80, 0x1008, 0, TOGGLE)


def test_a_segmented_write_of_another_length_than_announced_aborts(rig: Rig) -> None:
    rig.raw_sdo(struct.pack("<BHBI", 0x21, 0x607A, 0, 4))
    answer = rig.raw_sdo(bytes((0x01 | (7 - 2) << 1, 1, 2)) + bytes(5))
    assert struct.unpack("<BHBI", answer) == (0x80, 0x607A, 0, LENGTH)


@pytest.mark.parametrize("command", [0xA0, 0xC0, 0xE0])
def test_block_transfer_is_refused(rig: Rig, command: int) -> None:
    answer = rig.raw_sdo(struct.pack("<BHB4x", command, 0x1008, 0))
    assert struct.unpack_from("<B3xI", answer) == (0x80, COMMAND)


def test_segments_without_a_transfer_are_refused(rig: Rig) -> None:
    for head in (0x00, 0x60):
        answer = rig.raw_sdo(bytes((head,)) + bytes(7))
        assert struct.unpack_from("<B3xI", answer) == (0x80, COMMAND)


def test_an_abort_of_the_client_ends_a_transfer_in_silence(rig: Rig) -> None:
    rig.raw_sdo(struct.pack("<BHB4x", 0x40, 0x1008, 0))
    before = len(rig.frames)
    rig.send(0x600 + NODE, struct.pack("<BHBI", 0x80, 0x1008, 0, 0x08000000))
    assert len(rig.frames) == before


def test_stored_values_survive_a_reset_and_others_do_not(rig: Rig) -> None:
    rig.write(0x6083, 0, 123_456)
    rig.node.sdo.download(0x1010, 1, b"save")
    rig.write(0x6084, 0, 98_765)
    rig.node.nmt.send_command(0x81)
    rig.run(1.0)
    assert rig.read(0x6083) == 123_456
    assert rig.read(0x6084) == 1_310_720
    rig.node.sdo.download(0x1011, 1, b"load")
    rig.node.nmt.send_command(0x81)
    rig.run(1.0)
    assert rig.read(0x6083) == 1_310_720


LEAST = {0x1000, 0x1001, 0x1018, 0x6040, 0x6041, 0x6060, 0x6061, 0x6064}
TARGETS = {"CSV": 0x60FF, "PV": 0x60FF, "CSP": 0x607A, "PP": 0x607A, "CST": 0x6071, "PT": 0x6071}
EXTRA = {"PP": {0x6081}}
MODES = {"PP": 1, "PV": 3, "PT": 4, "CSP": 8, "CSV": 9, "CST": 10}


def entries(*indices: int) -> dict[Key, Entry]:
    return {key: entry for key, entry in ENTRIES.items() if key[0] in indices}


def drive(mode: str, indices: set[int]) -> SimDrive:
    servo = replace(SERVO, modes=(mode,))
    objects = ObjectDictionary(entries(*indices))
    made = SimDrive(lambda _id, _data: None, NODE, servo, objects, Flywheel(), brake=True)
    made.power_on(0.0, boot_time=0.0)
    made.tick(0.001)
    return made


def write(made: SimDrive, index: int, value: int) -> None:
    entry = made.objects.entry((index, 0))
    assert isinstance(entry, Entry)
    assert made.objects.write((index, 0), entry.pack(value)) is None


@pytest.mark.parametrize("mode", list(TARGETS))
def test_the_least_of_objects_is_enough_to_run_and_to_stop(mode: str) -> None:
    made = drive(mode, LEAST | {TARGETS[mode]} | EXTRA.get(mode, set()))
    write(made, 0x6060, MODES[mode])
    for word in (0x06, 0x07, 0x0F):
        write(made, 0x6040, word)
    write(made, TARGETS[mode], 500)
    for step in range(1, 50):
        made.tick(0.001 + step * 0.004)
    assert made.state.name == "OPERATION_ENABLED"
    for place, kind in enumerate(("emergency storm", "host lost", "map lost", "recover")):
        made.inject(kind)
        made.tick(0.3 + place * 0.01)
    write(made, 0x6040, 0x02)
    for step in range(1, 50):
        made.tick(0.4 + step * 0.004)
    assert made.state.name == "SWITCH_ON_DISABLED"


@pytest.mark.parametrize(
    ("mode", "index"), [("PP", 0x607A), ("HM", 0x6098), ("IP", 0x60C1), ("CST", 0x6071)]
)
def test_a_mode_without_its_object_is_refused(mode: str, index: int) -> None:
    with pytest.raises(FileError, match=rf"{index:04X}h:\d \(the mode {mode}\)"):
        drive(mode, {key[0] for key in ENTRIES} - {index})


def test_a_drive_without_a_control_word_is_refused() -> None:
    with pytest.raises(FileError, match=r"6040h:0 \(every drive\)"):
        drive("CSV", {key[0] for key in ENTRIES} - {0x6040})


def test_a_limit_without_a_default_does_not_limit(tmp_path: Path) -> None:
    text = ""
    for index, kind in ((0x6072, 6), (0x6080, 7), (0x6083, 7), (0x607D, 4)):
        text += f"[{index:04X}]\nParameterName=x\nDataType={kind}\nAccessType=rw\n"
    path = tmp_path / "small.eds"
    path.write_text(text, encoding="utf-8")
    found = read_eds(path, 1)
    assert found[0x6072, 0].default == 0xFFFF
    assert found[0x6080, 0].default == 0xFFFFFFFF
    assert found[0x6083, 0].default == 0
