"""Writing of the bench file of a live simulated bench."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from winchkit.catalog import Kind, find, folder
from winchkit.regular_file import file_errors
from winchkit.schema.bench import BenchSpec
from winchkit.sim.physics.parameters import quantity_of
from winchkit.units import UNITS, is_bare

_MARK = "# written by winchkit: the bench of a simulation"
"""First line, by which a later simulation knows that it may write over the file."""

_NOT_IN_FILES = ("path", "latch_file")


def write_bench(bench: BenchSpec, path: Path) -> Path:
    """Write a bench as a file; FileError where that is not possible."""
    with file_errors(path):
        path.write_text(f"{_MARK}\n{bench_toml(bench)}", encoding="utf-8")
    return path


def is_written_here(path: Path) -> bool:
    """Whether :func:`write_bench` wrote this file; FileError where it cannot be read."""
    with file_errors(path, "read"), path.open(encoding="utf-8", errors="replace") as lines:
        return lines.readline(len(_MARK)) == _MARK


def bench_toml(bench: BenchSpec) -> str:
    """TOML of a bench in SI units; profiles and devices given by path become absolute."""
    lines = ["schema = 1", 'kind = "bench"', *_lines(bench, "", bench.path)]
    return "\n".join(lines) + "\n"


def _lines(table: Any, at: str, beside: str) -> Iterator[str]:
    """Plain keys first, then the tables below."""
    below = []
    for key, value, text in _items(table, beside):
        if text is None:
            below.append((key, value))
        else:
            yield f"{key} = {text}"
    for key, value in below:
        named = value.items() if isinstance(value, Mapping) else [(None, value)]
        for name, inner in named:
            path = ".".join(part for part in (at, key, name and _key(name)) if part)
            yield from ("", f"[{path}]", *_lines(inner, path, beside))


def _items(table: Any, beside: str) -> Iterator[tuple[str, Any, str | None]]:
    hints = get_type_hints(type(table), include_extras=True)
    for field in dataclasses.fields(table):
        value = getattr(table, field.name)
        if value is None or field.name in _NOT_IN_FILES or value == field.default:
            continue
        if isinstance(value, Mapping) or dataclasses.is_dataclass(value):
            yield field.name, value, None
        else:
            yield field.name, value, _text(_located(field.name, value, beside), hints[field.name])


def _located(key: str, value: Any, beside: str) -> Any:
    """Absolute path of a file that is declared relative to the declaration."""
    if key == "effects" and beside:
        return tuple(str((Path(beside).parent / file).resolve()) for file in value)
    if key == "calibration" and beside:
        return str((Path(beside).parent / value).resolve())
    kinds: dict[str, Kind] = {"profile": "profiles", "device": "devices"}
    if key not in kinds or not beside:
        return value
    found = find(kinds[key], value, beside=beside)
    return value if found.is_relative_to(folder(kinds[key])) else str(found.resolve())


def _text(value: Any, hint: Any) -> str:
    if isinstance(value, tuple):
        of_alternatives = (arg for arg in get_args(hint) if arg is not type(None))
        inner = hint if get_origin(hint) is tuple else next(of_alternatives, hint)
        item = next(iter(get_args(inner)), inner)
        return "[" + ", ".join(_text(one, item) for one in value) + "]"
    marker = quantity_of(hint)
    if isinstance(value, float) and marker is not None:
        unit = next(iter(UNITS[marker.dimension]))
        return repr(value) if is_bare(marker.dimension) else json.dumps(f"{value!r} {unit}")
    return json.dumps(value)


def _key(name: str) -> str:
    return name if name.isidentifier() and name.isascii() else json.dumps(name)
