"""Reader of EDS, DCF, XDD and XDC files, which repairs faults and reports each with its line.

Makers' files often deviate from CiA 306. The result is valid text of the format; every repair is a
warning with its line. A file with faults that have no unique repair is refused, with all its faults
in one error.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import count
from pathlib import Path
from types import MappingProxyType

from winchkit.errors import Fault, FileError
from winchkit.regular_file import regular
from winchkit.schema.eds.repair import EdsFindings, Section, canonical, canonical_key, mend
from winchkit.schema.eds.xdd import read_xml

SUFFIXES = (".eds", ".dcf", ".xdd", ".xdc")
"""Descriptions of a device by its maker, and of a device as it is set up (DCF, XDC)."""

_LARGEST = 8_000_000
"""Bytes: an EDS has some hundred kilobytes; a wrong file does not fill the memory."""
_SECTION = re.compile(r"\[\s*(.*?)\s*\]\s*$")
_INLINE_COMMENT = re.compile(r"\s;.*$")
_LISTS = ("mandatoryobjects", "optionalobjects", "manufacturerobjects")
_MAKERS_OWN = range(0x2000, 0x6000)


@dataclass(frozen=True)
class EdsText:
    """A valid EDS, and the repairs."""

    path: str
    text: str
    warnings: tuple[Fault, ...]
    lines: Mapping[tuple[int, int | None], int]
    """Line of the section of each object and sub-index."""


def read_eds_text(path: str | Path) -> EdsText:
    """Read an EDS, DCF, XDD or XDC file; FileError with every line that cannot be repaired."""
    return _parsed(str(path), _bytes(Path(path)))


@lru_cache(maxsize=32)
def _parsed(path: str, data: bytes) -> EdsText:
    """Text of a file: a bench reads that of a drive once for each of its winches."""
    findings = EdsFindings(path)
    sections = _sections(_text(path, data, findings), findings)
    if findings.faults:
        raise FileError(findings.faults)
    mended = mend(sections, findings)
    if findings.faults:
        raise FileError(findings.faults)
    lines = {
        (one.index, one.sub): one.line
        for one in mended
        if one.index is not None and not one.names_subs
    }
    return EdsText(path, _written(mended), tuple(findings.warnings), MappingProxyType(lines))


def _bytes(path: Path) -> bytes:
    try:
        with open(path, "rb", opener=regular) as stream:
            data = stream.read(_LARGEST + 1)
    except OSError as error:
        raise FileError(Fault(f"cannot be read: {error.strerror}", str(path))) from None
    if len(data) > _LARGEST:
        reason = f"larger than {_LARGEST / 1e6:g} MB, so it is not an EDS"
        raise FileError(Fault(reason, str(path)))
    return data


def _text(path: str, data: bytes, findings: EdsFindings) -> str:
    if b"\0" in data:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        raise FileError(Fault("is binary, not the text of an EDS", path, line))
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        findings.warn(line, f"byte {data[error.start]:02X}h is not UTF-8; read as Latin-1")
        return data.decode("latin-1")


def _sections(text: str, findings: EdsFindings) -> list[Section]:
    """Split into sections; the first of two equal ones is kept."""
    found: dict[str, Section] = {}
    is_xml = text.lstrip().startswith("<")
    sections = read_xml(text, findings) if is_xml else _text_sections(text, findings)
    for section in sections:
        _keep_first(found, section, findings)
    return [section for section in found.values() if not section.contradicts]


def _text_sections(text: str, findings: EdsFindings) -> list[Section]:
    """Sections of CiA 306 in the order of the file."""
    sections: list[Section] = []
    for number, raw in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1):
        line = _INLINE_COMMENT.sub("", raw).strip()
        if not line or line[0] in ";#":
            continue
        head = _SECTION.match(line)
        if head:
            sections.append(Section(canonical(head[1]), number))
        elif line.startswith("["):
            findings.fault(number, f"{line!r} is not a section; it should read [name]")
            sections.append(Section(line, number))
        elif not sections:
            findings.fault(
                number, f"is not an EDS: expected a section such as [FileInfo], not {line!r}"
            )
            return []
        else:
            _take_key(sections[-1], number, line, findings)
    if not sections:
        findings.fault(1, "is not an EDS: it has no sections")
    return sections


def _take_key(section: Section, number: int, line: str, findings: EdsFindings) -> None:
    key, equals, value = (part.strip() for part in line.partition("="))
    if not equals or not key:
        findings.warn(number, f"{line!r} is neither a section nor key=value; left out")
        return
    key = canonical_key(key)
    before = section.values.get(key)
    if before is None:
        section.values[key], section.lines[key] = value, number
    elif before == value:
        findings.warn(number, f"[{section.name}] {key} stands twice; the same both times")
    elif _is_list(section) and key.isdigit():
        findings.warn(
            number,
            f"[{section.name}] has number {key} twice, here and on line "
            f"{section.lines[key]}; both entries count",
        )
        _append(section, value, number)
    else:
        said = f"[{section.name}] {key} is {value!r} here and {before!r} on line"
        said += f" {section.lines[key]}"
        if section.uses(key):
            findings.fault(number, said)
        else:
            findings.warn(number, f"{said}; it is not used, the first counts")


def _is_list(section: Section) -> bool:
    return section.name.casefold() in _LISTS


def _append(section: Section, value: str, line: int) -> None:
    """Add an entry to a list of objects under a number that is free."""
    if value in (text for key, text in section.values.items() if key.isdigit()):
        return
    free = next(key for number in count(1) if (key := str(number)) not in section.values)
    section.values[free], section.lines[free] = value, line


def _keep_first(found: dict[str, Section], section: Section, findings: EdsFindings) -> None:
    """Keep the first of two sections of one name; an ambiguous difference is a fault."""
    first = found.setdefault(section.name.casefold(), section)
    if first is section:
        return
    twice = f"[{section.name}] stands a second time"
    if first.values == section.values:
        findings.warn(section.line, f"{twice}, as on line {first.line}")
        return
    if _is_list(section):
        findings.warn(section.line, f"{twice}; its entries are added to those of line {first.line}")
        for key, value in section.values.items():
            if key.isdigit():
                _append(first, value, section.lines[key])
        first.values["SupportedObjects"] = str(sum(key.isdigit() for key in first.values))
        return
    keys = first.values.keys() | section.values.keys()
    differing = [key for key in keys if first.values.get(key) != section.values.get(key)]
    if not any(section.uses(key) for key in differing):
        findings.warn(section.line, f"{twice}; what differs is not used, line {first.line} counts")
    elif section.index in _MAKERS_OWN:
        findings.warn(
            section.line, f"{twice} and differs from line {first.line}; the object is left out"
        )
        first.contradicts = True
    else:
        findings.fault(
            section.line, f"{twice} and differs from line {first.line}; take out one of them"
        )


def _written(sections: list[Section]) -> str:
    rows: list[str] = []
    for section in sections:
        rows.append(f"[{section.name}]")
        rows += [f"{key}={value}" for key, value in section.values.items()]
        rows.append("")
    return "\n".join(rows)
