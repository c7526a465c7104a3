"""Branches for Windows and macOS, on a simulated system: what they call, and what they refuse.

The modules see another ``sys``, or a ``socket``, ``signal`` or ``termios`` without what the system
lacks; nothing here runs on that system (.github/workflows/ci.yml does).
"""

from __future__ import annotations

import importlib
import io
import os
import selectors
import signal
import socket
import sys
from contextlib import closing, nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from winchkit.bench import ownership
from winchkit.bench.control import computer, realtime
from winchkit.bench.records import record_file
from winchkit.bench.remote import interruption, process
from winchkit.cli.bench import keyboard_jog
from winchkit.cli.core import standard_input
from winchkit.drivers import unplugged
from winchkit.drivers.can.bus import interface
from winchkit.errors import ConnectionLost, NotPermitted
from winchkit.fleet.library import cluster
from winchkit.runs.recording import log_file
from winchkit.schema.bench import BenchSpec, BusSpec
from winchkit.sim.instruments import modbus_line, stream_line


def on(monkeypatch: pytest.MonkeyPatch, module: ModuleType, system: str, **more: Any) -> None:
    monkeypatch.setattr(module, "sys", SimpleNamespace(platform=system, **more))


def without(module: Any, *names: str) -> SimpleNamespace:
    return SimpleNamespace(**{n: getattr(module, n) for n in dir(module) if n not in names})


@pytest.fixture
def msvcrt(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """What Windows has: keys that wait, and locks of bytes."""
    fake = SimpleNamespace(LK_NBLCK=2, waiting=[], locked=[], failure=None)
    fake.kbhit = lambda: bool(fake.waiting)
    fake.getwch = lambda: fake.waiting.pop(0)

    def locking(descriptor: int, mode: int, count: int) -> None:
        if fake.failure is not None:
            raise fake.failure
        fake.locked.append((os.lseek(descriptor, 0, os.SEEK_CUR), mode, count))

    fake.locking = locking
    monkeypatch.setitem(sys.modules, "msvcrt", fake)
    return fake


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> BenchSpec:
    monkeypatch.setattr(ownership.tempfile, "gettempdir", lambda: str(tmp_path))
    return BenchSpec("b", {"can": BusSpec("can", interface="virtual", channel="c")}, {})


def test_keys_of_windows_are_those_of_a_terminal(
    monkeypatch: pytest.MonkeyPatch, msvcrt: SimpleNamespace
) -> None:
    on(monkeypatch, keyboard_jog, "win32")
    msvcrt.waiting[:] = ["\xe0", "H", "\x00", "P", "\xe0", "G", "q"]
    with keyboard_jog.open_keys() as keys:
        assert keys.read(0.0) == ["up", "down", "q"]
        assert keys.read(0.0) == []


def test_what_was_typed_before_a_question_is_forgotten(
    monkeypatch: pytest.MonkeyPatch, msvcrt: SimpleNamespace
) -> None:
    on(monkeypatch, standard_input, "win32", stdin=SimpleNamespace(isatty=lambda: True))
    msvcrt.waiting[:] = list("yes")
    standard_input.forget_typed()
    assert not msvcrt.waiting


@pytest.mark.parametrize("system", ["darwin", "win32"])
def test_multicast_needs_no_call_of_linux(monkeypatch: pytest.MonkeyPatch, system: str) -> None:
    from winchkit import multicast

    on(monkeypatch, multicast, system)
    monkeypatch.setattr(selectors, "DefaultSelector", selectors.SelectSelector)
    if system == "win32":

        class Socket(socket.socket):
            """A socket of Windows."""

            recvmsg = property()

        fake = without(socket, "AF_UNIX")
        fake.socket = Socket
        monkeypatch.setattr(multicast, "socket", fake)
    try:
        first, second = (multicast.MulticastPort("239.74.163.2", 43941) for _ in "ab")
        with closing(first), closing(second):
            first.send(0x181, b"12345678")
            assert second.receive(2.0) == (0x181, b"12345678")
            assert second.arrived == 0.0, "no time stamps of the kernel"
            assert first.receive(0.05) is None, "what it has sent itself"
    except OSError as error:
        pytest.skip(f"no multicast on this machine: {error}")


@pytest.mark.parametrize(
    ("failure", "state"),
    [
        (None, log_file.Lock.HELD),
        (PermissionError(13, "in use"), log_file.Lock.BUSY),
        (OSError(22, "no locks"), log_file.Lock.UNSUPPORTED),
    ],
)
def test_a_log_is_locked_beyond_its_readers(
    monkeypatch: pytest.MonkeyPatch,
    msvcrt: SimpleNamespace,
    tmp_path: Path,
    failure: OSError | None,
    state: log_file.Lock,
) -> None:
    on(monkeypatch, log_file, "win32")
    msvcrt.failure = failure
    places: list[int] = []
    fake = without(os)
    fake.lseek = lambda descriptor, place, whence: places.append(place)
    monkeypatch.setattr(log_file, "os", fake)
    with (tmp_path / "log").open("wb") as file:
        assert log_file.lock_file(file.fileno()) is state
    assert places == ([1 << 62] if failure else [1 << 62, 0])


@pytest.mark.skipif(sys.platform != "linux", reason="open files by /proc")
def test_an_earlier_log_is_closed_before_it_is_removed(
    monkeypatch: pytest.MonkeyPatch, msvcrt: SimpleNamespace, tmp_path: Path
) -> None:
    on(monkeypatch, log_file, "win32")
    monkeypatch.setattr(log_file, "_FAR", 1 << 30)  # not every file system here has 1 << 62
    earlier, unlink = tmp_path / "log.001.csv", Path.unlink
    earlier.write_text("old")

    def removing(path: Path) -> None:
        open_now = [Path(os.path.realpath(link)) for link in Path("/proc/self/fd").iterdir()]
        assert earlier not in open_now
        unlink(path)

    monkeypatch.setattr(Path, "unlink", removing)
    log_file.begin_log(tmp_path / "log.csv", tmp_path / "log.csv", replace=True).close()
    assert not earlier.exists()


def test_a_record_is_closed_before_it_is_replaced_or_removed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    on(monkeypatch, record_file, "win32")
    record = record_file.RecordFile(str(tmp_path / "record"))
    real = os.replace

    def replace(draft: str, path: str) -> None:
        assert not record.is_open
        real(draft, path)

    def unlink(path: str) -> None:
        with pytest.raises(OSError, match="Bad file"):
            os.fstat(descriptor)
        os.remove(path)

    fake = without(os)
    fake.replace, fake.unlink = replace, unlink
    monkeypatch.setattr(record_file, "os", fake)
    assert record.open("old").split() == [b"old"]
    record.replace("new")
    assert record.is_open
    assert Path(record.path).read_text().split() == ["new"]
    descriptor = record._descriptor
    assert descriptor is not None
    record.close(remove=True)
    assert not Path(record.path).exists()


def test_a_bench_is_owned_by_a_lock_of_windows(
    monkeypatch: pytest.MonkeyPatch, msvcrt: SimpleNamespace, bench: BenchSpec
) -> None:
    on(monkeypatch, ownership, "win32")
    with closing(ownership.Ownership(bench, "first")):
        msvcrt.failure = PermissionError(13, "in use")
        with pytest.raises(NotPermitted, match="owned by first"):
            ownership.Ownership(bench)
    assert msvcrt.locked == [(0, 2, 1)]


def test_an_owner_without_unix_sockets_is_found_on_the_loopback(
    monkeypatch: pytest.MonkeyPatch, bench: BenchSpec
) -> None:
    monkeypatch.setattr(ownership, "socket", without(socket, "AF_UNIX"))
    assert ownership.connect_to_owner(bench) is None
    server, path = ownership.listen(bench)
    with server:
        client = ownership.connect_to_owner(bench)
        assert client is not None
        with client, server.accept()[0] as taken:
            assert taken.getsockname()[0] == "127.0.0.1"
    assert path.suffix == ".port"
    assert ownership.connect_to_owner(bench) is None, "its owner has ended"


def test_the_bench_process_of_windows_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, bench: BenchSpec
) -> None:
    given: dict[str, Any] = {}

    class Process:
        """Runs as long as the bench is open."""

        def __init__(self, command: list[str], **options: Any) -> None:
            given.update(options)
            self.stdout = io.BytesIO(b'{"ok": true}\n')

        def wait(self) -> int:
            raise AssertionError("it ends only after the client")

    on(monkeypatch, process, "win32", executable=sys.executable)
    fake = without(process.subprocess)
    fake.Popen, fake.CREATE_NEW_PROCESS_GROUP = Process, 0x200
    monkeypatch.setattr(process, "subprocess", fake)
    assert process.spawn(bench) is None
    assert given["creationflags"] == 0x200


def test_signals_that_a_system_lacks_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruption, "signal", without(signal, "SIGHUP"))
    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(interruption, "_REPLACED", (before, signal.SIG_DFL))
    with interruption.interrupted_by_signals() as got:
        assert signal.getsignal(signal.SIGINT) == got.take
        assert signal.getsignal(signal.SIGTERM) == got.take
    assert signal.getsignal(signal.SIGINT) is before


def test_workers_start_without_signal_masks(monkeypatch: pytest.MonkeyPatch) -> None:
    on(monkeypatch, cluster, "win32")
    monkeypatch.setattr(cluster, "signal", without(signal, "pthread_sigmask", "SIG_BLOCK"))
    with cluster._without_sigint():
        pass


@pytest.mark.parametrize("system", ["darwin", "win32"])
def test_real_time_settings_are_those_of_linux(
    monkeypatch: pytest.MonkeyPatch, system: str
) -> None:
    on(monkeypatch, computer, system)
    on(monkeypatch, realtime, system)
    (item,) = computer.survey()
    assert (item.granted, item.detail) == (False, f"not available on {system}")
    assert realtime.acquire("try", ()).items == (item,)
    with pytest.raises(NotPermitted, match="use Linux"):
        realtime.acquire(True, ())


def test_windows_simulates_no_serial_line(monkeypatch: pytest.MonkeyPatch) -> None:
    on(monkeypatch, modbus_line, "win32")
    on(monkeypatch, stream_line, "win32")
    with pytest.raises(ConnectionLost, match="Modbus over TCP"):
        modbus_line.PtyCable()
    with pytest.raises(ConnectionLost, match="Linux or macOS"):
        stream_line.SimulatedStreamLine((), nullcontext, float).start()


def test_socketcan_elsewhere_names_the_adapters_interfaces(monkeypatch: pytest.MonkeyPatch) -> None:
    on(monkeypatch, interface, "win32")
    with pytest.raises(ConnectionLost, match="part of Linux"):
        interface.open_interface(BusSpec("can", interface="socketcan", channel="can0"), "can")


def test_a_port_without_termios_raises_errors_of_the_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = unplugged.UNPLUGGED
    monkeypatch.setitem(sys.modules, "termios", None)
    importlib.reload(unplugged)
    assert (OSError,) == unplugged.UNPLUGGED
    monkeypatch.undo()
    importlib.reload(unplugged)
    assert before == unplugged.UNPLUGGED
