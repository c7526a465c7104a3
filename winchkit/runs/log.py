"""A log of a bench: every source with its own time stamps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.runs.align import Aligner
from winchkit.runs.assemble import RawColumns, assemble
from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSamples, SourceSignal
from winchkit.runs.run import Run

_BRIDGED = 1.5
"""In sampling intervals: midway between the usual step and one lost sample."""


@dataclass(frozen=True)
class Note:
    """An event, or the counters at a time."""

    time: float
    """On the bench's clock, s."""
    value: Mapping[str, Any]


def known_event(value: Mapping[str, Any]) -> dict[str, Any]:
    """Entries of an event that are of their type; empty ones for all others."""
    known = ("winch", "tripped", "overruns", "warnings", "tare")
    winches, trips, overruns, warnings, tares = (value.get(key) for key in known)
    return {
        "winch": tables_in(winches) if isinstance(winches, dict) else {},
        "tripped": [str(text) for text in trips] if isinstance(trips, list) else [],
        "overruns": overruns if isinstance(overruns, int) else 0,
        "warnings": [str(text) for text in warnings] if isinstance(warnings, list) else [],
        "tare": {str(name): str(text) for name, text in tares.items()}
        if isinstance(tares, dict)
        else {},
    }


def tables_in(value: Mapping[str, Any]) -> dict[str, Any]:
    """Entries that are tables."""
    return {name: item for name, item in value.items() if isinstance(item, dict)}


@dataclass(frozen=True)
class Log:
    """Samples of every source of a layout."""

    path: str
    layout: Layout
    samples: Mapping[str, SourceSamples]
    """By topic."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    events: tuple[Note, ...] = ()
    counters: tuple[Note, ...] = ()
    end: Mapping[str, str] = field(default_factory=dict)
    """Counters at the end of the log; empty for a log that was not closed."""
    closed: bool | None = True
    """Whether the file is complete; None where its format has no mark of its end."""
    notes: tuple[str, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of any source, s; NaN without samples."""
        times = [item.times for item in self.samples.values() if len(item)]
        if not times:
            return float("nan"), float("nan")
        return min(float(t.min()) for t in times), max(float(t.max()) for t in times)


def aligned(log: Log) -> Run:
    """The run of a log: rows at the samples of its slowest instrument; raises RunError."""
    aligner = Aligner(log.layout)
    for topic, samples in log.samples.items():
        aligner.add(topic, samples.times, samples.values)
    table = aligner.rows(log.span[1], ends=True)
    recording = RawColumns(
        log.path,
        log.layout.columns(),
        list(table.T.copy()),
        metadata=log.metadata,
        notes=log.notes,
    )
    return assemble(recording)


def log_of_run(run: Run, closed: bool | None = True) -> Log:
    """A run as a log of one source, whose rows are its samples."""
    signals = tuple(
        SourceSignal(name.replace(".", "_"), item.unit, name) for name, item in run.channels.items()
    )
    gap = _BRIDGED * run.interval if len(run) > 1 else 0.0
    source = SignalSource("/run", signals, gap)
    values = [item.values for item in run.channels.values()]
    table = np.column_stack(values) if values else np.empty((len(run), 0))
    rule = RowRule("/run", float("-inf"), start=0.0)
    samples = {"/run": SourceSamples(run.time, run.time, table)}
    return Log(
        run.path, Layout((source,), rule), samples, run.metadata, closed=closed, notes=run.notes
    )


def joined(logs: Sequence[Log]) -> Log:
    """The parts of one log, joined; raises RunError for parts of different logs."""
    first = logs[0]
    for other in logs[1:]:
        if _identity(other) != _identity(first):
            message = f"is not a part of the same log as {first.path}"
            raise RunError(Fault(message, other.path))
    for before, after in pairwise(logs):
        for topic, samples in before.samples.items():
            later = after.samples[topic].times
            if len(samples) and len(later) and later[0] < samples.times[-1]:
                message = (
                    f"begins at {later[0]:.6g} s, before {before.path} ends "
                    f"({samples.times[-1]:.6g} s): the parts of one log follow each other; convert "
                    "recordings one by one"
                )
                raise RunError(Fault(message, after.path))
    samples_of = {
        source.topic: SourceSamples.joined(
            [log.samples[source.topic] for log in logs], len(source.signals)
        )
        for source in first.layout.sources
    }
    return replace(
        first,
        samples=samples_of,
        events=tuple(note for log in logs for note in log.events),
        counters=tuple(note for log in logs for note in log.counters),
        end=logs[-1].end,
        closed=None if first.closed is None else all(log.closed for log in logs),
        notes=tuple(dict.fromkeys(note for log in logs for note in log.notes)),
    )


def _identity(log: Log) -> object:
    """Values that are equal in all parts of one log."""
    signals = [(source.topic, source.signals) for source in log.layout.sources]
    return replace(log.layout.rule, start=None), log.layout.clock_offset, signals
