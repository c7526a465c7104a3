"""Stamps of the source of a message beside the log time of its recorder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from winchkit.runs.importing.assignment import Work
from winchkit.runs.importing.consistency import CLOCKS
from winchkit.runs.importing.formats.stamps import epoch_unit
from winchkit.runs.importing.names import meaning_of, words_of
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.units.spelling import read_unit

SOURCE_STAMP, LOG_TIME = "header.stamp", "log_time"
"""Names of the columns of a topic."""


def is_source_stamp(column: FileColumn) -> bool:
    """Whether a column is the stamp of its message: ``header.stamp``, ``/joints/header/stamp``."""
    return words_of(column.name).endswith("header stamp")


def has_two_clocks(work: Work) -> bool:
    """Whether some topics have a stamp of their source, and others the log time only."""
    names = {item.column.name for item in work.columns if item.base == "time"}
    return names == {SOURCE_STAMP, LOG_TIME}


def without_stamps(table: ColumnTable) -> tuple[ColumnTable, str]:
    """The table with log times only, and a note."""
    groups = {item.group for item in table.columns if item.name == SOURCE_STAMP}
    bare = {item.group for item in table.columns} - groups
    columns = tuple(item for item in table.columns if item.name != SOURCE_STAMP)
    note = (
        f"log time is the time of all topics: no usable {SOURCE_STAMP} in {', '.join(sorted(bare))}"
    )
    return replace(table, columns=columns), note


def delays(work: Work) -> Iterator[str]:
    """Notes on the delay of the log time after the stamp that is used, by topic."""
    for clock in work.columns:
        group = clock.column.group
        own = [c for c in work.table.columns if c.group == group and len(c) == len(clock.column)]
        stamps = [c for c in own if is_source_stamp(c)]
        logged = [c for c in own if c not in stamps and _is_log_time(c)]
        if clock.base != "time" or len(stamps) != 1 or not logged:
            continue
        stamp, log = stamps[0], logged[0]
        seconds = [_seconds_of(column) for column in (stamp, log)]
        topic = f"{group}: " if group else ""
        if clock.column.source == log.source:
            yield f"{topic}time is the log time; {stamp.source} goes back or repeats"
        if clock.column.source != stamp.source or seconds[0] is None or seconds[1] is None:
            continue
        # The difference first: nanoseconds since 1970 have no digits left for its fraction.
        is_same = seconds[0] == seconds[1]
        delay = (
            (log.values - stamp.values) * seconds[0]
            if is_same
            else log.values * seconds[1] - stamp.values * seconds[0]
        )
        low, middle, high = np.nanpercentile(delay, [5, 50, 95])
        text = (
            f"{topic}time is {stamp.name}; the delay of the log time is {_seconds(middle)} "
            f"(90 % of the messages: {_seconds(low)} to {_seconds(high)})"
        )
        steps = np.diff(log.values) * seconds[1]
        if np.any(steps < 0):
            text += f"; the log time goes back by up to {_seconds(-float(np.nanmin(steps)))}"
        yield text


def _is_log_time(column: FileColumn) -> bool:
    meaning = meaning_of(column.name, column.labels)
    is_named = meaning is not None and meaning.channel == "time"
    return is_named and column.texts is None and _seconds_of(column) is not None


def _seconds_of(column: FileColumn) -> float | None:
    """Seconds of one unit of a clock; None where neither the file nor its values say so."""
    unit, epoch = read_unit(column.unit), epoch_unit(column.values)
    return unit.factor if unit is not None else CLOCKS.get(epoch or "")


def _seconds(value: float) -> str:
    return f"{value * 1e3:.3g} ms" if abs(value) < 1 else f"{value:.6g} s"
