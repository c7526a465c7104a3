"""One drive, one witness and a way to each bus: what the conformance suite stands on."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus

from drive_server import HOST, NODE, DriveServer
from sim_process import free_port
from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.schema.bench import BenchSpec, BusSpec, DeviceRef, LimitSpec, WinchWiring

HEARTBEAT = 0.2
SERVER = Path(__file__).with_name("drive_server.py")
_GROUP = "239.74.163.2"
_MARK = 0x7DF
"""An identifier that no other node uses."""
_SO_RCVBUFFORCE, _RECEIVE_BUFFER = 33, 4_000_000
"""Of <asm-generic/socket.h>, for a buffer above net.core.rmem_max; bytes."""


@dataclass(frozen=True)
class Seen:
    """A frame as the witness saw it."""

    time: float
    identifier: int
    data: bytes


class Witness:
    """Keeps every frame on a bus, and speaks as another master would, by connections of its own."""

    def __init__(self, options: dict[str, Any]) -> None:
        self._ear, self._mouth = can.Bus(**options), can.Bus(**options)
        if isinstance(self._ear, SocketcanBus):
            # As candump beside it: what this thread does not read at once is kept.
            self._ear.socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _RECEIVE_BUFFER)
        self._frames: list[Seen] = []
        self._all: list[Seen] = []
        self._marks = 0
        self._heard = threading.Condition()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="witness", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stopping.is_set():
            message = self._ear.recv(0.02)
            if message is None:
                continue
            seen = Seen(time.monotonic(), message.arbitration_id, bytes(message.data))
            with self._heard:
                self._all.append(seen)
                self._frames.append(seen)
                self._heard.notify_all()

    def close(self) -> None:
        """End it; where another witness listens too, leave what this one saw for comparison."""
        self._stopping.set()
        self._thread.join()
        self._ear.shutdown()
        self._mouth.shutdown()
        if "WINCHKIT_TEST_SEEN" in os.environ:
            with Path(os.environ["WINCHKIT_TEST_SEEN"]).open("a", encoding="ascii") as file:
                file.writelines(f"{f.identifier:03X}#{f.data.hex().upper()}\n" for f in self._all)

    def forget(self) -> None:
        """Forget everything up to now."""
        self._catch_up()
        with self._heard:
            self._frames.clear()

    @property
    def frames(self) -> list[Seen]:
        """Everything that was sent before this call."""
        self._catch_up()
        with self._heard:
            return [frame for frame in self._frames if frame.identifier != _MARK]

    def _catch_up(self) -> None:
        """Send a mark and wait until it is heard, since what was sent before it is heard too."""
        self._marks += 1
        mark = self._marks.to_bytes(4, "little")
        self.send(_MARK, mark)
        with self._heard:
            heard = self._heard.wait_for(
                lambda: any(f.identifier == _MARK and f.data == mark for f in self._frames[-200:]),
                timeout=10.0,
            )
        assert heard, "the witness does not hear itself"

    def send(self, identifier: int, data: bytes) -> None:
        """Speak as another master would."""
        self._mouth.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def words(self) -> list[int]:
        """Control words that the host has sent, by PDO and by SDO, in order."""
        found = []
        for frame in self.frames:
            if frame.identifier == 0x200 + NODE and len(frame.data) >= 2:
                found.append(int.from_bytes(frame.data[:2], "little"))
            elif _writes_control_word(frame):
                found.append(int.from_bytes(frame.data[4:6], "little"))
        return found

    def writes(self) -> list[tuple[int, int, int]]:
        """Index, sub-index and value of every expedited SDO download, in order."""
        return [
            (
                int.from_bytes(f.data[1:3], "little"),
                f.data[3],
                int.from_bytes(f.data[4:8], "little"),
            )
            for f in self.frames
            if f.identifier == 0x600 + NODE and f.data[0] & 0xE0 == 0x20
        ]


def _writes_control_word(frame: Seen) -> bool:
    to_drive, data = frame.identifier == 0x600 + NODE, frame.data
    return to_drive and data[0] & 0xE0 == 0x20 and data[1:4] == b"\x40\x60\x00"


class RemoteDrive:
    """A drive server in a process of its own, with the methods of ``DriveServer``."""

    def __init__(self, options: dict[str, Any]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(SERVER), json.dumps(options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._read() == "ready"

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def ask(*arguments: Any) -> Any:
            self._process.stdin.write(json.dumps([name, *arguments]) + "\n")
            self._process.stdin.flush()
            return self._read()

        return ask

    def _read(self) -> Any:
        line = self._process.stdout.readline()
        assert line, "the drive's process has ended"
        return json.loads(line)

    def close(self) -> None:
        self._process.communicate(timeout=20)
        assert self._process.returncode == 0


@dataclass(frozen=True)
class Transport:
    """A way to a bus: how to open it, and how quick the machine behind it is."""

    name: str
    spec: BusSpec
    cycle: float = 0.008
    remote: bool = True

    @property
    def options(self) -> dict[str, Any]:
        found: dict[str, Any] = {"interface": self.spec.interface, "channel": self.spec.channel}
        return found if self.spec.port is None else {**found, "port": int(self.spec.port)}


def transport(name: str) -> Transport:
    """A bus of its own for this process; skips where this machine has none."""
    here = BusSpec("can", node=HOST, heartbeat=HEARTBEAT)
    if name == "virtual":
        channel = f"conformance-{os.getpid()}-{os.urandom(3).hex()}"
        return Transport(name, replace(here, interface=name, channel=channel), remote=False)
    if name == "udp_multicast":
        port = free_port(_GROUP)
        return Transport(name, replace(here, interface=name, channel=_GROUP, port=port))
    channel = os.environ["WINCHKIT_TEST_CAN"]
    return Transport(name, replace(here, interface=name, channel=channel), cycle=0.02)


@dataclass
class Rig:
    """A drive on a bus, and who watches it."""

    transport: Transport
    drive: Any
    """A DriveServer or a RemoteDrive."""
    witness: Witness
    limits: LimitSpec = field(default_factory=lambda: LimitSpec(speed=0.6, acceleration=1.5))

    @property
    def bench_spec(self) -> BenchSpec:
        wiring = WinchWiring(
            profile="bench-spiral",
            servo=DeviceRef("generic-cia402", "can", node=NODE, encoder="absolute"),
            limits=self.limits,
            brake=True,
        )
        return BenchSpec(
            "conformance", {"A": wiring}, {"can": self.transport.spec}, cycle=self.transport.cycle
        )

    @contextmanager
    def bench(self) -> Iterator[Bench]:
        with open_bench(self.bench_spec) as bench:
            yield bench

    def state(self) -> str:
        return str(self.drive.see()["state"])

    def states(self) -> list[str]:
        """States that the drive went through since ``forget``."""
        return [state for _, state, _ in self.drive.see()["record"]]

    def forget(self) -> None:
        self.drive.forget()
        self.witness.forget()

    def until(self, condition: Callable[[], bool], within: float = 10.0) -> None:
        deadline = time.monotonic() + within
        while not condition():
            assert time.monotonic() < deadline, f"it did not come to that: {self.drive.see()}"
            time.sleep(0.005)

    def wait(self, duration: float) -> None:
        """Let the drive's world go on."""
        time.sleep(duration)


@contextmanager
def opened(name: str) -> Iterator[Rig]:
    """A drive and a witness on a bus."""
    way = transport(name)
    witness = Witness(way.options)
    try:
        drive = (RemoteDrive if way.remote else DriveServer)(way.options)
        try:
            yield Rig(way, drive, witness)
        finally:
            drive.close()
    finally:
        witness.close()
