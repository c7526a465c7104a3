"""Columns of a recording of another program, before channels and units are assigned."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, WinchkitError

LARGEST = 1 << 30
"""Largest size of a file, of its unpacked content and of its numbers, bytes."""


@dataclass(frozen=True, eq=False)
class FileColumn:
    """One column of a file, in the unit of the file."""

    name: str
    """Name without its unit, from the lowest row of the header."""
    values: Array
    """Shape (n,); NaN for a missing value and for text."""
    unit: str = ""
    """Unit as spelled in the file; empty where it gives none."""
    labels: tuple[str, ...] = ()
    """Texts of higher rows of the header, e.g. the marker of a tracker."""
    texts: Sequence[str] | None = None
    """Cells of a column of text, of dates or of times of day; None for numbers."""
    wrong: tuple[tuple[int, str], ...] = ()
    """Rows of a column of numbers that have a text, with the text."""
    group: str = ""
    """Sheet, topic or length: columns of one group are sampled together."""
    number: int = 0
    """Position in the file, from 1."""
    source: str = ""
    """Name that is unique within the file."""
    modulus: float = math.inf
    """Range of the counter that its numbers are of; infinite where the file does not say."""
    is_derived: bool = False
    """Whether it is computed of other columns, whose names say nothing about its unit."""

    def __len__(self) -> int:
        return len(self.values)

    @property
    def known(self) -> Array:
        """The values that are not missing, (m,)."""
        return self.values[np.isfinite(self.values)]

    def at(self, rows: NDArray[np.intp]) -> FileColumn:
        """The same column at some of its rows, shape (m,)."""
        place = {int(row): number for number, row in enumerate(rows)}
        texts = self.texts
        return replace(
            self,
            values=self.values[rows],
            texts=None if texts is None else [texts[row] for row in place],
            wrong=tuple((place[row], text) for row, text in self.wrong if row in place),
        )


@dataclass(frozen=True)
class ColumnTable:
    """Content of a file."""

    path: str
    layout: str
    """Description of the format, e.g. ``text in UTF-16, semicolons, decimal comma``."""
    columns: tuple[FileColumn, ...]
    line_of: Callable[[int], int | None] = lambda _row: None
    """Line of the file of a row; None where the format has no lines."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Keys and values above the header."""
    constants: Mapping[str, float] = field(default_factory=dict)
    """Variables with a single number, e.g. a gain."""
    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()
    interval: float | None = None
    """Sampling interval that the file declares, s."""

    def column(self, source: str) -> FileColumn | None:
        """The column of a unique name; else of a number, or of a name with its unit: ``q_deg``."""
        found = next((item for item in self.columns if item.source == source), None)
        if found is not None:
            return found
        if source.isdecimal():
            return next((item for item in self.columns if str(item.number) == source), None)
        own = _letters(source)
        same = [c for c in self.columns if own and c.unit and own == _letters(c.name + c.unit)]
        return same[0] if len(same) == 1 else None

    def rearranged(self, columns: Sequence[FileColumn], note: str) -> ColumnTable:
        """The file with other columns, whose rows are no lines of it."""
        return replace(
            self,
            columns=named_apart(columns),
            line_of=lambda _row: None,
            interval=None,
            notes=(*self.notes, note),
        )


def _letters(text: str) -> str:
    """Letters and digits of a name, whatever separates them."""
    return "".join(filter(str.isalnum, text.casefold()))


def clock_before(clocks: Sequence[FileColumn], column: FileColumn) -> FileColumn | None:
    """The time column of a column: the last one before it in its group, else the first."""
    own = [item for item in clocks if item.group == column.group]
    before = [item for item in own if item.number < column.number]
    return before[-1] if before else own[0] if own else None


def named_apart(columns: Sequence[FileColumn]) -> tuple[FileColumn, ...]:
    """Columns with numbers and unique names in ``source``, by their labels or else ``#2``."""
    names = Counter(item.name for item in columns)
    full = [
        item.name if names[item.name] == 1 else " ".join((*item.labels, item.name))
        for item in columns
    ]
    seen: dict[str, int] = {}
    found = []
    for number, (item, name) in enumerate(zip(columns, full, strict=True), start=1):
        seen[name] = seen.get(name, 0) + 1
        source = name if seen[name] == 1 else f"{name} #{seen[name]}"
        found.append(replace(item, number=number, source=source))
    return tuple(found)


def are_whole(values: Array) -> bool:
    """Whether finite numbers, (n,), are whole; true without any."""
    return bool(np.all(values == np.round(values)))


@contextmanager
def readable(path: str, kind: str) -> Iterator[None]:
    """Convert what a library raises for a damaged file of a kind to RunError."""
    try:
        yield
    except WinchkitError:
        raise
    except Exception as error:  # noqa: BLE001 - libraries raise many kinds, even of their own bugs
        raise RunError(Fault(f"is not a readable {kind}: {error}", path)) from None


def refuse_size(path: str, size: int, what: str) -> None:
    """Raise RunError for a content beyond :data:`LARGEST`."""
    if size > LARGEST:
        message = (
            f"{what} of {size / 1e9:.3g} GB; at most {LARGEST / 1e9:.3g} GB are imported: split "
            "the recording"
        )
        raise RunError(Fault(message, path))
