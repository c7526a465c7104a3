"""Assignment of a column to a channel, with its unit, factor and confidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from winchkit.runs.importing.table import Table

__all__ = ["Assignment", "Confidence", "Guess", "Question"]

Confidence = Literal["given", "named", "derived", "assumed", "unused"]
"""``given`` by the user or a mapping, ``named`` by name and unit in the file, ``derived`` from the
unit alone or from other columns, ``assumed`` by convention, ``unused``."""


@dataclass(frozen=True)
class Assignment:
    """One column: SI value = factor × number + offset."""

    source: str
    """Unique name of the column."""
    channel: str
    """Channel of a run; empty for a column that is not used."""
    unit: str = ""
    """Unit in the file; ``stamp`` for dates and times of day as text, ``excel`` for serial days."""
    factor: float = 1.0
    offset: float = 0.0
    confidence: Confidence = "unused"
    reason: str = ""


@dataclass(frozen=True)
class Question:
    """What cannot be known from the file, and the option that answers."""

    text: str
    options: tuple[str, ...]
    """Options of the command, each of which answers."""
    key: str = ""
    """Field of :class:`~winchkit.runs.importing.answers.Answers`; empty for a column."""
    dimension: str = ""
    """Dimension of the answer."""


@dataclass(frozen=True)
class Guess:
    """Assignments of all columns of a table."""

    table: Table
    assignments: tuple[Assignment, ...]
    questions: tuple[Question, ...] = ()
    notes: tuple[str, ...] = ()
    sample_rate: float | None = None
    """Rate of the rows in place of time stamps, Hz."""
    axis: str = ""
    """Column that names the axis of each row, of a table in long form."""
    whole: Table | None = None
    """The table in long form; ``table`` is that of its first axis."""

    @property
    def file(self) -> Table:
        """Everything that was read."""
        return self.whole or self.table

    @property
    def used(self) -> tuple[Assignment, ...]:
        """Assignments with a channel."""
        return tuple(item for item in self.assignments if item.channel)

    @property
    def is_certain(self) -> bool:
        """Whether every used column is given or named, and nothing is asked."""
        sure = {"given", "named"}
        return not self.questions and all(item.confidence in sure for item in self.used)
