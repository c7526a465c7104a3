"""CAN frames of the predefined connection set of CiA 301."""

from __future__ import annotations

from typing import NamedTuple


class Frame(NamedTuple):
    """A frame of 11 bits."""

    identifier: int
    data: bytes = b""
    remote: bool = False
    """A remote transmission request."""


def kind_from_host(frame: Frame, node: int, rpdos: dict[int, int]) -> tuple[str, int]:
    """What a received frame is to this node, with the number of an RPDO.

    ``rpdos`` has the number of each RPDO by its identifier.
    """
    identifier = frame.identifier
    if identifier == 0x000:
        return "nmt", 0
    if identifier == 0x080:
        return "sync", 0
    if identifier == 0x600 + node:
        return "sdo", 0
    if identifier == 0x700 + node and frame.remote:
        return "guarding", 0
    if identifier in rpdos:
        return "rpdo", rpdos[identifier]
    if identifier & 0x780 == 0x700:
        return "heartbeat", 0
    return "other", 0


def kind_from_slave(frame: Frame, node: int, tpdos: dict[int, int]) -> tuple[str, int]:
    """What a frame sent by this node is, with the number of a TPDO."""
    identifier = frame.identifier
    if identifier in tpdos:
        return "tpdo", tpdos[identifier]
    names = {0x080 + node: "emergency", 0x580 + node: "sdo", 0x700 + node: "heartbeat"}
    return names.get(identifier, "other"), 0
