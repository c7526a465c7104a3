"""Identity, state, errors and parameters of a drive, read by SDO; writes nothing."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.drivers.can.canopen.emergency import error_text
from winchkit.drivers.can.canopen.identity import Identity, fitting_device
from winchkit.drivers.can.canopen.node import Objects
from winchkit.drivers.can.cia402.modes import mode_named, modes_of
from winchkit.drivers.can.cia402.option_codes import OPTIONS
from winchkit.drivers.can.cia402.state_machine import state_of
from winchkit.drivers.can.tools.scan import identity_of

_ROWS = {row.index: row for row in OPTIONS.values()}

ENTRIES: dict[str, tuple[tuple[int, int, str], ...]] = {
    "options": (
        (0x605A, 0, "on quick stop"),
        (0x605B, 0, "on shutdown"),
        (0x605C, 0, "on disable operation"),
        (0x605D, 0, "on halt"),
        (0x605E, 0, "on a fault"),
        (0x6007, 0, "without the host"),
    ),
    "limits": (
        (0x607D, 1, "lowest position"),
        (0x607D, 2, "highest position"),
        (0x607F, 0, "highest profile speed"),
        (0x6080, 0, "highest motor speed, rpm"),
        (0x6065, 0, "following error window"),
        (0x6066, 0, "following error time, ms"),
        (0x6072, 0, "highest torque, ‰ of rated"),
        (0x60E0, 0, "highest positive torque, ‰"),
        (0x60E1, 0, "highest negative torque, ‰"),
        (0x6073, 0, "highest current, ‰ of rated"),
    ),
    "units": (
        (0x608F, 1, "encoder increments"),
        (0x608F, 2, "per motor turns"),
        (0x6091, 1, "motor turns"),
        (0x6091, 2, "per shaft turns"),
        (0x6092, 1, "feed"),
        (0x6092, 2, "per shaft turns (feed)"),
        (0x6075, 0, "rated current, mA"),
        (0x6076, 0, "rated torque, mN m"),
    ),
    "communication": (
        (0x1005, 0, "SYNC identifier; bit 30: it sends SYNC itself"),
        (0x1006, 0, "SYNC period, µs"),
        (0x1014, 0, "EMCY identifier; bit 31: it sends none"),
        (0x1029, 1, "network state after an error"),
    ),
    "heartbeat": ((0x1016, 1, "watches (node << 16 | ms)"), (0x1017, 0, "sends every, ms")),
}
"""Groups of objects that are shown as they are: index, sub-index, what it is."""


@dataclass(frozen=True)
class Noted:
    """One object as read."""

    index: int
    sub: int
    what: str
    value: int | None
    """None where the drive has no such object."""
    meaning: str = ""


@dataclass(frozen=True)
class DriveInfo:
    """Identity, state, errors and parameters of a drive."""

    identity: Identity
    name: str
    hardware: str
    software: str
    device: str
    """Shipped device file that fits; empty where none does."""
    state: str
    mode: str
    modes: tuple[str, ...]
    """Those that 6502h names."""
    error_register: int | None
    errors: tuple[tuple[int, str], ...]
    """Error history 1003h, newest first: code and words."""
    noted: dict[str, tuple[Noted, ...]]
    """Groups of :data:`ENTRIES`."""


def read_info(objects: Objects) -> DriveInfo:
    """Ask a drive for all of it; raises NoReply, DeviceRefused."""
    identity = identity_of(objects.port)
    status, mode = objects.number(0x6041), objects.number(0x6061)
    supported = objects.number(0x6502) or 0
    return DriveInfo(
        identity=identity,
        name=objects.text(0x1008),
        hardware=objects.text(0x1009),
        software=objects.text(0x100A),
        device=fitting_device(identity, objects.number(0x1000)),
        state="no status word" if status is None else str(state_of(status)),
        mode=_mode(mode),
        modes=modes_of(supported),
        error_register=objects.number(0x1001),
        errors=_errors(objects),
        noted={
            group: tuple(_noted(objects, *entry) for entry in entries)
            for group, entries in ENTRIES.items()
        },
    )


def _noted(objects: Objects, index: int, sub: int, what: str) -> Noted:
    value = objects.number(index, sub)
    meaning = ""
    if index in _ROWS and value is not None:
        meaning = _ROWS[index].meanings.get(value, "the maker's own: see the drive's manual")
    return Noted(index, sub, what, value, meaning)


def _mode(shown: int | None) -> str:
    if shown is None:
        return "not reported"
    return "none" if shown == 0 else mode_named(shown)


def _errors(objects: Objects) -> tuple[tuple[int, str], ...]:
    """Error history; its upper halves are the maker's own."""
    count = objects.number(0x1003, 0) or 0
    found = []
    for sub in range(1, count + 1):
        value = objects.number(0x1003, sub)
        if value is not None:
            code = value & 0xFFFF
            found.append((code, error_text(code)))
    return tuple(found)
