"""SYNC and EMCY of a drive by the predefined connection set (CiA 301): 1005h and 1014h."""

from __future__ import annotations

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.errors import DeviceRefused, NotPermitted

_SYNC, _EMCY = 0x080, 0x080
_PRODUCES = 1 << 30
"""Of 1005h: the device sends SYNC itself."""
_INVALID = 1 << 31
"""Of 1014h: no EMCY is sent."""
_IDENTIFIER = 0x1FFFFFFF
"""Bits 0 to 28 of 1005h and 1014h (CiA 301): CAN-ID, with those of extended frames."""


def set_communication(node: SdoNode) -> tuple[str, ...]:
    """Configure a drive as SYNC consumer and EMCY producer by the predefined connection set.

    Returns what was changed, in words. A drive may lack both objects, or keep them constant.
    Raises NotPermitted where it goes on sending SYNC or listens to another identifier, NoReply.
    """
    return (*_sync(node), *_emergency(node))


def _sync(node: SdoNode) -> tuple[str, ...]:
    kept = node.read_if_there(0x1005)
    if kept is None or kept & (_PRODUCES | _IDENTIFIER) == _SYNC:
        return ()
    place, produces = node.place(0x1005), bool(kept & _PRODUCES)
    role = "the drive produces SYNC" if produces else "the drive consumes SYNC with another COB-ID"
    try:
        if produces:
            # CiA 301: the identifier does not change while SYNC is produced.
            node.write(0x1005, 0, kept & ~_PRODUCES)
        if kept & _IDENTIFIER != _SYNC:
            node.write(0x1005, 0, _SYNC)
        now = node.read(0x1005)
    except DeviceRefused:
        now = kept
    if now & (_PRODUCES | _IDENTIFIER) != _SYNC:
        raise NotPermitted(
            f"{place} is {kept:X}h: {role} and does not accept 80h; no cyclic mode works with two "
            "producers of SYNC or another COB-ID; set it in the drive"
        )
    return (f"{place} was {kept:X}h: {role}; it is 80h now, until the drive restarts",)


def _emergency(node: SdoNode) -> tuple[str, ...]:
    kept = node.read_if_there(0x1014)
    wanted = _EMCY + node.node
    if kept is None or kept & (_INVALID | _IDENTIFIER) == wanted:
        return ()
    place = node.place(0x1014)
    try:
        node.write(0x1014, 0, kept | _INVALID)
        node.write(0x1014, 0, wanted | _INVALID)
        node.write(0x1014, 0, wanted)
        now = node.read(0x1014)
    except DeviceRefused:
        now = kept
    if now & (_INVALID | _IDENTIFIER) != wanted:
        return (f"{place} is {kept:X}h and cannot be set to {wanted:X}h: its EMCY is not received",)
    return (f"{place} was {kept:X}h, EMCY was not received; it is {wanted:X}h now",)
