"""Checks of names and files before a bus is opened, a person is asked, or anything moves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.errors import Fault, FileError, UsageError
from winchkit.schema.programme import ALL

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.programme import Programme


def check_output(path: str | Path, suffixes: tuple[str, ...]) -> None:
    """Raise UsageError for an output of another format, in no folder, or that is a folder."""
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        known = " or ".join(suffixes)
        what = f"'{target.suffix}' is no format for it" if target.suffix else "it has no ending"
        raise UsageError(f"-o {path}: {what}; name a {known} file")
    if target.is_dir():
        raise UsageError(f"-o {path}: is a folder; name a file")
    if not target.parent.is_dir():
        raise UsageError(f"-o {path}: there is no folder '{target.parent}'; make it first")


def check_new_file(path: str | Path, _option: str = "-o") -> None:
    """Raise FileError for a file that cannot be written: a folder, in none, not permitted."""
    target = Path(path)
    if target.is_dir():
        raise FileError(Fault("cannot be written: it is a folder; name a file", str(path)))
    if not target.parent.is_dir():
        reason = f"there is no folder '{target.parent}'; make it first"
        raise FileError(Fault(f"cannot be written: {reason}", str(path)))
    _check_permission(target if target.exists() else target.parent, path)


def check_new_profile(path: str | Path, option: str = "-o") -> None:
    """Raise UsageError for a file that is no .toml file, FileError as :func:`check_new_file`."""
    if Path(path).suffix.lower() != ".toml":
        raise UsageError(f"{option} {path}: a profile is a .toml file; name one")
    check_new_file(path, option)


def check_folder(path: str | Path, option: str = "-o") -> None:
    """Raise UsageError where a file is in a folder's way, FileError where it cannot be written."""
    places = (Path(path), *Path(path).parents)
    for place in places:
        if place.exists() and not place.is_dir():
            raise UsageError(
                f"{option} {path}: '{place}' is a file, and no folder can be made there"
            )
    _check_permission(next(place for place in places if place.is_dir()), path)


def _check_permission(place: Path, path: str | Path) -> None:
    if not os.access(place, os.W_OK):
        kind = "folder" if place.is_dir() else "file"
        raise FileError(
            Fault(f"cannot be written: no permission for the {kind} '{place}'", str(path))
        )


def check_exists(path: str | Path) -> None:
    """Raise FileError where there is no such file."""
    if not Path(path).exists():
        raise FileError(Fault("there is no such file", str(path)))


def check_file(path: str | Path) -> None:
    """Raise FileError where there is no such file, or where it is a folder."""
    check_exists(path)
    if Path(path).is_dir():
        raise FileError(Fault("is a folder; name the files in it", str(path)))


def check_bench(path: str | Path) -> None:
    """Raise FileError for a bench file that is missing, with the benches of its folder."""
    if Path(path).exists():
        return
    from winchkit.cli.core.completion import files_of_kind

    known = ", ".join(str(own) for own in files_of_kind(Path(path).parent, ("bench",)))
    there = f"the benches there are {known}" if known else "its folder has no bench file"
    raise FileError(Fault(f"there is no such file; {there}", str(path)))


def check_winches(programme: Programme, bench: BenchSpec) -> None:
    """Raise UsageError for a step of a winch that the bench lacks."""
    for step in programme.step:
        if step.winch != ALL and (step.to is not None or step.by is not None):
            bench.winch_named(step.winch)
