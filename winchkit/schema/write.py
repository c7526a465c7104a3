"""Writes declarations that were made in Python to files: programmes, and profiles of winches."""

from __future__ import annotations

import tomllib
from pathlib import Path

from winchkit.arguments import path_of, require_type
from winchkit.regular_file import file_errors, refuse_existing
from winchkit.schema.file_text import file_text
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import Programme
from winchkit.schema.reading.lines import lines_of_keys
from winchkit.schema.reading.parts import FileReading
from winchkit.schema.reading.source import TomlSource


def write_programme(programme: Programme, path: str | Path, *, replace: bool = False) -> None:
    """Write a programme file.

    Parameters
    ----------
    programme : Programme
        The programme.
    path : str or Path
        The file.
    replace : bool
        Write over an existing file.

    Raises
    ------
    UsageError
        Where the file exists and is not to be replaced.
    FileError
        Where it cannot be written.
    """
    require_type(programme, Programme, "programme")
    _write(path_of(path), file_text("programme", programme), replace)


def write_profile(profile: WinchProfile, path: str | Path, *, replace: bool = False) -> None:
    """Write the profile of a winch or of an axis, with its effects and its ledger.

    Parameters
    ----------
    profile : WinchProfile
        The profile, of SI numbers; its types are in ``winchkit.types``.
    path : str or Path
        The file.
    replace : bool
        Write over an existing file.

    Raises
    ------
    UsageError
        Where the file exists and is not to be replaced.
    FileError
        With every value that no profile may have, and where the file cannot be written.
    """
    require_type(profile, WinchProfile, "profile")
    path, kind = path_of(path), "axis" if isinstance(profile, AxisProfile) else "winch"
    text = file_text(kind, profile)
    tree = {k: v for k, v in tomllib.loads(text).items() if k not in {"schema", "kind"}}
    reading = FileReading(TomlSource(str(path), kind, tree, lines_of_keys(text)))
    if kind == "axis":
        reading.axis(tree)
    else:
        reading.winch(tree, profile.name)
    reading.refuse_faults()
    _write(path, text, replace)


def _write(path: Path, text: str, replace: bool) -> None:
    refuse_existing(path, replace)
    with file_errors(path):
        path.write_text(text, encoding="utf-8")
