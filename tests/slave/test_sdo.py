"""The slave's SDO server against the bytes of CiA 301, and python's canopen as its client."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import canopen
import pytest

from slave import Slave, read
from slave.on_bus import SlavesOnBus
from slave.wire import GENERIC, Wire


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
