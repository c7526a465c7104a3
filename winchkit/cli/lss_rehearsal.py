"""LSS commands without a bus: every device that is asked for is there and takes everything."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from canopen.lss import LssMaster

from winchkit.cli.dry_run import Frame, show_frames
from winchkit.drivers.can.lss import LssLine

__all__ = ["rehearsed"]

_BUS = "can"
_SELECTED = {0x43: 0x44}
"""Answers whose first byte is not that of the question."""
_ANSWERED = (0x11, 0x13, 0x17, 0x43, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E)


@contextmanager
def rehearsed(*, as_json: bool) -> Iterator[LssLine]:
    """An LSS line to nowhere; its frames are shown at the end."""
    network = _Network()
    line = LssLine(network)
    yield line
    line.close()
    show_frames(network.frames, {}, as_json=as_json)


class _Network:
    """Stands for a bus, its network and the device on it."""

    def __init__(self) -> None:
        self.name = _BUS
        self.network: Any = self
        self.frames: list[Frame] = []
        master: Any = LssMaster()
        master.network = self
        self.lss = master

    def on(self, identifier: int, handler: object) -> None:
        """Nothing ever comes from outside."""

    def send_message(self, identifier: int, data: bytes) -> None:
        """Note a frame; say yes to what wants an answer."""
        self.frames.append(Frame(0.0, _BUS, identifier, bytes(data)))
        if data[0] in _ANSWERED:
            answer = bytes((_SELECTED.get(data[0], data[0]),)).ljust(8, b"\0")
            self.lss.on_message_received(0x7E4, answer, 0.0)
