"""Raw frames to and from a slave, in simulated time, as the standard writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from slave.frames import Frame
from slave.slave import Slave

GENERIC = Path(__file__).parents[3] / "devices" / "generic-cia402" / "generic-cia402.eds"


class Wire:
    """A slave that has booted, and what came from it."""

    def __init__(self, path: Path = GENERIC, node: int = 1, **options: Any) -> None:
        self.slave = Slave.from_file(path, node, **options)
        self.node = node
        self.frames = self.slave.advance(0.05)

    def send(self, identifier: int, data: str = "", *, remote: bool = False) -> list[Frame]:
        """Send hexadecimal bytes; returns what came at once."""
        found = self.slave.receive(Frame(identifier, bytes.fromhex(data), remote))
        self.frames += found
        return found

    def wait(self, duration: float) -> list[Frame]:
        """Let time pass; returns what came meanwhile."""
        found = self.slave.advance(duration)
        self.frames += found
        return found

    def sdo(self, data: str) -> str:
        """The reply to an SDO request, both as hexadecimal bytes."""
        reply = [f for f in self.send(0x600 + self.node, data) if f.identifier == 0x580 + self.node]
        return reply[0].data.hex() if reply else ""

    def write(self, index: int, sub: int, value: int, size: int) -> str:
        """An expedited download."""
        head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little") + bytes((sub,))
        number = (value & (1 << 8 * size) - 1).to_bytes(size, "little").ljust(4, b"\0")
        return self.sdo((head + number).hex())

    def read(self, index: int, sub: int = 0) -> int:
        """An expedited upload of an unsigned number."""
        reply = bytes.fromhex(
            self.sdo((b"\x40" + index.to_bytes(2, "little")).hex() + f"{sub:02x}00000000")
        )
        assert reply[0] & 0xE3 == 0x43, reply.hex()
        return int.from_bytes(reply[4 : 8 - (reply[0] >> 2 & 3)], "little")

    def status(self) -> int:
        """The bits of 6041h that show the state."""
        word = self.read(0x6041)
        return word & (0x4F if word & 0x4F in (0x00, 0x40, 0x0F, 0x08) else 0x6F)

    def start(self) -> None:
        """NMT start."""
        self.send(0x000, f"01{self.node:02x}")

    def enable(self, mode: int = 9) -> None:
        """To operation enabled, by SDO."""
        self.write(0x6060, 0, mode, 1)
        for word in (0x06, 0x07, 0x0F):
            self.write(0x6040, 0, word, 2)
            self.wait(0.002)


def moving(speed: float = 20.0, **options: Any) -> Wire:
    """A slave that turns at a speed, rad/s."""
    wire = Wire(**options)
    wire.start()
    wire.enable(9)
    unit = wire.slave.motion.velocity_unit
    wire.write(0x60FF, 0, round(speed / unit), 4)
    wire.wait(0.2)
    assert wire.slave.motor.velocity == pytest.approx(speed, rel=1e-3)
    return wire


def emergencies(frames: list[Frame], node: int = 1) -> list[int]:
    """Error codes of the emergencies among frames."""
    found = [f.data for f in frames if f.identifier == 0x080 + node]
    return [int.from_bytes(data[:2], "little") for data in found]
