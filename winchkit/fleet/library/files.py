"""Files of runs below a folder: parts of one log together, mappings of other programs' files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from winchkit.regular_file import read_text
from winchkit.runs.read import SUFFIXES

_FOREIGN = (".txt", ".tsv", ".dat", ".xlsx", ".mat", ".h5", ".hdf5", ".npz", ".npy", ".parquet")
"""Suffixes of files of other programs, which are runs where a mapping is above them."""
_PART = re.compile(r"(.+)\.\d{3,}")
_MAPPING = re.compile(r"""^kind\s*=\s*["']mapping["']""", re.MULTILINE)


@dataclass(frozen=True)
class RunFile:
    """A file that may be a run, or the parts of one log."""

    path: str
    """Below the library, with ``/``."""
    files: tuple[Path, ...]
    mappings: tuple[Path, ...]
    """Mappings of its folder, then of those above, up to the library."""
    size: int
    """Of all parts, bytes."""
    mtime: int
    """Date of change of the newest part or mapping, ns since 1970."""

    @property
    def is_native(self) -> bool:
        """Whether its suffix is one of winchkit's own formats."""
        return self.path.endswith(SUFFIXES)


def run_files(library: Path) -> Iterator[RunFile]:
    """Files below a folder that may be runs, in the order of their paths."""
    above: dict[Path, tuple[tuple[Path, int], ...]] = {}
    for place, folders, names in os.walk(library):
        folder = Path(place)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        inherited = above.get(folder.parent, ()) if folder != library else ()
        mappings = above[folder] = (*_mappings(folder, names), *inherited)
        kinds = SUFFIXES + (_FOREIGN if mappings else ())
        groups: dict[str, list[str]] = {}
        for name in sorted(names):
            if name.endswith(kinds) and not name.startswith("."):
                stem, suffix = os.path.splitext(name)
                part = _PART.fullmatch(stem)
                common = f"{part[1]}{suffix}" if part and suffix in SUFFIXES else name
                groups.setdefault(name if common in names else common, []).append(name)
        for name, parts in groups.items():
            found = _run_file(folder / name, library, [folder / p for p in parts], mappings)
            if found is not None:
                yield found


def _run_file(
    path: Path, library: Path, files: list[Path], mappings: tuple[tuple[Path, int], ...]
) -> RunFile | None:
    """None for a file that was removed meanwhile."""
    try:
        states = [file.stat() for file in files]
    except FileNotFoundError:
        return None
    return RunFile(
        path.relative_to(library).as_posix(),
        tuple(files),
        tuple(mapping for mapping, _ in mappings),
        sum(state.st_size for state in states),
        max([state.st_mtime_ns for state in states] + [changed for _, changed in mappings]),
    )


def _mappings(folder: Path, names: list[str]) -> Iterator[tuple[Path, int]]:
    for name in sorted(names):
        if name.endswith(".toml"):
            path = folder / name
            try:
                if _MAPPING.search(read_text(path)):
                    yield path, path.stat().st_mtime_ns
            except (OSError, UnicodeDecodeError):
                continue
