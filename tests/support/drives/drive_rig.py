"""A simulated drive in simulated time, with canopen's own node as an independent master."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field, replace
from math import pi
from typing import Any

import canopen

from winchkit.catalog import find
from winchkit.schema.devices.servo import QuirkSpec, ServoSpec
from winchkit.schema.read import read_device
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import ObjectDictionary, read_eds
from winchkit.sim.plant.servo import DriveCommand

NODE = 5
HOST = 127
COUNT = 2 * pi / 65536
EDS = find("devices", "generic-cia402").parent / "generic-cia402.eds"
TICK = 1e-3
DICTIONARY = canopen.import_od(str(EDS), NODE)
ENTRIES = read_eds(EDS, NODE)
_DEVICE = read_device(find("devices", "generic-cia402"))
assert _DEVICE.servo is not None
SERVO = replace(_DEVICE.servo, encoder="absolute")


def with_quirks(quirks: QuirkSpec) -> ServoSpec:
    """The generic drive, departing from the standard."""
    return replace(SERVO, quirks=quirks)


@dataclass
class Flywheel:
    """A motor that follows its command at once, or falls when nothing holds it.

    Falls with ``weight`` rad/s^2; a closed brake stops it within the step. Torque is what the
    test says.
    """

    motor_angle: float = 0.0
    motor_velocity: float = 0.0
    motor_torque: float = 0.0
    weight: float = -50.0
    stuck: bool = False
    command: DriveCommand = field(default_factory=lambda: DriveCommand.off(brake=True))

    def advance(self, duration: float, command: DriveCommand) -> None:
        self.command = command
        before = self.motor_velocity
        if command.brake or self.stuck:
            self.motor_velocity = before = 0.0
        elif not command.power:
            self.motor_velocity += self.weight * duration
        elif command.angle is not None:
            self.motor_velocity = before = (command.angle - self.motor_angle) / duration
        else:
            self.motor_velocity = before = command.speed
        self.motor_angle += 0.5 * (before + self.motor_velocity) * duration

    def measure(self) -> Flywheel:
        return self


class Rig:
    """A drive on a bus without a wire: the master's frames arrive at once, and time is ours."""

    def __init__(
        self,
        shaft: Any = None,
        *,
        brake: bool = True,
        boot: bool = True,
        smoothing: float = 0.0,
        servo: ServoSpec = SERVO,
    ) -> None:
        self.now = 100.0
        self.shaft: Any = Flywheel() if shaft is None else shaft
        self.frames: list[tuple[float, int, bytes]] = []
        self.drive = SimDrive(
            self._from_drive,
            NODE,
            servo,
            ObjectDictionary(ENTRIES),
            self.shaft,
            brake=brake,
            smoothing=smoothing,
            now=self.now,
        )
        self.network = canopen.Network()
        self.network.send_message = self._to_drive
        self.node = self.network.add_node(NODE, DICTIONARY)
        self.node.sdo.RESPONSE_TIMEOUT = 0.01
        self.beating: float | None = None
        if boot:
            self.drive.power_on(self.now, boot_time=0.0)
            self.run(2 * TICK)

    def _from_drive(self, identifier: int, data: bytes) -> None:
        self.frames.append((self.now, identifier, bytes(data)))
        self.network.notify(identifier, bytearray(data), self.now)

    def _to_drive(self, identifier: int, data: bytes, remote: bool = False) -> None:
        self.drive.receive(identifier, bytes(data), self.now)

    def send(self, identifier: int, data: bytes) -> None:
        self.drive.receive(identifier, data, self.now)

    def raw_sdo(self, request: bytes) -> bytes:
        """Send eight bytes and return the eight that answer."""
        before = len(self.frames)
        self.send(0x600 + NODE, request)
        answers = [data for _, cob, data in self.frames[before:] if cob == 0x580 + NODE]
        assert len(answers) == 1
        return answers[0]

    def run(self, duration: float, *, sync: float | None = None) -> None:
        """Let time pass in ticks, with SYNC every ``sync`` s and heartbeats while they beat."""
        end = self.now + duration
        next_sync = self.now
        while self.now < end - 1e-9:
            self.now += TICK
            if self.beating is not None and self.now >= self.beating:
                self.send(0x700 + HOST, b"\x05")
                self.beating += 0.02
            if sync is not None and self.now >= next_sync:
                self.send(0x080, b"")
                next_sync += sync
            self.drive.tick(self.now)

    def write(self, index: int, sub: int, value: int) -> None:
        """Write an object through canopen's client."""
        self.node.sdo.download(index, sub, self._variable(index, sub).encode_raw(value))

    def read(self, index: int, sub: int = 0) -> int:
        """Read an object through canopen's client."""
        return int(self._variable(index, sub).decode_raw(self.node.sdo.upload(index, sub)))

    def _variable(self, index: int, sub: int) -> Any:
        found = self.node.object_dictionary[index]
        return found if sub == 0 and not hasattr(found, "subindices") else found[sub]

    def control(self, *words: int) -> None:
        for word in words:
            self.write(0x6040, 0, word)

    def set_point(self, target: int, *words: int) -> None:
        """Write a target position, then control words."""
        self.write(0x607A, 0, target)
        self.control(*words)

    @property
    def status(self) -> int:
        return self.read(0x6041)

    def enable(self, mode: int) -> None:
        self.write(0x6060, 0, mode)
        self.control(0x06, 0x07, 0x0F)

    def sent(self, identifier: int) -> list[bytes]:
        return [data for _, cob, data in self.frames if cob == identifier]

    def emergencies(self) -> list[int]:
        return [struct.unpack_from("<H", data)[0] for data in self.sent(0x80 + NODE)]

    def watch_host(self, milliseconds: int = 100) -> None:
        """Arm the drive's watch on the host's heartbeat, and keep it beating."""
        self.write(0x1016, 1, HOST << 16 | milliseconds)
        self.beating = self.now
        self.run(0.03)
