"""Devices, profiles and simulated benches by name or path, installed or in a checkout."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal

from winchkit.arguments import path_of
from winchkit.errors import FileError, UsageError, suggest
from winchkit.regular_file import file_kind

Kind = Literal["devices", "profiles", "sim"]

_SINGULAR: dict[Kind, str] = {"devices": "device", "profiles": "profile", "sim": "simulated bench"}


def folder(kind: Kind) -> Path:
    """The folder of shipped declarations: inside the wheel, else in the checkout."""
    package = Path(str(files("winchkit")))
    shipped = package / "_data" / kind
    return shipped if shipped.is_dir() else package.parent / kind


def names(kind: Kind) -> list[str]:
    """Names that :func:`find` knows for a kind, sorted."""
    if kind == "devices":
        return sorted(path.parent.name for path in folder(kind).glob("*/device.toml"))
    return sorted(path.stem for path in folder(kind).glob("*.toml"))


def find(kind: Kind, name: str, beside: str | Path | None = None) -> Path:
    """Path of a declaration by shipped name or by path.

    Parameters
    ----------
    kind : str
        ``devices``, ``profiles`` or ``sim``.
    name : str
        Shipped name, or path.
    beside : str or Path, optional
        File in whose folder relative paths are tried too; it is not found itself.

    Returns
    -------
    Path
        An existing regular file.

    Raises
    ------
    FileError
        With the known names where there is none.
    UsageError
        For another kind, or a name that is not text.
    """
    if kind not in _SINGULAR:
        raise UsageError(f"kind is {kind!r}; pass one of {', '.join(_SINGULAR)}")
    name = str(path_of(name, "name"))
    leaf = "device.toml" if kind == "devices" else ""
    base = Path(beside).parent if beside else Path()
    asking = Path(beside).resolve() if beside else None
    for candidate in (base / name, base / f"{name}.toml", Path(name)):
        if candidate.is_file() and candidate.resolve() != asking:
            return candidate
        if leaf and (candidate / leaf).is_file():
            return candidate / leaf
    shipped = folder(kind) / name / leaf if leaf else folder(kind) / f"{name}.toml"
    if shipped.is_file():
        return shipped
    if Path(name).exists() and (special := file_kind(Path(name).stat().st_mode)):
        raise FileError(f"{name}: is {special} and no {_SINGULAR[kind]}; name a file")
    known = [own for own in names(kind) if not own.startswith("programme-")]
    listed = f" ({', '.join(known)})" if known else ""
    there = sorted(path.name for path in base.glob("*.toml"))
    other = next((_SINGULAR[each] for each in _SINGULAR if name in names(each)), None)
    raise FileError(
        f"there is no {_SINGULAR[kind]} '{name}', neither as a file nor shipped{listed}"
        + (f"; '{name}' is a shipped {other}" if other else suggest(name, [*known, *there]))
    )
