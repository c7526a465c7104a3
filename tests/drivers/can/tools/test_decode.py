"""Frames in words, worked by hand from CiA 301 and 402, and writes that a server understands."""

from __future__ import annotations

import struct
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit import catalog
from winchkit.drivers.can.tools.decode import KnownNode, decode, known_node, write_frames
from winchkit.schema.read import read_device
from winchkit.sim.drive.object_dictionary import Entry, ObjectDictionary
from winchkit.sim.drive.sdo import SdoServer


@cache
def drive() -> KnownNode:
    return known_node("winch C", read_device(catalog.find("devices", "generic-cia402")), 3)


@pytest.fixture(scope="module")
def nodes() -> dict[int, KnownNode]:
    return {3: drive(), 127: KnownNode("host")}


@pytest.mark.parametrize(
    ("identifier", "data", "kind", "text"),
    [
        (0x000, "01 03", "NMT", "winch C: start"),
        (0x000, "81 00", "NMT", "all nodes: reset node"),
        (0x080, "", "SYNC", "SYNC"),
        (0x083, "30 81 11 00 00 00 00 00", "EMCY", "8130h"),
        (0x77F, "05", "heartbeat", "host: operational"),
        (0x703, "00", "heartbeat", "winch C: boot-up"),
        (0x603, "40 41 60 00 00 00 00 00", "SDO", "read 6041h Status"),
        (0x603, "2f 60 60 00 09 00 00 00", "SDO", "write 6060h Modes of operation = 9 CSV"),
        (0x583, "60 60 60 00 00 00 00 00", "SDO", "6060h Modes of operation written"),
        (0x583, "4b 41 60 00 37 06 00 00", "SDO", "0637h operation enabled"),
        (0x583, "80 00 20 00 00 00 02 06", "SDO", "2000h refused: Code 0x06020000"),
        (0x7E5, "11 05 00 00 00 00 00 00", "LSS", "set node id 5"),
        (0x7E4, "44 00 00 00 00 00 00 00", "LSS", "answer: selected"),
        (0x203, "0f 00 10 27 00 00", "RPDO", "0Fh enable operation"),
        (0x203, "80 00 00 00 00 00", "RPDO", "fault reset"),
        (0x203, "0f 01 00 00 00 00", "RPDO", "0Fh enable operation + halt".replace("0Fh", "10Fh")),
        (0x183, "37 06 e8 03 00 00 09", "TPDO", "0637h operation enabled"),
        (0x123, "01 02", "other", "01 02"),
    ],
)
def test_frames_in_words(
    identifier: int, data: str, kind: str, text: str, nodes: dict[int, KnownNode]
) -> None:
    found = decode(identifier, bytes.fromhex(data), nodes)
    assert found.kind == kind
    assert text in found.text


def test_values_of_a_pdo(nodes: dict[int, KnownNode]) -> None:
    rpdo = decode(0x203, struct.pack("<Hi", 0x0F, -10_000), nodes)
    assert rpdo.values == {"6040h": 0x0F, "60FFh": -10_000}
    unknown = decode(0x205, struct.pack("<Hi", 0x0F, -10_000), nodes)
    assert unknown.values == {}


def test_a_signed_object_that_an_eds_declares_unsigned_is_signed(tmp_path: Path) -> None:
    """As 60FFh of some manufacturers, by CiA 402-2; the axis reads and writes it so too."""
    source = catalog.find("devices", "generic-cia402")
    for file in source.parent.iterdir():
        text = file.read_text(encoding="latin-1")
        head, mark, rest = text.partition("[60FF]")
        unsigned = head + mark + rest.replace("DataType=0x0004", "DataType=0x0007", 1)
        (tmp_path / file.name).write_text(unsigned, encoding="latin-1")
    node = known_node("winch C", read_device(tmp_path / source.name), 3)
    rpdo = decode(0x203, struct.pack("<Hi", 0x0F, -10_000), {3: node})
    assert rpdo.values["60FFh"] == -10_000


@given(identifier=st.integers(0, 0x7FF), data=st.binary(max_size=8))
def test_any_frame_has_words(identifier: int, data: bytes) -> None:
    assert decode(identifier, data, {}).text
    assert decode(identifier, data, {identifier & 0x7F: drive()}).text


@given(data=st.binary(min_size=1, max_size=40), node=st.integers(1, 127))
def test_a_written_object_arrives(data: bytes, node: int) -> None:
    """An SDO server that shares no code takes the frames and holds the bytes."""
    key = (0x2001, 2)
    objects = ObjectDictionary({key: Entry("anything", "", "rw", b"")})
    server = SdoServer(objects)
    for identifier, frame in write_frames(node, *key, data):
        assert identifier == 0x600 + node
        answer = server.answer(frame)
        assert answer[0] != 0x80, answer.hex()
    upload = server.answer(bytes((0x40,)) + struct.pack("<HB", *key) + bytes(4))
    size = 4 - (upload[0] >> 2 & 3) if upload[0] & 2 else int.from_bytes(upload[4:], "little")
    assert size == len(data)
    if upload[0] & 2:
        assert upload[4 : 4 + size] == data
