"""The sections of an EDS as they stand in the file, and what is found wrong with them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from winchkit.errors import Fault

__all__ = ["Findings", "Section", "canonical", "canonical_key"]

_OBJECT = re.compile(r"([0-9A-F]{4})(?:SUB([0-9A-F]{1,2})|(NAME))?$", re.IGNORECASE)
_OBJECT_KEYS = (
    "ObjectType",
    "DataType",
    "AccessType",
    "PDOMapping",
    "DefaultValue",
    "ParameterValue",
    "LowLimit",
    "HighLimit",
    "CompactSubObj",
)
"""Keys of an object that winchkit reads (CiA 306); names and flags it does not need."""
_OTHER_KEYS = ("ParameterName", "SubNumber", "SupportedObjects", "NrOfEntries", "StorageLocation")
_DEVICE_KEYS = (
    "VendorName",
    "VendorNumber",
    "ProductName",
    "ProductNumber",
    "RevisionNumber",
    "NrOfRXPDO",
    "NrOfTXPDO",
    "LSS_Supported",
)
_IDENTITY = ("VendorNumber", "ProductNumber")
_SPELLING = {key.casefold(): key for key in (*_OBJECT_KEYS, *_OTHER_KEYS, *_DEVICE_KEYS)}


@dataclass
class Section:
    """A section as it stands in the file; ``lines`` are those of its keys."""

    name: str
    line: int
    values: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    contradicts: bool = False
    """Whether the file says two things of it, so that it cannot be used."""

    def uses(self, key: str) -> bool:
        """Whether winchkit reads a key of this section."""
        if self.index is not None and not self.names_subs:
            return key in _OBJECT_KEYS
        return self.name.casefold() == "deviceinfo" and key in _IDENTITY

    @property
    def index(self) -> int | None:
        """Index of the object that it describes."""
        found = _OBJECT.match(self.name)
        return int(found[1], 16) if found else None

    @property
    def sub(self) -> int | None:
        """Sub-index that it describes; None for a whole object."""
        found = _OBJECT.match(self.name)
        return int(found[2], 16) if found and found[2] else None

    @property
    def names_subs(self) -> bool:
        """Whether it lists the names of a compact array's entries."""
        found = _OBJECT.match(self.name)
        return found is not None and found[3] is not None

    def line_of(self, key: str) -> int:
        """Line of a key, or of the section where the key is missing."""
        return self.lines.get(key, self.line)


@dataclass
class Findings:
    """Faults and warnings of one file, as they are found."""

    path: str
    faults: list[Fault] = field(default_factory=list)
    warnings: list[Fault] = field(default_factory=list)

    def fault(self, line: int, message: str) -> None:
        """Something that makes the file useless."""
        self.faults.append(Fault(message, self.path, line))

    def warn(self, line: int, message: str) -> None:
        """Something that was mended."""
        self.warnings.append(Fault(message, self.path, line))


def canonical(name: str) -> str:
    """One spelling for the sections of objects: ``6040``, ``1018sub1``, ``1003Name``."""
    found = _OBJECT.match(name)
    if not found:
        return name
    tail = f"sub{int(found[2], 16):X}" if found[2] else "Name" if found[3] else ""
    return found[1].upper() + tail


def canonical_key(key: str) -> str:
    """The spelling of CiA 306 for a key, which counts in upper and lower case alike."""
    return _SPELLING.get(key.casefold(), key)
