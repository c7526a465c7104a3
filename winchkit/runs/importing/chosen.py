"""Columns that were chosen for channels, while their units are determined."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.assignment import Candidate, Confidence, Question
from winchkit.runs.importing.formats.stamps import read_stamps
from winchkit.runs.importing.table import Column, Table
from winchkit.runs.importing.unit_spelling import COUNTS
from winchkit.schema.linear_axis import rotary_name


@dataclass(eq=False)
class ChosenColumn:
    """A chosen column while its unit is determined."""

    candidate: Candidate
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
    def column(self) -> Column:
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

    table: Table
    answers: Answers
    columns: list[ChosenColumn] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    measured: dict[str, float] = field(default_factory=dict)
    """SI value of 1 of a velocity without a unit, by its ratio to the angle; by column."""
    doubts: dict[str, str] = field(default_factory=dict)
    """Why a unit by convention is not taken; by column."""


def clock_of(work: Work, item: ChosenColumn) -> ChosenColumn | None:
    """The time column of a column: the last one before it in its group, else the first."""
    clocks = [c for c in work.columns if c.base == "time" and c.column.group == item.column.group]
    before = [c for c in clocks if c.column.number < item.column.number]
    return before[-1] if before else clocks[0] if clocks else None


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
    values = item.column.values[np.isfinite(item.column.values)]
    return is_whole(item) and float(np.ptp(values)) > 300


def is_whole(item: ChosenColumn) -> bool:
    """Whether a column without a unit has whole numbers only, as counts are."""
    values = item.column.values[np.isfinite(item.column.values)]
    return item.candidate.unit is None and bool(np.all(values == np.round(values)))
