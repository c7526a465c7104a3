"""Stamps of the source of a message beside the log time of its recorder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from winchkit.runs.importing.assignment import Work
from winchkit.runs.importing.table import ColumnTable

SOURCE_STAMP, LOG_TIME = "header.stamp", "log_time"
"""Names of the columns of a topic."""


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
        group, name = clock.column.group, clock.column.name
        both = {c.name: c for c in work.table.columns if c.group == group}
        log = both.get(LOG_TIME)
        if clock.base != "time" or log is None or SOURCE_STAMP not in both:
            continue
        if name == LOG_TIME:
            yield f"{group}: time is the log time; {SOURCE_STAMP} goes back or repeats"
            continue
        delay = (log.values - clock.column.values) * 1e-9
        low, middle, high = np.percentile(delay, [5, 50, 95])
        text = (
            f"{group}: time is {SOURCE_STAMP}; the delay of the log time is {_seconds(middle)} "
            f"(90 % of the messages: {_seconds(low)} to {_seconds(high)})"
        )
        steps = np.diff(log.values) * 1e-9
        if np.any(steps < 0):
            text += f"; the log time goes back by up to {_seconds(-float(steps.min()))}"
        yield text


def _seconds(value: float) -> str:
    return f"{value * 1e3:.3g} ms" if abs(value) < 1 else f"{value:.6g} s"
