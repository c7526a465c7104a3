"""A simulated drive on any CAN bus, with a record of its own: in a thread, or in a process.

As a program it reads one JSON request a line and answers each with one line.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from pathlib import Path
from typing import Any

import can

from flywheel import Flywheel
from winchkit import catalog
from winchkit.schema.read import read_device
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import ObjectDictionary, read_eds

NODE, HOST = 1, 127
_WAIT = 1e-3


class DriveServer:
    """Runs a drive until closed; every method may be called from another thread.

    ``record`` has a row whenever the drive's state changes: time (s, of this machine's steady
    clock), state, motor speed.
    """

    def __init__(
        self, options: dict[str, Any], node: int = NODE, *, brake: bool = True, boot: float = 0.01
    ) -> None:
        self._bus = can.Bus(**options)
        self._node, self._brake, self._boot = node, brake, boot
        self.frames: list[tuple[int, bytes]] = []
        """All that came."""
        self.lock = threading.Lock()
        self._stopping = threading.Event()
        self.renew()
        self._thread = threading.Thread(target=self._run, name="drive", daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stopping.set()
        self._thread.join()
        self._bus.shutdown()

    def renew(self, device: str = "generic-cia402") -> None:
        """Put a new drive in the place of the old one; it is switched on."""
        declared = read_device(catalog.find("devices", device))
        eds = Path(declared.path).parent / declared.servo.eds
        with self.lock:
            now = time.monotonic()
            self.record: list[tuple[float, str, float]] = []
            self.host_heard = self.at_rest_since = self.worst_gap = 0.0
            self.shaft = Flywheel()
            self.drive = SimDrive(
                self._send,
                self._node,
                declared.servo,
                ObjectDictionary(read_eds(eds, self._node)),
                self.shaft,
                brake=self._brake,
                now=now,
            )
            self.drive.power_on(now, boot_time=self._boot)
            self._last = now

    def see(self) -> dict[str, Any]:
        """How it is now."""
        with self.lock:
            return {
                "state": self.drive.state.name,
                "nmt": self.drive.nmt.name,
                "velocity": self.shaft.motor_velocity,
                "angle": self.shaft.motor_angle,
                "error": self.drive.error_code,
                "host_heard": self.host_heard,
                "at_rest_since": self.at_rest_since,
                "worst_gap": self.worst_gap,
                "record": list(self.record),
            }

    def number(self, index: int, sub: int = 0) -> int:
        with self.lock:
            return self.drive.objects.number(index, sub)

    def put(self, index: int, sub: int, value: int) -> None:
        with self.lock:
            self.drive.objects.put(index, sub, value)

    def inject(self, kind: str) -> None:
        with self.lock:
            self.drive.inject(kind)

    def forget(self) -> None:
        """Begin the record anew."""
        with self.lock:
            self.record.clear()
            self.worst_gap = 0.0

    def _send(self, identifier: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def _run(self) -> None:
        while not self._stopping.is_set():
            message = self._bus.recv(_WAIT)
            with self.lock:
                now = time.monotonic()
                if message is not None and not message.is_error_frame:
                    identifier, data = message.arbitration_id, bytes(message.data)
                    if identifier == 0x700 + HOST:
                        self.host_heard = now
                    self.frames.append((identifier, data))
                    self.drive.receive(identifier, data, now)
                self.drive.tick(now)
                self._note(now)

    def _note(self, now: float) -> None:
        self.worst_gap = max(self.worst_gap, now - self._last)
        self._last = now
        if abs(self.shaft.motor_velocity) > 0.05:
            self.at_rest_since = math.inf
        elif math.isinf(self.at_rest_since):
            self.at_rest_since = now
        state = self.drive.state.name
        if not self.record or self.record[-1][1] != state:
            self.record.append((now, state, self.shaft.motor_velocity))


def main() -> None:
    """Serve requests on the standard input until it ends."""
    server = DriveServer(json.loads(sys.argv[1]))
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        print(json.dumps(getattr(server, name)(*arguments)), flush=True)
    server.close()


if __name__ == "__main__":
    main()
