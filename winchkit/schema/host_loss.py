"""Mechanisms by which a drive detects the loss of its host, as files declare them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from winchkit.schema.quantity import PositiveDuration, Whole
from winchkit.schema.table import Rule, Table

MECHANISMS = ("heartbeat", "guarding", "rpdo-timeout", "sync-loss")
"""Mechanisms of CiA 301, best first."""
VENDOR = "vendor:"
"""Prefix of the name of a table ``[servo.vendor_watchdog.NAME]``."""
HARDWARE = "hardware"
"""In a bench file only: external hardware, and no object of the drive, stops the winch."""

_Stored = Whole(-(2**31), 2**32 - 1)


@dataclass(frozen=True)
class VendorObject(Table):
    """One object of a maker's watchdog, written at commissioning and read back."""

    object: str
    """As ``0x2F21`` or ``0x2F21:1``."""
    value: Annotated[int, _Stored] | None = None
    """Value to write."""
    time_unit: PositiveDuration | None = None
    """In place of ``value``: the limit is written in this unit, s."""
    off: Annotated[int, _Stored] | None = None
    """Value to write when the bench is closed at rest; left out, the object keeps its value."""

    def rules(self) -> Iterator[Rule]:
        """An object gets either a value or the limit."""
        if (self.value is None) == (self.time_unit is None):
            yield "value", "give either `value` or `time_unit`, in which the limit is written"


@dataclass(frozen=True)
class VendorWatchdog(Table):
    """A maker's own watchdog of the communication."""

    silence: Literal["heartbeat", "rpdo", "sync", "all"]
    """Frames of the host whose absence it detects; ``all``: any frame of the host."""
    object: tuple[VendorObject, ...]
    """The objects that set it up, in the order in which they are written."""
    emergency: Annotated[int, Whole(1, 0xFFFF)] | None = None
    """The EMCY code that it sends; left out, any emergency counts."""


def unknown_mechanism(declared: str, vendor: tuple[str, ...]) -> str:
    """Fault of a declared ``host_loss``; empty where it is known."""
    if declared in MECHANISMS:
        return ""
    if declared == HARDWARE:
        return "'hardware' is declared in the bench file, under the winch that it stops"
    name = declared.removeprefix(VENDOR)
    if declared.startswith(VENDOR):
        if name in vendor:
            return ""
        return f"there is no table [servo.vendor_watchdog.{name}] with its objects"
    return f"unknown value '{declared}'; expected one of {', '.join(MECHANISMS)} or {VENDOR}NAME"
