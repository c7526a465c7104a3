"""Typed access to the objects of one node, wherever its bus is open."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

from canopen.objectdictionary import ODVariable, datatypes

__all__ = ["ObjectPort", "Objects", "Value", "is_signed", "object_name", "variables"]

Value = int | float | str
"""Of an object: numbers, and texts."""

_SIGNED = {
    *(0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6007, 0x6060, 0x6061, 0x6062, 0x6064, 0x606B),
    *(0x606C, 0x6071, 0x6074, 0x6077, 0x6078, 0x607A, 0x607C, 0x607D, 0x6098, 0x60B0, 0x60B1),
    *(0x60B2, 0x60F4, 0x60FA, 0x60FF),
}
"""Objects that CiA 402-2 makes signed; some makers declare them unsigned in their EDS."""


class ObjectPort(Protocol):
    """Moves the bytes of objects; ``SdoNode`` is one."""

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object; None where the device has none. Raises NoReply, DeviceRefused."""

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write the bytes of an object; raises NoReply, DeviceRefused."""


class Objects:
    """A port and the object dictionary by which its bytes are read."""

    def __init__(self, port: ObjectPort, dictionary: Any) -> None:
        """Take canopen's dictionary of an EDS."""
        self.port = port
        self.dictionary = dictionary

    def number(self, index: int, sub: int = 0) -> int | None:
        """An integer, signed as the dictionary says; None where the device has no such object."""
        data = self.port.upload_if_there(index, sub)
        if data is None:
            return None
        signed = is_signed(self.dictionary.get_variable(index, sub))
        return int.from_bytes(data, "little", signed=signed)

    def text(self, index: int, sub: int = 0) -> str:
        """A text; empty where the device has no such object."""
        data = self.port.upload_if_there(index, sub) or b""
        return data.split(b"\0")[0].decode("ascii", errors="replace").strip()

    def value(self, variable: ODVariable) -> Value | None:
        """Value of a declared object; None where the device has none, or of another size."""
        data = self.port.upload_if_there(variable.index, variable.subindex)
        if data is None or (variable.fixed_size and 8 * len(data) < len(variable)):
            return None
        raw = variable.decode_raw(data[: len(variable) // 8] if variable.fixed_size else data)
        return raw if isinstance(raw, int | float | str) else None

    def write(self, variable: ODVariable, value: Value) -> None:
        """Write a declared object; raises ValueError where the value does not fit its type."""
        self.port.download(variable.index, variable.subindex, variable.encode_raw(value))


def is_signed(variable: ODVariable | None) -> bool:
    """Whether the bits of an object are two's complement: by its type, or by CiA 402-2.

    Five of Roboteq's EDS files declare 60FFh UNSIGNED32; a negative speed is written to it as the
    two's complement of its size all the same.
    """
    if variable is None:
        return False
    if variable.data_type in datatypes.SIGNED_TYPES:
        return True
    return (
        variable.index in _SIGNED
        and variable.data_type in datatypes.UNSIGNED_TYPES
        and (variable.index != 0x607D or variable.subindex > 0)
    )


def variables(dictionary: Any) -> Iterator[ODVariable]:
    """Every object and sub-object of a dictionary, in order."""
    for index in sorted(dictionary):
        item = dictionary[index]
        if isinstance(item, ODVariable):
            yield item
        else:
            yield from (item[sub] for sub in sorted(item))


def object_name(index: int, sub: int = 0) -> str:
    """``6064h``, or ``607Dh:1``."""
    return f"{index:04X}h:{sub}" if sub else f"{index:04X}h"
