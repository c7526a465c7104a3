"""Many drives on one bus that cost next to nothing: they answer, and follow speeds."""

from __future__ import annotations

import struct
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from can_cost.wire import Wire
from winchkit.schema.devices.device import DeviceSpec
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import ObjectDictionary, read_eds
from winchkit.sim.plant.servo import DriveCommand

_FIRST, _SECOND = struct.Struct("<Hib"), struct.Struct("<ihH")
_COMMAND = struct.Struct("<Hi")
_NEXT = {(0x50, 6): 0x31, (0x31, 7): 0x33, (0x33, 15): 0x37, (0x37, 2): 0x50}
_CSV = 9
_PERIOD_OF_BEATS = 12
"""Cycles."""


@dataclass
class Idle:
    """A motor at rest."""

    motor_angle: float = 0.0
    motor_velocity: float = 0.0
    motor_torque: float = 0.0

    def advance(self, duration: float, command: DriveCommand) -> None:
        """Stay."""

    def measure(self) -> Idle:
        """As it is."""
        return self


class Commissionable:
    """Simulated drives that answer SDO on a bus until closed: for setting axes up."""

    def __init__(self, wire: Wire, device: DeviceSpec, nodes: range) -> None:
        assert device.servo is not None
        self._wire = wire
        dictionary = Path(device.path).parent / device.servo.eds
        now = time.monotonic()
        self._drives = [
            SimDrive(
                wire.send,
                node,
                device.servo,
                ObjectDictionary(read_eds(dictionary, node)),
                Idle(),
                brake=True,
                now=now,
            )
            for node in nodes
        ]
        for drive in self._drives:
            drive.power_on(now, boot_time=0.0)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        """Fall silent."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.is_set():
            frame = self._wire.receive(0.002)
            now = time.monotonic()
            for drive in self._drives:
                if frame is not None:
                    drive.receive(*frame, now)
                drive.tick(now)


class Drives:
    """Commissioned drives in CSV, as frames alone."""

    def __init__(self, wire: Wire, nodes: range, cycle: float) -> None:
        self._wire = wire
        self._cycle = cycle
        self._status = dict.fromkeys(nodes, 0x0250)
        self._speed = dict.fromkeys(nodes, 0)
        self._angle = dict.fromkeys(nodes, 0.0)
        self._syncs = 0
        self.received = self.sent = 0

    @property
    def enabled(self) -> bool:
        """Whether all of them are."""
        return all(status == 0x1237 for status in self._status.values())

    def serve(self, timeout: float) -> bool:
        """Take one frame and answer it; whether there was one."""
        frame = self._wire.receive(timeout)
        if frame is None:
            return False
        self.received += 1
        identifier, data = frame
        if identifier == 0x080:
            self._answer()
        elif 0x200 < identifier < 0x280:
            self._command(identifier - 0x200, *_COMMAND.unpack(data))
        return True

    def _command(self, node: int, word: int, speed: int) -> None:
        status = _NEXT.get((self._status[node] & 0x7F, word & 0x0F), self._status[node])
        self._status[node] = status & 0x7F | (0x1200 if status & 0x7F == 0x37 else 0x0200)
        self._speed[node] = speed

    def _answer(self) -> None:
        self._syncs += 1
        for node, status in self._status.items():
            speed = self._speed[node]
            self._angle[node] += speed * self._cycle
            self._send(0x180 + node, _FIRST.pack(status, round(self._angle[node]), _CSV))
            self._send(0x280 + node, _SECOND.pack(speed, 137, 0))
            if self._syncs % _PERIOD_OF_BEATS == 0:
                self._send(0x700 + node, b"\x05")

    def _send(self, identifier: int, data: bytes) -> None:
        self._wire.send(identifier, data)
        self.sent += 1
