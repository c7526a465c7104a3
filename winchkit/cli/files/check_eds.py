"""What ``winchkit check`` says of an EDS or DCF by itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.errors import Fault

if TYPE_CHECKING:
    from winchkit.drivers.can.canopen.description import DriveDescription, PdoEntry

_SHOWN = 12
"""Values of an instrument in one line."""


def describe_eds(path: Path) -> tuple[DriveDescription, tuple[Fault, ...]]:
    """Facts in an EDS on its drive, with the warnings of its text; raises FileError."""
    from winchkit.drivers.can.canopen.description import describe
    from winchkit.drivers.can.canopen.node import read_eds

    dictionary, warnings = read_eds(path, 1)
    return describe(dictionary), warnings


def lines_of(drive: DriveDescription) -> Iterator[str]:
    """The description in words, a line for each topic."""
    if not drive.servo_drive:
        yield _other_device(drive)
        yield f"PDOs: {_pdos('receive', drive.receive)}; {_pdos('transmit', drive.transmit)}"
        if drive.values:
            shown = ", ".join(drive.values[:_SHOWN])
            more = f" and {len(drive.values) - _SHOWN} more" if len(drive.values) > _SHOWN else ""
            yield f"values that a TPDO can carry: {shown}{more}"
            yield "an instrument is declared by [process] in a device file: docs/howto/load-cell.md"
        return
    yield f"modes: {', '.join(drive.modes) or 'none'}"
    yield f"modes that winchkit can move it in: {', '.join(drive.motion_modes) or 'none'}"
    yield f"feedback by TPDO: {_carried(drive.feedback)}"
    yield f"targets by RPDO: {_carried(drive.targets)}"
    yield f"PDOs: {_pdos('receive', drive.receive)}; {_pdos('transmit', drive.transmit)}"
    for way in drive.host_loss:
        yield f"loss of the host by {way.way} ({', '.join(way.objects)}): {way.reaction}"
    if not drive.host_loss:
        yield "loss of the host: no way to notice it"
    for option in drive.options:
        said = "no default" if option.default is None else f"{option.default} ({option.meaning})"
        fixed = "" if option.writable else ", cannot be written"
        yield f"{option.index} on {option.occasion}: {said}{fixed}"
    for difference in drive.differences:
        yield f"note: {difference}"
    for obstacle in drive.obstacles:
        yield f"not movable: {obstacle}"


def _other_device(drive: DriveDescription) -> str:
    if drive.device_profile is None:
        return "no device profile in 1000h, and 6040h and 6041h are not both there: no servo drive"
    return f"device profile CiA {drive.device_profile}: no servo drive"


def _carried(objects: dict[str, bool]) -> str:
    able = [name for name, carried in objects.items() if carried]
    unable = [name for name, carried in objects.items() if not carried]
    return (", ".join(able) or "none") + (f"; not {', '.join(unable)}" if unable else "")


def _pdos(name: str, entries: Sequence[PdoEntry]) -> str:
    fixed = sum(entry.fixed for entry in entries)
    return f"{len(entries)} {name}" + (f" ({fixed} with a fixed mapping)" if fixed else "")
