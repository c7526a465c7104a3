"""Opening of a declaration: TOML text to a tree of plain values with the line of every key."""

from __future__ import annotations

import logging
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from winchkit import wings
from winchkit.arguments import path_of
from winchkit.errors import Fault, FileError, suggest
from winchkit.regular_file import read_whole
from winchkit.schema.reading.lines import Key, line_of, lines_of_keys

# As messages list them; those of robots are read by their wing.
KINDS = (
    "winch",
    "axis",
    "robot",
    "bench",
    "programme",
    "robot-programme",
    "sim-bench",
    "device",
    "size",
    "calibration",
    "tares",
    "mapping",
)
SCHEMA = 1
"""Of declarations, which counts on with each change that an older winchkit does not read."""
_LARGEST = 4_000_000
"""Bytes: a declaration has some kilobytes; a wrong file does not fill the memory."""
_LOGGER = logging.getLogger(__name__)


@dataclass(frozen=True)
class TomlSource:
    """A TOML file as read: its values, and the line of each."""

    path: str
    kind: str
    tree: dict[str, Any]
    """The top-level table without ``schema`` and ``kind``."""
    lines: dict[Key, int]

    def fault(self, key: Key, message: str) -> Fault:
        """A fault at a key, on its line or that of the table where it is missing."""
        return Fault(message, self.path, line_of(key, self.lines), spelled(key))


def spelled(key: Key) -> str:
    """A key with positions counted from 1: ``("pulley", 0, "radius")`` is ``pulley[1].radius``."""
    words = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in key)
    return words.removeprefix(".")


def open_source(path: str | Path) -> TomlSource:
    """Read a declaration of any kind; raises FileError for any other file."""
    text = _text(path_of(path))
    if not text.strip():
        raise FileError(Fault("the file is empty; a declaration starts with schema = 1", str(path)))
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(_syntax_fault(str(error), str(path), text)) from None
    except RecursionError:
        raise FileError(Fault("tables or lists are nested too deep", str(path))) from None
    source = _source(str(path), tree, lines_of_keys(text))
    _LOGGER.info("read %s: %s", path, source.kind)
    return source


def _text(path: Path) -> str:
    data = read_whole(path, "file", _LARGEST)
    if len(data) > _LARGEST:
        limit = f"larger than {_LARGEST / 1e6:g} MB, so it is not a declaration"
        raise FileError(Fault(limit, str(path)))
    if b"\0" in data:
        raise FileError(Fault("is a binary file, not TOML text", str(path)))
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"byte {data[error.start]:02X}h is not UTF-8; save the file as UTF-8 text"
        raise FileError(Fault(message, str(path), line)) from None


def _syntax_fault(message: str, path: str, text: str) -> Fault:
    if (suffix := Path(path).suffix) not in {"", ".toml"}:
        kind = f"is a {suffix} file, and no declaration"
        return Fault(f"{kind}: profiles, benches and programmes are TOML files", path)
    found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    if found is None:
        return Fault(f"TOML syntax: {message}", path)
    reason = message[: found.start()]
    if found[1] is None:
        return Fault(f"TOML syntax: {reason} at the end of the file", path, text.count("\n") + 1)
    return Fault(f"TOML syntax: {reason} at column {found[2]}", path, int(found[1]))


def _source(path: str, tree: dict[str, Any], lines: dict[Key, int]) -> TomlSource:
    kind = tree.pop("kind", None)
    schema = tree.pop("schema", None)
    source = TomlSource(path, str(kind), tree, lines)
    faults: list[Fault] = []
    if schema is None:
        faults.append(source.fault(("schema",), f"missing; write schema = {SCHEMA} first"))
    elif schema is True or schema != SCHEMA:
        faults.append(
            source.fault(("schema",), f"{schema!r} is unknown; this winchkit reads {SCHEMA}")
        )
    if kind is None:
        faults.append(source.fault(("kind",), f"missing; use one of {', '.join(KINDS)}"))
    elif kind not in KINDS and wings.reader(str(kind)) is None:
        message = f"unknown kind {kind!r}; use one of {', '.join(KINDS)}"
        faults.append(source.fault(("kind",), message + suggest(str(kind), list(KINDS))))
    if faults:
        raise FileError(faults)
    return source
