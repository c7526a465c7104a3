"""Repair of the sections of an EDS where their meaning is unique, with a warning per repair."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from winchkit.errors import Fault

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
    "NodeID",
)
_IDENTITY = ("VendorNumber", "ProductNumber")
_LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_COMMISSIONING = "DeviceComissioning"
"""As CiA 306 spells it."""
_SECTIONS = {
    name.casefold(): name
    for name in ("FileInfo", "DeviceInfo", "DummyUsage", "Comments", _COMMISSIONING, *_LISTS)
} | {"devicecommissioning": _COMMISSIONING}
_SPELLING = {key.casefold(): key for key in (*_OBJECT_KEYS, *_OTHER_KEYS, *_DEVICE_KEYS)}


@dataclass
class Section:
    """A section of the file; ``lines`` are those of its keys."""

    name: str
    line: int
    values: dict[str, str] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    contradicts: bool = False
    """Whether the file contradicts itself about it, so that it cannot be used."""

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
class EdsFindings:
    """Faults and warnings of one file, as they are found."""

    path: str
    faults: list[Fault] = field(default_factory=list)
    warnings: list[Fault] = field(default_factory=list)

    def fault(self, line: int, message: str) -> None:
        """Note a fault that makes the file unusable."""
        self.faults.append(Fault(message, self.path, line))

    def warn(self, line: int, message: str) -> None:
        """Note a repair."""
        self.warnings.append(Fault(message, self.path, line))

    def mend(self, section: Section, key: str, message: str) -> None:
        """Note the repair of a key, or of its section where the key is missing or empty."""
        self.warn(section.line_of(key), f"[{section.name}] {message}")


def canonical(name: str) -> str:
    """One spelling: ``6040``, ``1018sub1``, ``1003Name``, and ``DeviceInfo`` in any case."""
    found = _OBJECT.match(name)
    if not found:
        return _SECTIONS.get(name.casefold(), name)
    tail = f"sub{int(found[2], 16):X}" if found[2] else "Name" if found[3] else ""
    return found[1].upper() + tail


def canonical_key(key: str) -> str:
    """The spelling of CiA 306 for a key, which is case-insensitive."""
    return _SPELLING.get(key.casefold(), key)


_VAR, _DOMAIN, _ARRAY, _RECORD = 0x7, 0x2, 0x8, 0x9
_FIRST_OBJECT = 0x1000
"""Lower indices are data types (CiA 301)."""
MANDATORY = (0x1000, 0x1001, 0x1018)
_NUMBERS = (
    "VendorNumber",
    "ProductNumber",
    "RevisionNumber",
    "SimpleBootUpMaster",
    "SimpleBootUpSlave",
    "Granularity",
    "DynamicChannelsSupported",
    "GroupMessaging",
    "NrOfRXPDO",
    "NrOfTXPDO",
    "LSS_Supported",
    *(f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)),
)
_BITS = {
    **{0x01: 8, 0x02: 8, 0x03: 16, 0x04: 32, 0x10: 24, 0x12: 40, 0x13: 48, 0x14: 56, 0x15: 64},
    **{0x05: 8, 0x06: 16, 0x07: 32, 0x16: 24, 0x18: 40, 0x19: 48, 0x1A: 56, 0x1B: 64},
}
"""Of the whole numbers among the data types of CiA 301."""
_OTHER_TYPES = {0x08, 0x09, 0x0A, 0x0B, 0x0C, 0x0D, 0x0F, 0x11}
"""Real numbers, strings, times and domains."""
_SIGNED = {0x02, 0x03, 0x04, 0x10, 0x12, 0x13, 0x14, 0x15}
_ZEROS = re.compile(r"0\d+$")
_NODE_ID = re.compile(r"\$NODEID", re.IGNORECASE)
_COB_ID, _NODES = 0x7FF, 127
_BYTES = "0x000F"
_LAST_STANDARD = 0x1B
"""Data types to 001Bh are the standard's (UNSIGNED64); later ones are structures or a maker's."""
_ACCESS = ("ro", "rw", "wo", "const", "rwr", "rww")


def mend(sections: list[Section], findings: EdsFindings) -> list[Section]:
    """Sections in an order and a state that any reader of EDS files accepts."""
    by_name = {section.name: section for section in sections}
    _mend_device(by_name, findings)
    _mend_dummies(by_name, findings)
    objects = {one.index: one for one in sections if one.index is not None and _whole(one)}
    subs: dict[int, list[Section]] = {}
    for section in sections:
        if section.index is not None and not _whole(section) and not section.names_subs:
            subs.setdefault(section.index, []).append(section)
    for index, members in subs.items():
        if index not in objects:
            objects[index] = _stand_in(index, members[0], findings)
    for section in objects.values():
        _mend_object(section, subs, findings)
    commissioned = by_name.get(_COMMISSIONING, Section("", 1)).values.get("NodeID", "")
    for section in sections:
        _mend_node_id(section, _number(commissioned), findings)
    _check_lists(by_name, objects, findings)
    plain = [by_name[name] for name in ("FileInfo", "DeviceInfo", "DummyUsage") if name in by_name]
    plain += [by_name[name] for name in _LISTS if name in by_name]
    ordered = list(plain)
    for index in sorted(objects):
        ordered.append(objects[index])
        ordered += sorted(subs.get(index, ()), key=lambda one: one.sub or 0)
        ordered += _names(by_name, objects[index], findings)
    return ordered


def _whole(section: Section) -> bool:
    return section.sub is None and not section.names_subs


def _number(text: str) -> int | None:
    """A number of CiA 306: decimal (with 8 or 9 also after 0), hexadecimal 0x, octal 0; or None."""
    bare = text.replace(" ", "")
    try:
        if _ZEROS.match(bare):
            return int(bare, 10 if set(bare) & {"8", "9"} else 8)
        return int(bare, 0)
    except ValueError:
        return None


def _read_number(section: Section, key: str, text: str, findings: EdsFindings) -> int | None:
    """As ``_number``, with a warning where a leading zero makes another number of it."""
    value, bare = _number(text), text.replace(" ", "")
    if value is not None and _ZEROS.match(bare) and value != int(bare):
        findings.mend(
            section,
            key,
            f"{key} {bare} begins with 0, so that it is octal by CiA 306: {value}; write "
            f"{int(bare)} if that is meant",
        )
    return value


def _without_zeros(section: Section, keys: Iterable[str], findings: EdsFindings) -> None:
    """Write numbers with leading zeros (``0004``), which readers of EDS files refuse, without."""
    for key in keys:
        text = section.values.get(key, "")
        if _ZEROS.match(text) and (value := _read_number(section, key, text, findings)) is not None:
            section.values[key] = str(value)


def _mend_device(sections: dict[str, Section], findings: EdsFindings) -> None:
    for name in ("FileInfo", "DeviceInfo"):
        if name not in sections:
            findings.warn(1, f"[{name}] is missing")
    info = sections.setdefault("DeviceInfo", Section("DeviceInfo", 1))
    for key in _NUMBERS:
        text = info.values.get(key)
        if text is None or _number(text) is not None:
            continue
        said = "is empty" if not text else f"{text!r} is not a number"
        findings.mend(info, key, f"{key} {said}; taken as 0")
        info.values[key] = "0"
    _without_zeros(info, _NUMBERS, findings)


def _mend_dummies(sections: dict[str, Section], findings: EdsFindings) -> None:
    dummies = sections.get("DummyUsage")
    if dummies is None:
        return
    for number in range(1, 8):
        key = f"Dummy{number:04d}"
        if _number(dummies.values.get(key, "")) not in (0, 1):
            findings.mend(dummies, key, f"{key} is neither 0 nor 1; taken as 0")
            dummies.values[key] = "0"
        _without_zeros(dummies, [key], findings)


def _stand_in(index: int, member: Section, findings: EdsFindings) -> Section:
    findings.mend(member, "", f"has no [{index:04X}]; taken as part of a record")
    values = {"ParameterName": f"Object {index:04X}h", "ObjectType": hex(_RECORD)}
    return Section(f"{index:04X}", member.line, values)


def _mend_object(section: Section, subs: dict[int, list[Section]], findings: EdsFindings) -> None:
    index = section.index
    if index is None:
        return
    _mend_name(section, findings)
    _without_zeros(section, ("ObjectType", "SubNumber", "CompactSubObj"), findings)
    kind = _number(section.values.get("ObjectType", hex(_VAR)))
    if kind is None:
        text = section.values["ObjectType"]
        findings.fault(
            section.line_of("ObjectType"), f"[{section.name}] ObjectType {text!r} is not a number"
        )
        return
    members = subs.get(index, [])
    if index < _FIRST_OBJECT:
        return
    if kind in (_VAR, _DOMAIN):
        _mend_variable(section, findings)
        for member in members:
            findings.mend(member, "", f"is left out: [{section.name}] is one value")
        subs.pop(index, None)
    elif "CompactSubObj" in section.values and not members:
        _mend_variable(section, findings)
    else:
        for member in members:
            _mend_name(member, findings)
            _mend_variable(member, findings)
        _check_count(section, len(members), findings)


def _mend_name(section: Section, findings: EdsFindings) -> None:
    if not section.values.get("ParameterName"):
        findings.mend(section, "", "has no ParameterName")
        section.values["ParameterName"] = f"Object {section.name}"


def _check_count(section: Section, found: int, findings: EdsFindings) -> None:
    text = section.values.get("SubNumber")
    if text is not None and _number(text) != found:
        said = f"SubNumber is {text or 'empty'}, but {found} sub-indices follow"
        findings.mend(section, "SubNumber", said)


def _mend_variable(section: Section, findings: EdsFindings) -> None:
    _without_zeros(section, ("DataType", "PDOMapping"), findings)
    kind = _mend_type(section, findings)
    access = section.values.get("AccessType", "").lower()
    if access not in _ACCESS:
        said = (
            f"AccessType {access!r} is none of {', '.join(_ACCESS)}" if access else "no AccessType"
        )
        findings.mend(section, "AccessType", f"{said}; taken as ro")
        access = "ro"
    section.values["AccessType"] = access
    if _number(section.values.get("PDOMapping", "0")) is None:
        findings.mend(section, "PDOMapping", "PDOMapping is not a number; taken as 0")
        section.values["PDOMapping"] = "0"
    if kind in _BITS:
        _mend_numbers(section, _BITS[kind], kind in _SIGNED, findings)


def _mend_type(section: Section, findings: EdsFindings) -> int:
    text = section.values.get("DataType")
    kind = _number(text or "")
    if kind is None:
        said = "has no DataType" if not text else f"DataType {text!r} is not a number"
        findings.fault(section.line_of("DataType"), f"[{section.name}] {said}")
        return 0
    if kind not in _BITS and kind not in _OTHER_TYPES:
        what = "unknown" if kind <= _LAST_STANDARD else "a structure of the maker's"
        findings.mend(section, "DataType", f"data type {kind:X}h is {what}; read as plain bytes")
        section.values["DataType"] = _BYTES
        kind = int(_BYTES, 0)
    return kind


def _mend_numbers(section: Section, bits: int, signed: bool, findings: EdsFindings) -> None:
    """Default, value and limits of a whole number, as a number of the object's own type."""
    for key in ("DefaultValue", "ParameterValue", "LowLimit", "HighLimit"):
        text = section.values.get(key)
        if not text:
            section.values.pop(key, None)
            continue
        relative = _NODE_ID.search(text) is not None
        bare = re.sub(r"\+?\$NODEID\+?", "", text.replace(" ", "").upper()) or "0"
        value = _read_number(section, key, bare, findings)
        if value is None or not -(1 << bits - 1) <= value < 1 << bits:
            reason = "is not a number" if value is None else f"does not fit into {bits} bits"
            findings.mend(section, key, f"{key} {text!r} {reason}; left out")
            del section.values[key]
        elif relative:
            section.values[key] = f"$NODEID+{value:#x}" if value >= 0 else f"$NODEID{value}"
        else:
            kept = _of_type(value, bits, signed)
            if kept != value or _ZEROS.match(bare):
                section.values[key] = str(kept)


def _mend_node_id(section: Section, node: int | None, findings: EdsFindings) -> None:
    """A value of one node, of an object whose default follows the node's number."""
    default, text = (section.values.get(key, "") for key in ("DefaultValue", "ParameterValue"))
    value = _number(text)
    if "$NODEID" not in default or "$NODEID" in text or value is None:
        return
    base = _number(default.removeprefix("$NODEID+")) or 0
    meant = (value & _COB_ID) - (base & _COB_ID)
    said = f"ParameterValue {text} stands against DefaultValue {default}: "
    if 1 <= meant <= _NODES and node in (None, meant):
        section.values["ParameterValue"] = f"$NODEID+{value - meant:#x}"
        said += f"it is of node {meant}, read as $NODEID+{value - meant:#x}"
    else:
        said += "it is the same for every node" + (f", {node} included" if node else "")
    findings.mend(section, "ParameterValue", said)


def _of_type(value: int, bits: int, signed: bool) -> int:
    """The number of a type whose bits are those of ``value``."""
    value &= (1 << bits) - 1
    return value - (1 << bits) if signed and value >> bits - 1 else value


def _names(sections: dict[str, Section], owner: Section, findings: EdsFindings) -> list[Section]:
    names = sections.get(f"{owner.name}Name")
    if names is None:
        return []
    _without_zeros(names, ("NrOfEntries",), findings)
    if _number(names.values.get("NrOfEntries", "")) is None or "CompactSubObj" not in owner.values:
        findings.mend(names, "", "is left out: it names no compact array's entries")
        return []
    return [names]


def _check_lists(
    sections: dict[str, Section], objects: dict[int, Section], findings: EdsFindings
) -> None:
    listed: set[int] = set()
    for name in _LISTS:
        section = sections.get(name)
        if section is not None:
            listed |= _check_list(section, objects, findings)
    for index in MANDATORY:
        if index not in objects:
            findings.warn(1, f"the mandatory object {index:04X}h is missing")
    for index, section in objects.items():
        if index >= _FIRST_OBJECT and index not in listed:
            findings.mend(section, "", "is in no list of objects")


def _check_list(section: Section, objects: dict[int, Section], findings: EdsFindings) -> set[int]:
    listed: set[int] = set()
    entries = {key: text for key, text in section.values.items() if key.isdigit()}
    for key, text in entries.items():
        index = _number(text)
        if index is None:
            findings.mend(section, key, f"{key}={text} is not an index")
        else:
            listed.add(index)
            if index not in objects:
                findings.mend(section, key, f"lists {index:04X}h, which has no section")
    said = section.values.get("SupportedObjects", "")
    if _number(said) != len(entries):
        text = f"SupportedObjects is {said or 'missing'}, but {len(entries)} are listed"
        findings.mend(section, "SupportedObjects", text)
    return listed
