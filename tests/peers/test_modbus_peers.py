"""Programs that share no code with us: Debian's mbpoll as a client, libmodbus as a server."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from command_line import own_process
from served import Served
from waiting import until
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import DeviceRefused
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device
from winchkit.sim.instruments.modbus_line import PtyCable

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Debian's peers, pseudo-terminals")
NEEDS_MBPOLL = pytest.mark.skipif(
    shutil.which("mbpoll") is None, reason="mbpoll is missing: apt-get install mbpoll"
)
CLOCK = MonotonicClock()
_VALUE = re.compile(r"^\[(\d+)\]:\s+(?:0x)?([0-9A-Fa-f]+)", re.MULTILINE)


def mbpoll(served: Served, *arguments: str, values: tuple[str, ...] = ()) -> tuple[int, str]:
    """Run it once against a simulated cell at unit 1, addresses from 0."""
    if served.serial:
        line = ["-m", "rtu", "-b", "115200", "-P", "none"]
        where = served.line.port
    else:
        where, port = served.line.address
        line = ["-m", "tcp", "-p", str(port)]
    words = ["mbpoll", *line, "-a", "1", "-0", "-1", "-o", "1", *arguments, where, *values]
    done = own_process(*words, code=None)
    return done.returncode, done.stdout + done.stderr


def words_of(text: str) -> list[int]:
    """Registers that mbpoll printed."""
    return [int(word, 16) for _, word in _VALUE.findall(text)]


@NEEDS_MBPOLL
@pytest.mark.parametrize("serial", [False, True], ids=["tcp", "pty"])
def test_mbpoll_reads_and_writes_a_simulated_cell(serial: bool) -> None:
    """Status in register 0, counts of 0.01 N in 1 and 2; 1 in register 8 tares, status bit 3."""
    with Served("generic-modbus", serial=serial, noise=0.0, force=1234.56) as served:
        code, text = mbpoll(served, "-r", "0", "-c", "3", "-t", "4:hex")
        assert code == 0, text
        status, high, low = words_of(text)
        assert (high << 16 | low, status & 8) == (123456, 0)
        code, text = mbpoll(served, "-r", "8", "-t", "4", values=("1",))
        assert code == 0, text
        served.force = 2000.0
        code, text = mbpoll(served, "-r", "0", "-c", "3", "-t", "4:hex")
        status, high, low = words_of(text)
        assert (high << 16 | low, status & 8) == (200000 - 123456, 8)


@NEEDS_MBPOLL
def test_mbpoll_reads_a_simulated_tlb_as_the_manual_has_it() -> None:
    with Served("laumas-tlb", noise=0.0, force=-123.45) as served:
        code, text = mbpoll(served, "-r", "6", "-c", "7", "-t", "4:hex")
        assert code == 0, text
        status, *weights = words_of(text)
        assert [high << 16 | low for high, low in zip(weights[::2], weights[1::2], strict=True)][
            :2
        ] == [12345, 12345]
        assert status & (1 << 7 | 1 << 8) == 1 << 7 | 1 << 8


@NEEDS_MBPOLL
def test_mbpoll_is_refused_what_a_tlb_refuses() -> None:
    with Served("laumas-tlb") as served:
        code, text = mbpoll(served, "-r", "5", "-t", "4", values=("7",))
        assert code != 0
        assert "Illegal function" in text
        code, text = mbpoll(served, "-r", "200", "-c", "2", "-t", "4:hex")
        assert "Illegal data address" in text


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The libmodbus server, compiled."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler: apt-get install gcc")
    if not any(Path(folder, "modbus/modbus.h").is_file() for folder in ("/usr/include",)):
        pytest.skip("libmodbus is missing: apt-get install libmodbus-dev")
    target = tmp_path_factory.mktemp("peer") / "server"
    source = Path(__file__).with_name("libmodbus_server.c")
    include = "-I/usr/include/modbus"
    words = [compiler, "-Wall", "-Werror", include, str(source), "-lmodbus", "-o", str(target)]
    subprocess.run(words, check=True, timeout=60)
    return target


@pytest.fixture(params=["tcp", "pty"])
def bus(server: Path, request: pytest.FixtureRequest) -> Iterator[BusSpec]:
    """A running server and the line to it."""
    cable = PtyCable() if request.param == "pty" else None
    process = subprocess.Popen(
        [server, cable.near if cable else "tcp"], stdout=subprocess.PIPE, text=True
    )
    told = process.stdout.readline().strip()
    try:
        if cable:
            yield BusSpec("modbus-rtu", port=cable.far, timeout=0.5)
        else:
            yield BusSpec("modbus-tcp", host="127.0.0.1", port=int(told), timeout=0.5)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        if cable:
            cable.close()


def test_our_reader_reads_and_tares_libmodbus(bus: BusSpec) -> None:
    device = read_device(catalog.find("devices", "laumas-tlb"))
    instrument = Instrument("cell", device, 1, CLOCK, rate=50.0, timeout=0.5)
    slow = SlowDevices([ModbusLine("cells", bus, (instrument,), CLOCK)])
    try:
        until(lambda: instrument.counters.readings > 10)
        reading = instrument.latest
        assert reading.value == pytest.approx(-25.0)
        assert reading.gross == pytest.approx(123.45)
        assert slow.identify(instrument)["serial number"] == 815
        assert instrument.tared is False
        slow.command(instrument, "tare")
        assert instrument.tared is True
        with pytest.raises(DeviceRefused, match="did not confirm it"):
            slow.command(instrument, "gross")
        counters = instrument.counters
        assert counters.crc == counters.timeouts == counters.malformed == counters.late == 0
    finally:
        slow.close()
