"""The slave against the bytes of CiA 301: NMT, heartbeats, guarding, SDO, PDO and EMCY."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import canopen
import pytest

from slave import Frame, Nmt, Slave, read
from slave.on_bus import SlavesOnBus
from slave.wire import GENERIC, Wire, emergencies


def beats(frames: list[Frame], node: int = 1) -> list[int]:
    return [frame.data[0] for frame in frames if frame.identifier == 0x700 + node]


def test_boot_up_is_one_zero_byte() -> None:
    wire = Wire(node=5)
    assert wire.frames == [Frame(0x705, b"\x00")]
    assert wire.slave.network.state is Nmt.PRE_OPERATIONAL


def test_nmt_commands_of_the_standard() -> None:
    wire = Wire()
    seen = []
    for command in ("0101", "0201", "8001", "0100", "0102", "8101"):
        wire.send(0x000, command)
        seen.append(wire.slave.network.state)
    assert seen == [
        Nmt.OPERATIONAL,
        Nmt.STOPPED,
        Nmt.PRE_OPERATIONAL,
        Nmt.OPERATIONAL,
        Nmt.OPERATIONAL,  # for node 2
        Nmt.INITIALISING,
    ]
    assert beats(wire.wait(0.05)) == [0]


def test_stopped_answers_no_sdo() -> None:
    wire = Wire()
    assert wire.sdo("4000100000000000") == "4300100092010200"
    wire.send(0x000, "0201")
    assert wire.sdo("4000100000000000") == ""


def test_heartbeats_show_the_state_at_their_period() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 20, 2)
    assert beats(wire.wait(0.099)) == [0x7F] * 5
    wire.start()
    assert set(beats(wire.wait(0.1))) == {0x05}


@pytest.mark.parametrize(
    ("behaviour", "state"), [(0, Nmt.PRE_OPERATIONAL), (1, Nmt.OPERATIONAL), (2, Nmt.STOPPED)]
)
def test_a_lost_heartbeat_is_reported_and_1029h_acts(behaviour: int, state: Nmt) -> None:
    wire = Wire()
    wire.write(0x1029, 1, behaviour, 1)
    wire.write(0x1016, 1, 0x007F0064, 4)
    wire.start()
    wire.wait(0.5)
    assert wire.slave.network.state is Nmt.OPERATIONAL, "not armed before the first heartbeat"
    wire.send(0x77F, "05")
    assert emergencies(wire.wait(0.099)) == []
    assert emergencies(wire.wait(0.003)) == [0x8130]
    assert wire.slave.network.state is state
    assert emergencies(wire.wait(1.0)) == []


def test_guarding_toggles_and_life_guarding_trips() -> None:
    wire = Wire()
    wire.write(0x100C, 0, 50, 2)
    wire.write(0x100D, 0, 2, 1)
    assert wire.wait(0.5) == [], "not armed before the first remote frame"
    replies = [wire.send(0x701, remote=True)[0].data.hex() for _ in range(3)]
    assert replies == ["7f", "ff", "7f"]
    wire.start()
    assert wire.send(0x701, remote=True) == [Frame(0x701, b"\x85")]
    assert emergencies(wire.wait(0.099)) == []
    assert emergencies(wire.wait(0.003)) == [0x8130]


def test_a_heartbeat_period_switches_guarding_off() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 1000, 2)
    wire.wait(0.01)
    assert wire.send(0x701, remote=True) == []


def test_reset_restores_values_of_power_on() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 20, 2)
    wire.send(0x000, "8201")
    wire.wait(0.05)
    assert wire.read(0x1017) == 0


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("4017100000000000", "4b17100000000000"),  # upload of 2 bytes
        ("2b171000e8030000", "6017100000000000"),  # download of 2 bytes
        ("2f17100005000000", "8017100013000706"),  # too short
        ("23171000e8030000", "8017100012000706"),  # too long
        ("4099590000000000", "8099590000000206"),  # no such object
        ("4018100900000000", "8018100911000906"),  # no such sub-index
        ("2341600000000000", "8041600002000106"),  # read only
        ("2b07600009000000", "8007600031000906"),  # above the high limit
        ("a000100004000000", "8000100001000405"),  # block upload
        ("c600100000000000", "8000100001000405"),  # block download
    ],
)
def test_expedited_transfers(request_: str, reply: str) -> None:
    assert Wire().sdo(request_) == reply


def test_a_name_comes_in_segments() -> None:
    wire = Wire()
    wire.slave.objects.entries[0x1008, 0].value = b"misbehaving"
    assert wire.sdo("4008100000000000") == "410810000b000000"
    assert wire.sdo("6000000000000000") == "00" + b"misbeha".hex()
    assert wire.sdo("7000000000000000") == "17" + b"ving".hex() + "000000"


def test_a_toggle_bit_that_does_not_alternate_aborts() -> None:
    wire = Wire()
    wire.slave.objects.entries[0x1008, 0].value = b"misbehaving"
    wire.sdo("4008100000000000")
    assert wire.sdo("7000000000000000") == "8008100000000305"


def test_a_download_in_segments() -> None:
    wire = Wire()
    assert wire.sdo("2116100104000000") == "6016100100000000"
    assert wire.sdo("0764007f00000000") == "2000000000000000"
    assert wire.read(0x1016, 1) == 0x007F0064


def test_refused_and_delayed_replies() -> None:
    wire = Wire()
    wire.slave.inject("sdo refused")
    assert wire.sdo("4000100000000000") == "8000100022000008"
    wire.slave.mend("sdo refused")
    wire.slave.inject("sdo delayed", 0.2)
    assert wire.sdo("4000100000000000") == ""
    assert wire.wait(0.199) == []
    assert [frame.identifier for frame in wire.wait(0.003)] == [0x581]


def test_pythons_canopen_reads_and_writes_it() -> None:
    channel = f"slave-{os.getpid()}-canopen"
    network = canopen.Network()
    network.connect(interface="virtual", channel=channel)
    try:
        node = network.add_node(3, str(GENERIC))
        booted = threading.Event()
        node.nmt.add_heartbeat_callback(lambda _state: booted.set())
        with SlavesOnBus([Slave.from_file(GENERIC, 3)], channel):
            assert booted.wait(10.0), "before its boot-up a node answers no SDO"
            node.sdo.RESPONSE_TIMEOUT = 5.0
            assert node.sdo[0x1000].raw == 0x00020192
            node.sdo[0x607A].raw = -12345
            assert node.sdo[0x607A].raw == -12345
            with pytest.raises(canopen.SdoAbortedError, match="0x06010002"):
                node.sdo.download(0x6041, 0, b"\0\0")
    finally:
        network.disconnect()


def test_files_with_faults_are_read(tmp_path: Path) -> None:
    path = tmp_path / "odd.dcf"
    path.write_text(
        "junk before\n[Comments]\nLines=1\n[Comments]\nLines=2\n[OptionalObjects]\n1=0x1017\n"
        "1=0x6041\n7=0x9999\n[1017]\nObjectType=0x7\nDataType=0x0006\nAccessType=RW\n"
        "DefaultValue=0x10 ; ms\n[1200]\nObjectType=9\n[1200sub1]\nDataType=7\n"
        "DefaultValue=$NodeID+0x600\nAccessType=ro\n[607D]\nObjectType=8\n[607Dsub1]\n"
        "DataType=0x0004\nDefaultValue=0xFFFFFFFE\nAccessType=rw\n"
        "[1003]\nObjectType=8\nCompactSubObj=2\nDataType=7\nAccessType=ro\n",
        encoding="latin-1",
    )
    objects = read(path, 5)
    assert objects.get(0x1017) == 16
    assert objects.get(0x1200, 1) == 0x605
    assert objects.get(0x607D, 1) == -2
    assert [objects.has(0x1003, sub) for sub in range(4)] == [True, True, True, False]


_INVALID, _NO_RTR = 1 << 31, 1 << 30


def mapped(first: int, entries: tuple[int, ...], kind: int, wire: Wire | None = None) -> Wire:
    """A slave, operational, with RPDO 1 (1400h) or TPDO 1 (1800h) set up by the rules."""
    wire = wire or Wire()
    cob = 0x201 if first == 0x1400 else _NO_RTR | 0x181
    steps = [
        (first, 1, cob | _INVALID, 4),
        (first, 2, kind, 1),
        (first + 0x200, 0, 0, 1),
        *((first + 0x200, n, entry, 4) for n, entry in enumerate(entries, 1)),
        (first + 0x200, 0, len(entries), 1),
        (first, 1, cob, 4),
    ]
    for index, sub, value, size in steps:
        assert wire.write(index, sub, value, size).startswith("60"), f"{index:04X}h:{sub}"
    wire.start()
    wire.frames.clear()
    return wire


def first(wire: Wire, syncs: int = 1) -> list[Frame]:
    """What TPDO 1 says to a SYNC, or to several."""
    frames = [frame for _ in range(syncs) for frame in wire.send(0x080)]
    return [frame for frame in frames if frame.identifier == 0x181]


def test_set_up_has_an_order() -> None:
    wire = Wire()
    assert wire.write(0x1600, 0, 0, 1).endswith("00000106"), "mapping of a valid PDO"
    assert wire.write(0x1400, 1, 0x222, 4).endswith("30000906"), "COB-ID of a valid PDO"
    wire.write(0x1400, 1, _INVALID | 0x201, 4)
    assert wire.write(0x1600, 1, 0x60400010, 4).endswith("00000106"), "entries while sub 0 is set"
    wire.write(0x1600, 0, 0, 1)
    assert wire.write(0x1600, 1, 0x60410010, 4).endswith("41000406"), "a read-only object"
    assert wire.write(0x1600, 1, 0x59990010, 4).endswith("00000206"), "no such object"
    for sub in (1, 2, 3):
        wire.write(0x1600, sub, 0x60FF0020, 4)
    assert wire.write(0x1600, 0, 3, 1).endswith("42000406"), "96 bits"


def test_a_synchronous_rpdo_acts_with_the_next_sync() -> None:
    wire = mapped(0x1400, (0x60400010, 0x60FF0020), 1)
    wire.send(0x201, "0600e8030000")
    assert (wire.status(), wire.read(0x60FF)) == (0x40, 0)
    wire.send(0x080)
    assert (wire.status(), wire.read(0x60FF)) == (0x21, 1000)


def test_an_asynchronous_rpdo_acts_at_once() -> None:
    wire = mapped(0x1400, (0x60400010,), 255)
    wire.send(0x201, "0600")
    assert wire.status() == 0x21


def test_a_short_rpdo_is_reported_and_not_taken() -> None:
    wire = mapped(0x1400, (0x60400010, 0x60FF0020), 255)
    assert emergencies(wire.send(0x201, "0600")) == [0x8210]
    assert wire.status() == 0x40


def test_a_synchronous_tpdo_answers_every_nth_sync() -> None:
    wire = mapped(0x1800, (0x60410010, 0x60610008), 3)
    sent = [len(first(wire)) for _ in range(6)]
    assert sent == [0, 0, 1, 0, 0, 1]
    assert first(wire, 3) == [Frame(0x181, bytes.fromhex("500200"))]


def test_type_0_answers_a_sync_after_a_change() -> None:
    wire = mapped(0x1800, (0x60410010,), 0)
    assert [len(first(wire)) for _ in range(3)] == [1, 0, 0]
    wire.write(0x6040, 0, 6, 2)
    wire.wait(0.002)
    assert [len(first(wire)) for _ in range(2)] == [1, 0]


def test_an_event_tpdo_comes_on_change_and_by_its_timer() -> None:
    wire = mapped(0x1800, (0x60410010,), 255)
    wire.wait(0.01)
    wire.frames.clear()
    wire.write(0x6040, 0, 6, 2)
    assert [f.data.hex() for f in wire.wait(0.01)] == ["3102"]
    wire.write(0x1800, 5, 20, 2)
    assert len(wire.wait(0.1)) == pytest.approx(5, abs=1)


def test_an_rpdo_that_stays_away_is_reported() -> None:
    wire = Wire()
    wire.slave.objects.declare(0x1400, 5, 6, 50)
    wire = mapped(0x1400, (0x60400010,), 255, wire)
    assert emergencies(wire.wait(1.0)) == [], "not armed before the first"
    wire.send(0x201, "0600")
    assert emergencies(wire.wait(0.049)) == []
    assert emergencies(wire.wait(0.003)) == [0x8250]
    assert wire.status() == 0x08


def test_a_lost_sync_is_a_fault_in_a_cyclic_mode() -> None:
    wire = Wire()
    wire.write(0x1006, 0, 4000, 4)
    wire.start()
    for _ in range(20):
        wire.send(0x080)
        wire.wait(0.004)
    assert emergencies(wire.wait(1.0)) == [], "not enabled"
    wire.enable(9)
    wire.send(0x080)
    wire.wait(0.004)
    wire.send(0x080)
    assert emergencies(wire.wait(0.008)) == [0x8700]
    assert wire.status() in (0x0F, 0x08)


@pytest.mark.parametrize(("lost", "left"), [(None, []), ({1}, [0x281]), ({2}, [0x181])])
def test_tpdos_are_lost_by_number(lost: set[int] | None, left: list[int]) -> None:
    wire = Wire()
    for number in (1, 2):
        wire.write(0x1800 + number - 1, 1, 1 << 31, 4)
        wire.write(0x1800 + number - 1, 2, 1, 1)
        wire.write(0x1800 + number - 1, 1, 0x180 + 0x100 * (number - 1) + 1, 4)
    wire.start()
    wire.slave.inject("tpdo lost", lost)
    assert [f.identifier for f in wire.send(0x080) if f.identifier < 0x300] == left
