"""One CANopen node by SDO: typed reads and writes, one at a time, with every answer checked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import canopen

from winchkit.drivers.can.bus import CanBus
from winchkit.drivers.can.eds import read_eds
from winchkit.drivers.can.interface import queue_full
from winchkit.drivers.can.objects import is_signed
from winchkit.drivers.can.pdo import MappedObject
from winchkit.drivers.can.sdo_client import sdo_client
from winchkit.drivers.scheduling import lock_of
from winchkit.errors import DeviceRefused, FileError, NoReply, NotPermitted

__all__ = ["SdoNode", "read_dictionary"]

_ABSENT = {0x06020000, 0x06090011}
_TIMEOUT = 0.5
_FULL_TRIES, _FULL_PAUSE = 20, 0.005
"""How often, and after which pause (s), a full queue of the interface is tried again."""


def read_dictionary(path: Path, node: int) -> Any:
    """Object dictionary of an EDS or DCF; raises FileError. Its warnings are for ``check``."""
    return read_eds(path, node)[0]


class SdoNode:
    """A node's object dictionary over SDO. Safe to use from several threads."""

    def __init__(self, bus: CanBus, node: int, eds: Path) -> None:
        """Attach to ``node`` of an open bus; nothing is sent yet."""
        self.bus = bus
        self.node = node
        self.dictionary = read_dictionary(eds, node)
        remote = canopen.RemoteNode(node, self.dictionary)
        bus.network.add_node(remote)
        self._sdo = sdo_client(remote, bus.clock)
        self._sdo.RESPONSE_TIMEOUT = _TIMEOUT
        self._lock = lock_of(bus.clock)

    def place(self, index: int, sub: int = 0) -> str:
        """How messages name an object."""
        variable = self.dictionary.get_variable(index, sub)
        number = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
        name = f" ({variable.name})" if variable is not None else ""
        return f"bus '{self.bus.name}' node {self.node} {number}{name}"

    def read(self, index: int, sub: int = 0) -> int:
        """Value of an integer object; raises NoReply, DeviceRefused."""
        return self._number(index, sub, self.upload(index, sub))

    def upload(self, index: int, sub: int = 0) -> bytes:
        """Bytes of any object as the device sends them; raises NoReply, DeviceRefused."""
        with self._lock:
            try:
                return bytes(self._insist(lambda: self._sdo.upload(index, sub)))
            except canopen.SdoAbortedError as error:
                raise self._refused("read", index, sub, error) from error
            except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
                raise self._silent(index, sub, error) from error

    def read_if_there(self, index: int, sub: int = 0) -> int | None:
        """Value of an object that the device may lack; None where it does."""
        data = self.upload_if_there(index, sub)
        return None if data is None else self._number(index, sub, data)

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object that the device may lack; None where it does."""
        try:
            return self.upload(index, sub)
        except DeviceRefused as error:
            cause = error.__cause__
            if isinstance(cause, canopen.SdoAbortedError) and cause.code in _ABSENT:
                return None
            raise

    def write(self, index: int, sub: int, value: int) -> None:
        """Write an integer object; raises NoReply, DeviceRefused, NotPermitted for its range.

        A negative value goes as the two's complement of the object's size.
        """
        item = self._variable(index, sub, 4)
        try:
            data = value.to_bytes(item.bits // 8, "little", signed=value < 0 or item.signed)
        except OverflowError as error:
            raise NotPermitted(
                f"{self.place(index, sub)}: {value} does not fit into its {item.bits} bits"
            ) from error
        self.download(index, sub, data)

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write the bytes of any object; raises NoReply, DeviceRefused."""
        with self._lock:
            try:
                self._insist(lambda: self._sdo.download(index, sub, data))
            except canopen.SdoAbortedError as error:
                value = int.from_bytes(data, "little")
                raise self._refused(f"write {value} to", index, sub, error) from error
            except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
                raise self._silent(index, sub, error) from error

    def write_verified(self, index: int, sub: int, value: int) -> None:
        """Write, read back and compare; raises DeviceRefused when the device kept another value."""
        self.write(index, sub, value)
        kept = self.read(index, sub)
        if kept != value:
            raise DeviceRefused(
                f"{self.place(index, sub)}: wrote {value}, reads back {kept}; "
                "the device does not take this value"
            )

    def writes(self, index: int, sub: int) -> bool:
        """Whether the EDS lets the object be written; True where it does not know it."""
        variable = self.dictionary.get_variable(index, sub)
        return variable is None or bool(variable.writable)

    def mapped(self, index: int, sub: int) -> MappedObject:
        """The object as a PDO carries it; raises FileError when the EDS does not know it."""
        if self.dictionary.get_variable(index, sub) is None:
            raise FileError(f"{self.place(index, sub)}: not in the EDS, so it cannot be mapped")
        return self._variable(index, sub, 4)

    def _insist(self, transfer: Callable[[], Any]) -> Any:
        """Run a transfer; while the interface's queue is full, again after a pause."""
        for _ in range(_FULL_TRIES):
            try:
                return transfer()
            except (can.CanError, OSError) as error:
                if not queue_full(error):
                    raise
                self.bus.clock.sleep(_FULL_PAUSE)
        return transfer()

    def _number(self, index: int, sub: int, data: bytes) -> int:
        signed = self._variable(index, sub, len(data)).signed
        return int.from_bytes(data, "little", signed=signed)

    def _variable(self, index: int, sub: int, size: int) -> MappedObject:
        variable = self.dictionary.get_variable(index, sub)
        if variable is None:
            return MappedObject(index, sub, 8 * size, False)
        return MappedObject(index, sub, len(variable), is_signed(variable))

    def _refused(self, what: str, index: int, sub: int, error: Exception) -> DeviceRefused:
        return DeviceRefused(f"{self.place(index, sub)}: the device refused to {what} it: {error}")

    def _silent(self, index: int, sub: int, error: Exception) -> NoReply:
        return NoReply(
            f"{self.place(index, sub)}: no answer within {_TIMEOUT:g} s ({error}); "
            "check power, wiring, bit rate and node id"
        )
