"""One CANopen node by SDO: typed reads and writes, one at a time, with every answer checked."""

from __future__ import annotations

import configparser
import threading
from pathlib import Path
from typing import Any

import can
import canopen

from winchkit.drivers.can.bus import CanBus
from winchkit.drivers.can.pdo import MappedObject
from winchkit.errors import DeviceRefused, Fault, FileError, NoReply

__all__ = ["SdoNode", "read_dictionary"]

_ABSENT = {0x06020000, 0x06090011}
_TIMEOUT = 0.5


def read_dictionary(path: Path, node: int) -> Any:
    """Object dictionary of an EDS or DCF; raises FileError."""
    try:
        return canopen.import_od(str(path), node)
    except (OSError, ValueError, KeyError, configparser.Error) as error:
        raise FileError(Fault(f"cannot be read as an EDS: {error}", str(path))) from error


class SdoNode:
    """A node's object dictionary over SDO. Safe to use from several threads."""

    def __init__(self, bus: CanBus, node: int, eds: Path) -> None:
        """Attach to ``node`` of an open bus; nothing is sent yet."""
        self.bus = bus
        self.node = node
        self.dictionary = read_dictionary(eds, node)
        remote = canopen.RemoteNode(node, self.dictionary)
        bus.network.add_node(remote)
        self._sdo = remote.sdo
        self._sdo.RESPONSE_TIMEOUT = _TIMEOUT
        self._lock = threading.Lock()

    def place(self, index: int, sub: int = 0) -> str:
        """How messages name an object."""
        variable = self.dictionary.get_variable(index, sub)
        number = f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
        name = f" ({variable.name})" if variable is not None else ""
        return f"bus '{self.bus.name}' node {self.node} {number}{name}"

    def read(self, index: int, sub: int = 0) -> int:
        """Value of an integer object; raises NoReply, DeviceRefused."""
        with self._lock:
            try:
                data = self._sdo.upload(index, sub)
            except canopen.SdoAbortedError as error:
                raise self._refused("read", index, sub, error) from error
            except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
                raise self._silent(index, sub, error) from error
        signed = self._variable(index, sub, len(data)).signed
        return int.from_bytes(data, "little", signed=signed)

    def read_if_there(self, index: int, sub: int = 0) -> int | None:
        """Value of an object that the device may lack; None where it does."""
        try:
            return self.read(index, sub)
        except DeviceRefused as error:
            cause = error.__cause__
            if isinstance(cause, canopen.SdoAbortedError) and cause.code in _ABSENT:
                return None
            raise

    def write(self, index: int, sub: int, value: int) -> None:
        """Write an integer object; raises NoReply, DeviceRefused."""
        item = self._variable(index, sub, 4)
        data = value.to_bytes(item.bits // 8, "little", signed=item.signed and value < 0)
        with self._lock:
            try:
                self._sdo.download(index, sub, data)
            except canopen.SdoAbortedError as error:
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

    def mapped(self, index: int, sub: int) -> MappedObject:
        """The object as a PDO carries it; raises FileError when the EDS does not know it."""
        if self.dictionary.get_variable(index, sub) is None:
            raise FileError(f"{self.place(index, sub)}: not in the EDS, so it cannot be mapped")
        return self._variable(index, sub, 4)

    def _variable(self, index: int, sub: int, size: int) -> MappedObject:
        variable = self.dictionary.get_variable(index, sub)
        if variable is None:
            return MappedObject(index, sub, 8 * size, False)
        signed = variable.data_type in canopen.objectdictionary.datatypes.SIGNED_TYPES
        return MappedObject(index, sub, len(variable), signed)

    def _refused(self, what: str, index: int, sub: int, error: Exception) -> DeviceRefused:
        return DeviceRefused(f"{self.place(index, sub)}: the device refused to {what} it: {error}")

    def _silent(self, index: int, sub: int, error: Exception) -> NoReply:
        return NoReply(
            f"{self.place(index, sub)}: no answer within {_TIMEOUT:g} s ({error}); "
            "check power, wiring, bit rate and node id"
        )
