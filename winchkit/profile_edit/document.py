"""A profile file as a TOML document with its comments, order and shorthand keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import ParseError
from tomlkit.items import AoT

from winchkit.errors import Fault, FileError
from winchkit.regular_file import file_errors, read_text, refuse_existing
from winchkit.schema.profiles.winch import SHORTHANDS
from winchkit.units import format_quantity


def read_document(path: Path) -> Any:
    """Parse a profile with its comments and layout. Raises FileError."""
    try:
        with file_errors(path, "read"):
            return tomlkit.parse(read_text(path))
    except (ParseError, UnicodeDecodeError) as error:
        raise FileError(Fault(f"is not TOML: {error}", str(path))) from error


def refuse_other(source: Path, out: Path, replace: bool) -> None:
    """Raise UsageError where ``out`` is another profile, which is not to be replaced."""
    refuse_existing(out, replace or (out.exists() and source.exists() and out.samefile(source)))


def write_document(document: Any, path: Path) -> None:
    """Write a document, empty lists of tables left out. Raises FileError, also without .toml."""
    if path.suffix.lower() != ".toml":
        raise FileError(Fault("a profile is a .toml file; name one", str(path)))
    for name in ("effect", "ledger"):
        if name in document and not len(document[name]):
            del document[name]
    with file_errors(path):
        path.write_text(tomlkit.dumps(document), encoding="utf-8")


def tables(document: Any, name: str) -> AoT:
    """The ``[[name]]`` tables of a document, created if there are none."""
    there = document.get(name)
    if not isinstance(there, AoT):
        there = tomlkit.aot()
        document[name] = there
    return there


def effect_tables(document: Any) -> AoT:
    """The ``[[effect]]`` tables."""
    return tables(document, "effect")


def shorthands(document: Any) -> dict[str, Any]:
    """Shorthand keys that a document has, such as ``cable.axial_stiffness``, as written."""
    out = {}
    for key in SHORTHANDS:
        part, _, name = key.partition(".")
        if name in document.get(part, {}):
            out[key] = document[part][name]
    return out


def written(value: float, unit: str) -> str | float:
    """A quantity as text with its unit; a number where there is no unit."""
    text = format_quantity(value, unit, digits=8)
    return float(text) if unit == "1" else text
