"""A real port: the simulated line's pseudo-terminal, unplugged and plugged in; FTDI timers."""

from __future__ import annotations

import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from stream_rig import device
from waiting import until
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.slow import SlowDevices
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.line import StreamLine
from winchkit.drivers.stream.port import set_latency
from winchkit.errors import ConnectionLost, DeviceRefused
from winchkit.schema.bench import BusSpec
from winchkit.sim.instruments.stream import SimulatedStreamInstrument as SimInstrument
from winchkit.sim.instruments.stream import shown_by
from winchkit.sim.instruments.stream_line import SimulatedStreamLine as SimLine

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")


class Served:
    """A simulated instrument at a pseudo-terminal, and our line on it, in real time."""

    def __init__(self, name: str) -> None:
        found = device(name)
        assert found.stream is not None
        self.clock = MonotonicClock()
        self.truth = 5.0
        self.sim = SimInstrument(
            found.stream,
            shown_by(found.stream, lambda: self.truth),
            now=self.clock.now(),
            address=1,
        )
        self._lock = threading.Lock()
        self.port = SimLine([self.sim], self._up_to_date, self.clock.now)
        self.port.start()
        spec = BusSpec("serial", port=self.port.port)
        self.instrument = StreamInstrument(name, found, 1, self.clock, rate=100.0, timeout=0.2)
        self.slow = SlowDevices([StreamLine("cells", spec, (self.instrument,), self.clock)])

    @contextmanager
    def _up_to_date(self) -> Iterator[None]:
        with self._lock:
            while self.sim.next_conversion <= self.clock.now():
                self.sim.convert()
            self.sim.show(self.clock.now())
            yield

    def reads(self, value: float) -> bool:
        latest = self.instrument.latest
        return latest is not None and abs(latest.value - value) < 0.06

    def close(self) -> None:
        self.slow.close()
        self.port.stop()


@pytest.fixture(params=["laumas-tlb-ascii", "hbm-aed-binary", "hbm-aed-ascii"])
def served(request: pytest.FixtureRequest) -> Iterator[Served]:
    found = Served(request.param)
    yield found
    found.close()


def test_readings_over_a_real_port_follow_the_truth(served: Served) -> None:
    until(lambda: served.reads(5.0))
    served.truth = 7.5
    until(lambda: served.reads(7.5))
    until(lambda: served.instrument.counters.readings > 5)
    assert served.instrument.counters.crc == 0


def test_unplugging_is_noticed_and_ends_when_it_is_plugged_in(served: Served) -> None:
    until(lambda: served.reads(5.0))
    served.sim.inject("unplug")
    until(lambda: isinstance(served.instrument.problem, ConnectionLost))
    served.truth = 8.0
    served.sim.inject("replug")
    until(lambda: served.reads(8.0))
    assert served.instrument.problem is None
    assert served.instrument.counters.reconnects >= 1
    served.sim.inject("unplug")
    until(lambda: isinstance(served.instrument.problem, ConnectionLost))
    served.sim.inject("recover")
    until(lambda: served.instrument.problem is None)


def test_a_refusal_comes_through_to_the_caller() -> None:
    served = Served("flintec-ldu")
    try:
        until(lambda: served.reads(5.0))
        served.slow.command(served.instrument, "tare")
        until(lambda: served.reads(0.0))
        served.sim.inject("refusal")
        with pytest.raises(DeviceRefused, match="answers 'ERR'"):
            served.slow.command(served.instrument, "tare")
    finally:
        served.close()


def test_a_port_that_is_not_there_is_a_problem_with_its_name(tmp_path: Path) -> None:
    clock = MonotonicClock()
    one = StreamInstrument("x", device("flintec-ldu"), 1, clock, rate=10.0, timeout=0.1)
    spec = BusSpec("serial", port=str(tmp_path / "no-such-tty"))
    slow = SlowDevices([StreamLine("cells", spec, (one,), clock)])
    try:
        until(lambda: one.problem is not None)
        assert "no-such-tty): cannot be opened" in str(one.problem)
        with pytest.raises(ConnectionLost, match="no-such-tty"):
            slow.command(one, "tare")
    finally:
        slow.close()


def test_a_port_may_be_a_url_and_comes_back_when_the_server_does() -> None:
    """A serial server on the network: pyserial's socket:// needs no serial port at all."""

    def says(peer: socket.socket, value: float) -> bool:
        peer.sendall(f"{value}\n".encode())
        return one.latest is not None and one.latest.value == value

    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(20.0)
        clock = MonotonicClock()
        one = StreamInstrument("x", device("generic-line"), None, clock, rate=10.0, timeout=0.2)
        spec = BusSpec("serial", port=f"socket://127.0.0.1:{server.getsockname()[1]}")
        slow = SlowDevices([StreamLine("cells", spec, (one,), clock)])
        try:
            for value in (1.5, 2.5):
                peer, _ = server.accept()
                with peer:
                    until(lambda: says(peer, value))  # noqa: B023 - done within the turn
            assert one.counters.reconnects >= 1
        finally:
            slow.close()


def test_a_port_belongs_to_one_reader(served: Served) -> None:
    until(lambda: served.reads(5.0))
    clock = MonotonicClock()
    second = StreamInstrument("y", device("generic-line"), None, clock, rate=10.0, timeout=0.2)
    slow = SlowDevices(
        [StreamLine("again", BusSpec("serial", port=served.port.port), (second,), clock)]
    )
    try:
        until(lambda: second.problem is not None)
        assert "no other program has it open" in str(second.problem)
    finally:
        slow.close()


def timer(folder: Path, value: str = "16\n") -> Path:
    found = folder / "ttyUSB7" / "latency_timer"
    found.parent.mkdir()
    found.write_text(value)
    return found


def test_an_adapters_latency_timer_is_set(tmp_path: Path) -> None:
    found = timer(tmp_path)
    assert set_latency("/dev/ttyUSB7", tmp_path) == (1e-3, "")
    assert found.read_text() == "1"


@pytest.fixture
def read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """No user may write; the file's mode does not keep root from it."""

    def refuse(*_: object, **__: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "write_text", refuse)


def test_a_timer_that_cannot_be_set_is_reported(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    timer(tmp_path)
    request.getfixturevalue("read_only")
    latency, note = set_latency("/dev/ttyUSB7", tmp_path)
    assert latency == 16e-3
    assert "cannot be set (Permission denied); write 1 into it" in note
    assert "16 ms late" in note


def test_a_timer_that_makes_no_sense_is_reported(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    timer(tmp_path, "x")
    request.getfixturevalue("read_only")
    latency, note = set_latency("/dev/ttyUSB7", tmp_path)
    assert latency == 1e-3
    assert "cannot be read" in note


def test_a_port_without_a_timer_needs_none(tmp_path: Path) -> None:
    assert set_latency("/dev/ttyS0", tmp_path) == (1e-3, "")
