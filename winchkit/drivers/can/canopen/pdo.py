"""Packs and unpacks PDOs with one precompiled ``struct`` each."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from winchkit.errors import Fault, FileError
from winchkit.schema.devices.servo import PdoSpec

Key = tuple[int, int]
"""Index and sub-index of an object."""
_CHARACTER = {(8, False): "B", (16, False): "H", (32, False): "I", (64, False): "Q"}
_CHARACTER |= {(bits, True): char.lower() for (bits, _), char in list(_CHARACTER.items())}


@dataclass(frozen=True)
class MappedObject:
    """An object in a PDO."""

    index: int
    sub: int
    bits: int
    signed: bool

    @property
    def entry(self) -> int:
        """Its entry in the mapping record: index, sub-index, length in bits."""
        return self.index << 16 | self.sub << 8 | self.bits


def parse_object(text: str) -> Key:
    """Index and sub-index of ``"0x6091:1"``; raises FileError."""
    index, _, sub = text.partition(":")
    try:
        return int(index, 16), int(sub or "0", 0)
    except ValueError:
        raise FileError(f"'{text}' is no object; write it as 0x6064 or 0x6091:1") from None


class PdoCodec:
    """One PDO: number, communication and mapping records, values of its objects in order."""

    def __init__(self, spec: PdoSpec, objects: Sequence[MappedObject]) -> None:
        """Raise FileError where the objects do not fit into eight bytes."""
        self.spec = spec
        self.objects = tuple(objects)
        bits = sum(item.bits for item in objects)
        odd = [item for item in objects if (item.bits, item.signed) not in _CHARACTER]
        if bits > 64 or odd or not objects:
            reason = f"{bits} bits of 64" if not odd else f"{odd[0].index:04X}h has {odd[0].bits}"
            raise FileError(Fault(f"objects do not fit: {reason} bits", key=f"PDO {spec.number}"))
        self.layout = "".join(_CHARACTER[item.bits, item.signed] for item in objects)
        """Format characters of ``struct``, little-endian."""
        self._struct = struct.Struct("<" + self.layout)
        self.size = self._struct.size
        self.position = {(item.index, item.sub): k for k, item in enumerate(objects)}

    def decode(self, data: bytes) -> tuple[int, ...] | None:
        """Values in the order of the objects; None when the frame is too short."""
        if len(data) < self.size:
            return None
        return self._struct.unpack_from(data)

    def encode(self, values: Sequence[int]) -> bytes:
        """Frame data; raises ``struct.error`` for a value beyond its object's range."""
        return self._struct.pack(*values)


def joint_layout(
    codecs: Sequence[PdoCodec],
) -> tuple[Callable[[bytes], tuple[Any, ...]], tuple[Key, ...]]:
    """How to unpack the frames of several PDOs at once, joined by number, and their objects."""
    ordered = sorted(codecs, key=lambda codec: codec.spec.number)
    layout = struct.Struct("<" + "".join(codec.layout for codec in ordered))
    return layout.unpack, tuple(key for codec in ordered for key in codec.position)
