"""A device that knows LSS (CiA 305), for tests: written from the standard's tables."""

from __future__ import annotations

import struct
import threading
from dataclasses import dataclass, field

import can

_ADDRESS = {0x40: 0, 0x41: 1, 0x42: 2, 0x43: 3}
_INQUIRY = {0x5A: 0, 0x5B: 1, 0x5C: 2, 0x5D: 3}
_RATES = {0, 1, 2, 3, 4, 6, 7, 8}


@dataclass
class LssDevice:
    """Listens on 7E5h and answers on 7E4h; a context manager."""

    channel: str
    identity: tuple[int, int, int, int]
    node: int = 255
    rate: int = 0
    stored: tuple[int, int] | None = None
    selected: bool = False
    _matched: list[int] = field(default_factory=list)
    _scan: int = 0

    def __enter__(self) -> LssDevice:
        self._bus = can.Bus(interface="virtual", channel=self.channel)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._bus.shutdown()

    def _run(self) -> None:
        while not self._stopping.is_set():
            message = self._bus.recv(0.02)
            if message is None or message.arbitration_id != 0x7E5:
                continue
            answer = self._answer(bytes(message.data))
            if answer is not None:
                data = answer.ljust(8, b"\0")
                reply = can.Message(arbitration_id=0x7E4, data=data, is_extended_id=False)
                self._bus.send(reply)

    def _answer(self, data: bytes) -> bytes | None:
        command, number = data[0], int.from_bytes(data[1:5], "little")
        if command == 0x04:
            self.selected = data[1] == 1
            return None
        if command in _ADDRESS:
            return self._select(_ADDRESS[command], number)
        if command == 0x51:
            return self._fast_scan(number, *data[5:8])
        if not self.selected:
            return None
        if command in _INQUIRY:
            return struct.pack("<BI", command, self.identity[_INQUIRY[command]])
        return self._configure(command, data)

    def _select(self, part: int, number: int) -> bytes | None:
        if part == 0:
            self._matched.clear()
        self._matched.append(number)
        if part == 3 and tuple(self._matched) == self.identity:
            self.selected = True
            return b"\x44"
        return None

    def _fast_scan(self, number: int, bit: int, sub: int, following: int) -> bytes | None:
        """Answer while the bits that were asked for are ours, and we have no number."""
        if self.node != 255 or self.selected:
            return None
        if bit == 128:
            self._scan = 0
            return b"\x4f"
        if self._scan != sub or (self.identity[sub] ^ number) >> bit:
            return None
        if bit == 0:
            self._scan = following
            self.selected = sub == 3 and following == 0
        return b"\x4f"

    def _configure(self, command: int, data: bytes) -> bytes | None:
        if command == 0x5E:
            return bytes((command, self.node))
        if command == 0x11:
            wrong = not 1 <= data[1] <= 127
            self.node = self.node if wrong else data[1]
            return bytes((command, wrong))
        if command == 0x13:
            wrong = data[1] != 0 or data[2] not in _RATES
            self.rate = self.rate if wrong else data[2]
            return bytes((command, wrong))
        if command == 0x17:
            self.stored = (self.node, self.rate)
            return bytes((command, 0))
        return None
