"""Assignment of a column to a channel: candidates, chosen columns, their unit and confidence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.formats.stamps import read_stamps
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import ColumnTable, FileColumn, are_whole, clock_before
from winchkit.runs.importing.units.known import COUNTS, SpelledUnit
from winchkit.schema.linear_axis import rotary_name
from winchkit.schema.mapping import CHANNEL_DIMENSIONS

_MEASURED = {"actual", "act", "ist", "measured", "meas"}
_PREFERRED = {*_MEASURED, "motor", "mot", "feedback", "fb", "estimate"}
_AVOIDED = {"output", "abtrieb", "raw", "filtered", "filt", "error", "gear", "phase", "bus", "dc"}
Confidence = Literal["given", "named", "derived", "assumed", "unused"]
"""``given`` by the user or a mapping, ``named`` by name and unit in the file, ``derived`` from the
unit alone or from other columns, ``assumed`` by convention, ``unused``."""


@dataclass(frozen=True)
class Assignment:
    """One column: SI value = factor × number + offset, of numbers as they were before storing."""

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
    stored: str = ""
    """How numbers that wrap or have lost their sign are stored: ``modulo 360``."""


@dataclass(frozen=True)
class Question:
    """A fact that the file lacks, and the option that supplies it."""

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

    table: ColumnTable
    assignments: tuple[Assignment, ...]
    questions: tuple[Question, ...] = ()
    notes: tuple[str, ...] = ()
    sample_rate: float | None = None
    """Rate of the rows in place of time stamps, Hz."""
    axis: str = ""
    """Column that names the axis of each row, of a table in long form."""
    kind: str = ""
    """Column that names the kind of each row, of a table whose rows have different quantities."""
    whole: ColumnTable | None = None
    """The table in long form; ``table`` is that of its first axis, or has columns by kind."""

    @property
    def file(self) -> ColumnTable:
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


@dataclass(frozen=True, eq=False)
class ChannelCandidate:
    """A column and the channel that it may be."""

    column: FileColumn
    channel: str
    """Empty where it is not used."""
    rank: int = 0
    unit: SpelledUnit | None = None
    reason: str = ""

    @property
    def order(self) -> tuple[int, bool, bool, int]:
        """Sort key: the best candidate first; one of an unknown unit (mm/mm) after the others, and
        one of another dimension (the volts of a force) after those of the channel's."""
        words = set(words_of(" ".join((*self.column.labels, self.column.name))).split())
        own = CHANNEL_DIMENSIONS.get(self.channel.rpartition(".")[2])
        is_other = own is not None and self.unit is not None and self.unit.dimension != own
        preference = len(words & _AVOIDED) - len(words & _PREFERRED)
        # Beside a measured torque, that of the feedback is the controller's.
        preference -= len(words & _MEASURED)
        is_foreign = bool(self.column.unit) and self.unit is None
        return self.rank, is_foreign, is_other, preference


@dataclass
class Choice:
    """Chosen columns by channel, and why others were not."""

    chosen: list[ChannelCandidate] = field(default_factory=list)
    """Candidates with their final channel."""
    unused: list[ChannelCandidate] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def leave(self, items: Iterable[ChannelCandidate], reason: str) -> None:
        """Note that columns are not used, and why."""
        self.unused += [replace(item, channel="", reason=reason) for item in items]


@dataclass(eq=False)
class ChosenColumn:
    """A chosen column while its unit is determined."""

    candidate: ChannelCandidate
    scale: float | None = None
    """Sign and factor that the user gives, by which the numbers are multiplied before the unit."""
    factor: float | None = None
    """SI value of 1 with its scale; None while unknown."""
    offset: float = 0.0
    unit: str = ""
    confidence: Confidence = "named"
    reason: str = ""
    stored: str = ""
    """How its numbers are stored, where they wrap or have lost their sign."""

    @property
    def column(self) -> FileColumn:
        """The column of the file."""
        return self.candidate.column

    @property
    def base(self) -> str:
        """Channel without a winch's name."""
        return self.candidate.channel.rpartition(".")[2]

    @property
    def role(self) -> str:
        """Channel without a winch's name; of a linear axis that of a rotary one."""
        return rotary_name(self.base)

    @property
    def size(self) -> float:
        """Magnitude of the scale."""
        return 1.0 if self.scale is None else abs(self.scale)

    def settle(self, si: float, unit: str, confidence: Confidence, reason: str) -> None:
        """Set the SI value of the unit, which the scale multiplies, with its origin."""
        self.factor = si if self.scale is None else si * self.scale
        self.unit, self.confidence, self.reason = unit, confidence, reason


@dataclass
class Work:
    """The guess of one table while it is made."""

    table: ColumnTable
    answers: Answers
    columns: list[ChosenColumn] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    measured: dict[str, float] = field(default_factory=dict)
    """SI value of 1 of a velocity without a unit, by its ratio to the angle; by column."""
    doubts: dict[str, str] = field(default_factory=dict)
    """Why a unit by convention is not taken; by column."""


def clock_of(work: Work, item: ChosenColumn) -> ChosenColumn | None:
    """The time column of a column."""
    clocks = {id(c.column): c for c in work.columns if c.base == "time"}
    found = clock_before([c.column for c in clocks.values()], item.column)
    return None if found is None else clocks[id(found)]


def clock_values(clock: ChosenColumn) -> Array:
    """Numbers of a time column, of its text where it has stamps."""
    if clock.column.texts is not None:
        return read_stamps(clock.column.texts).values
    return clock.column.values


def is_counted(item: ChosenColumn) -> bool:
    """Whether an angle is in counts, by its unit or as whole numbers of more than a turn's."""
    unit = item.candidate.unit
    if unit is not None:
        return unit.dimension == COUNTS
    return is_whole(item) and float(np.ptp(item.column.known)) > 300


def is_whole(item: ChosenColumn) -> bool:
    """Whether a column without a unit has whole numbers only, as counts are."""
    return item.candidate.unit is None and are_whole(item.column.known)
