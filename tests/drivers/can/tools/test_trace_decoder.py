"""Traces in words: set up by the canopen library as master, and worked by hand from CiA 301."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager

import can
import canopen
import pytest

from winchkit import catalog
from winchkit.can_trace import TraceFrame
from winchkit.drivers.can.tools.decode import DecodedFrame
from winchkit.drivers.can.tools.trace_decoder import Description, TraceDecoder, read_description
from winchkit.errors import FileError

EDS = catalog.find("devices", "generic-cia402").parent / "generic-cia402.eds"
NODE = 5


def by_eds() -> TraceDecoder:
    return TraceDecoder(read_description(str(EDS)))


def said(decoder: TraceDecoder, identifier: int, data: str) -> DecodedFrame:
    return decoder.decode(TraceFrame(1, 0.0, identifier, bytes.fromhex(data)))


def notes(decoder: TraceDecoder) -> list[str]:
    return [note for node in decoder.all_nodes.values() for note in node.notes()]


@contextmanager
def recorded() -> Iterator[tuple[canopen.RemoteNode, canopen.LocalNode, list[TraceFrame]]]:
    """A master and a node of the canopen library, and the frames between them."""
    frames: list[TraceFrame] = []
    with (
        can.Bus(interface="virtual", channel="trace", receive_own_messages=True) as witness,
        canopen.Network(can.Bus(interface="virtual", channel="trace")) as master,
        canopen.Network(can.Bus(interface="virtual", channel="trace")) as other,
    ):
        for network in (master, other):
            network.notifier = can.Notifier(network.bus, network.listeners, 0.1)
        local = canopen.LocalNode(NODE, str(EDS))
        other.add_node(local)
        yield master.add_node(NODE, str(EDS)), local, frames
        while (message := witness.recv(0.1)) is not None:
            data = bytes(message.data)
            frames.append(TraceFrame(len(frames) + 1, 0.0, message.arbitration_id, data))


def test_a_mapping_that_the_canopen_library_sets_up() -> None:
    """Its TPDO 3, on an identifier of its own, and a string that is read in segments."""
    with recorded() as (remote, local, frames):
        local.sdo[0x1008].raw = "a name of many segments"
        pdo = remote.tpdo[3]
        pdo.read()
        pdo.clear()
        pdo.add_variable(0x6077)
        pdo.add_variable(0x6064)
        pdo.cob_id, pdo.enabled, pdo.trans_type = 0x1F3, True, 255
        pdo.save()
        assert remote.sdo[0x1008].raw == "a name of many segments"
    decoder = by_eds()
    words = [decoder.decode(frame) for frame in frames]
    assert any("a name of many segments" in one.text for one in words)
    found = said(decoder, 0x1F3, struct.pack("<hi", -321, 123_456).hex())
    assert (found.kind, found.node) == ("TPDO", NODE)
    assert found.values == {"6077h": -321, "6064h": 123_456}
    assert not notes(decoder)
    said(decoder, 0x700 + NODE, "00")
    assert not said(decoder, 0x1F3, struct.pack("<hi", -321, 123_456).hex()).values


def test_a_stored_mapping_survives_a_boot_up() -> None:
    decoder = by_eds()
    for data in ("2f001a0000000000", "23001a0110006460", "23001a0120006460", "2f001a0001000000"):
        said(decoder, 0x605, data)
        said(decoder, 0x585, "60" + data[2:8] + "00000000")
    said(decoder, 0x605, "2310100173617665")
    said(decoder, 0x585, "6010100100000000")
    said(decoder, 0x705, "00")
    assert said(decoder, 0x185, "ffffffff").values == {"6064h": -1}


def test_a_refused_write_changes_nothing() -> None:
    decoder = by_eds()
    said(decoder, 0x605, "2f001a0000000000")
    refused = said(decoder, 0x585, "80001a0022000008")
    assert "1A00h" in refused.text
    assert "refused" in refused.text
    assert said(decoder, 0x185, "370610270000 09").values == {
        "6041h": 0x0637,
        "6064h": 10_000,
        "6061h": 9,
    }


def test_the_mode_gives_the_bits_of_the_status_word_their_meaning() -> None:
    decoder = by_eds()
    assert "attained" not in said(decoder, 0x585, "4b41600037160000").text
    said(decoder, 0x605, "4061600000000000")
    said(decoder, 0x585, "4f61600006000000")
    assert "homing attained" in said(decoder, 0x585, "4b41600037160000").text


def test_a_block_download_is_no_other_transfer() -> None:
    """CiA 301, 7.2.4.3.9: 10 bytes to 1F50h:1 in two segments, the first byte of one is 23h."""
    decoder = by_eds()
    texts = [
        said(decoder, identifier, data).text
        for identifier, data in (
            (0x605, "c2501f010a000000"),
            (0x585, "a4501f017f000000"),
            (0x605, "0123001a00020000"),
            (0x605, "8223001a00000000"),
            (0x585, "a2027f0000000000"),
            (0x605, "d100000000000000"),
            (0x585, "a100000000000000"),
        )
    ]
    assert [text.count("block segment") for text in texts] == [0, 0, 1, 1, 0, 0, 0]
    assert "1F50h:1" in texts[5]
    assert texts[5].endswith("end")
    assert "6041h" in said(decoder, 0x585, "4b41600037160000").text


def test_a_pdo_of_another_length_has_no_values_and_a_note() -> None:
    decoder = TraceDecoder(read_description("generic-cia402"))
    found = said(decoder, 0x181, "370610270000")
    assert (
        "0637h operation enabled, 6064h Position actual value 10000 (6 bytes; its mapping"
        in found.text
    )
    assert not found.values
    assert not said(decoder, 0x181, "3706102700000900").values, "longer ones are of another mapping"
    assert any("has 6 bytes in 1 frames" in note for note in notes(decoder))


@pytest.mark.parametrize("identifier", [0x002, 0x07F, 0x200, 0x580, 0x7EA, 0x8002])
def test_an_identifier_of_no_service_is_of_no_node(identifier: int) -> None:
    """CiA 301: the predefined connection set begins with node 1."""
    assert said(by_eds(), identifier, "40 01") == DecodedFrame("other", 0, "40 01")


def test_a_description_of_another_device_is_reported() -> None:
    decoder = TraceDecoder(read_description("maxon-epos4"))
    said(decoder, 0x601, "4018100100000000")
    said(decoder, 0x581, "4318100133020000")
    assert any("is of vendor 233h" in note for note in notes(decoder))


def test_a_real_process_value_of_a_load_cell() -> None:
    decoder = TraceDecoder(None, {9: read_description("generic-cia404")})
    pdo = next(iter(decoder.nodes[9].known.pdos.values()))
    data = struct.pack("<f", -12.5).hex() + "00" * (pdo.size - 4)
    assert said(decoder, 0x189, data).values["6130h:1"] == -12.5
    assert not said(decoder, 0x181, data).values


def test_units_that_the_trace_shows_replace_those_of_the_device_file() -> None:
    decoder = TraceDecoder(read_description("generic-cia402"))
    said(decoder, 0x701, "05")
    node = decoder.nodes[1]
    assert node.scale().angle == pytest.approx(2 * 3.141592653589793 / 65536)
    for sub, value in ((1, 4096), (2, 1)):
        said(decoder, 0x601, f"408f60{sub:02x}00000000")
        said(decoder, 0x581, f"438f60{sub:02x}" + struct.pack("<I", value).hex())
    said(decoder, 0x601, "4076600000000000")
    said(decoder, 0x581, "4376600088130000")
    assert node.scale().angle == pytest.approx(2 * 3.141592653589793 / 4096)
    assert node.scale().rated_torque == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["laumas-tlb", "no-such-device"])
def test_a_device_that_is_on_no_can_bus_is_refused(name: str) -> None:
    with pytest.raises(FileError, match=r"sends no CANopen frames|no device"):
        read_description(name)


def test_a_description_has_the_name_of_its_file_or_device() -> None:
    assert Description(str(EDS)).name == "generic-cia402.eds"
    assert read_description("generic-cia402").name == "generic-cia402"
