"""The settings of a drive: read as a whole, compared, written and stored in its memory.

Settings are what an engineer sets and the drive keeps. What a bench sets at every opening (PDOs,
heartbeats), commands, targets and measured values are none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from canopen.objectdictionary import ODVariable, datatypes

from winchkit.drivers.can.cia402 import State, state_of
from winchkit.drivers.can.fitting import Identity
from winchkit.drivers.can.objects import Objects, Value, object_name, variables
from winchkit.drivers.can.scan import identity_of
from winchkit.errors import DeviceRefused, FileError, NotPermitted

__all__ = [
    "RESTORE",
    "STORE",
    "Config",
    "Difference",
    "check_fits",
    "check_quiet",
    "difference",
    "read_config",
    "restore",
    "settings",
    "store",
    "write_config",
]

Key = tuple[int, int]

STORE, RESTORE = (0x1010, b"save"), (0x1011, b"load")
"""Object and signature that store all parameters, and bring back the maker's."""

_NOT_SETTINGS = (
    range(0x1003, 0x1004),  # error history
    range(0x1010, 0x1018),  # store and restore, COB-IDs, heartbeats
    range(0x1200, 0x1C00),  # SDO servers, PDOs
    range(0x1F50, 0x1F58),  # program download
    range(0x6040, 0x6041),  # control word
    range(0x6060, 0x6061),  # mode
    range(0x6071, 0x6072),  # targets and offsets
    range(0x607A, 0x607B),
    range(0x60B0, 0x60B3),
    range(0x60C1, 0x60C3),  # interpolation data and period
    range(0x60FE, 0x6100),  # digital outputs, target velocity
)
_TYPES = {*datatypes.NUMBER_TYPES, datatypes.BOOLEAN, datatypes.VISIBLE_STRING}
_QUIET = (State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.FAULT)


@dataclass(frozen=True)
class Config:
    """Settings of one drive."""

    identity: Identity
    values: Mapping[Key, Value]
    """By index and sub-index."""
    refused: tuple[str, ...] = field(default=(), compare=False)
    """Objects that the drive would not tell, with its reason."""


@dataclass(frozen=True)
class Difference:
    """One setting that is not the same in a file and in the drive."""

    object: str
    name: str
    file: Value
    drive: Value | None
    """None where the drive has no such object."""


def settings(dictionary: Any) -> dict[Key, ODVariable]:
    """The objects of a dictionary that are settings."""
    return {
        (item.index, item.subindex): item
        for item in variables(dictionary)
        if item.data_type in _TYPES
        and item.access_type in ("rw", "rwr", "rww")
        and not any(item.index in part for part in _NOT_SETTINGS)
        and not (item.subindex == 0 and item.parent is not dictionary)
    }


def read_config(objects: Objects) -> Config:
    """Read every setting; raises NoReply. What the drive refuses to tell is noted."""
    values: dict[Key, Value] = {}
    refused = []
    for key, variable in settings(objects.dictionary).items():
        try:
            value = objects.value(variable)
        except DeviceRefused as error:
            refused.append(str(error))
            continue
        if value is not None:
            values[key] = value
    return Config(identity_of(objects.port), values, tuple(refused))


def check_fits(config: Config, found: Identity, path: str) -> None:
    """Raise FileError where the settings come from a drive of another kind."""
    wanted = config.identity
    if wanted.vendor and (wanted.vendor, wanted.product) != (found.vendor, found.product):
        raise FileError(
            f"{path}: is of vendor {wanted.vendor:04X}h product {wanted.product:08X}h; this drive "
            f"is of vendor {found.vendor:04X}h product {found.product:08X}h"
        )


def check_quiet(objects: Objects) -> None:
    """Raise NotPermitted while the drive is enabled or about to be."""
    status = objects.number(0x6041)
    state = State.UNKNOWN if status is None else state_of(status)
    if status is not None and state not in _QUIET:
        raise NotPermitted(f"the drive is {state}; stop it before its settings are changed")


def difference(config: Config, objects: Objects) -> list[Difference]:
    """Where a file and the drive differ; raises FileError, NoReply, DeviceRefused."""
    known = settings(objects.dictionary)
    found = []
    for key, wanted in config.values.items():
        variable = known[key]
        kept = objects.value(variable)
        if kept != wanted:
            found.append(Difference(object_name(*key), _name(variable), wanted, kept))
    return found


def write_config(config: Config, objects: Objects) -> list[Difference]:
    """Write what differs and return it as it was before; each value is read back.

    Raises NotPermitted while the drive is enabled, DeviceRefused for what it does not take or
    does not have. What was written until then stays.
    """
    check_quiet(objects)
    known = {object_name(*key): item for key, item in settings(objects.dictionary).items()}
    changes = difference(config, objects)
    for change in changes:
        if change.drive is None:
            raise DeviceRefused(f"{change.object} ({change.name}): the drive has no such object")
    for change in changes:
        variable = known[change.object]
        objects.write(variable, change.file)
        kept = objects.value(variable)
        if kept != change.file:
            raise DeviceRefused(
                f"{change.object} ({change.name}): wrote {change.file}, reads back {kept}; "
                "the drive does not take this value"
            )
    return changes


def store(objects: Objects) -> None:
    """Let the drive keep its settings (1010h); raises NotPermitted, DeviceRefused."""
    _sign(objects, *STORE, "store its parameters")


def restore(objects: Objects) -> None:
    """Let the drive take the maker's settings at its next start (1011h)."""
    _sign(objects, *RESTORE, "restore the maker's parameters")


def _sign(objects: Objects, index: int, signature: bytes, what: str) -> None:
    check_quiet(objects)
    if objects.number(index, 1) is None:
        raise DeviceRefused(f"{object_name(index, 1)}: the drive cannot {what}")
    objects.port.download(index, 1, signature)


def _name(variable: ODVariable) -> str:
    """Parameter name, with the record's where it has one."""
    parent = getattr(variable.parent, "name", "")
    return f"{parent}, {variable.name}" if parent else str(variable.name)
