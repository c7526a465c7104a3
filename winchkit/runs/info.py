"""Summary of a log: sources, rates, gaps, counters, and whether it was closed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from winchkit.arguments import require_type
from winchkit.runs.align import MAY_LACK, PATIENCE
from winchkit.runs.gaps import LOST, gap_lengths, lost_samples
from winchkit.runs.layout import SignalSource, SourceSamples
from winchkit.runs.log import Log, Note
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import counted

_QUALITY = "quality"


@dataclass(frozen=True)
class SourceInfo:
    """One source of a log."""

    topic: str
    channels: tuple[str, ...]
    samples: int
    rate: float
    """Outside its gaps, Hz; NaN with fewer than two samples."""
    gaps: int
    """Number of gaps, those to the log's ends included (see :mod:`winchkit.runs.gaps`)."""
    longest_gap: float
    """Longest interval, s."""
    missing: Mapping[str, int]
    """Samples without a value, by channel."""
    flagged: int
    """Samples that the instrument marked as invalid or old."""


@dataclass(frozen=True)
class LogInfo:
    """A whole log."""

    path: str
    closed: bool | None
    """Whether it has its end; None for CSV, which has none."""
    begun: str | None
    """UTC of the first sample, where the log has the clock's offset."""
    duration: float
    """From the first sample of any source to the last, s."""
    sources: tuple[SourceInfo, ...]
    counters: Mapping[str, Any]
    """Last values of the counters, by instrument."""
    events: tuple[str, ...]
    """Latched trips, in order."""
    tares: tuple[str, ...]
    """Tares (``A.cell: …``) and the times of their changes, in order."""
    commanders: tuple[str, ...]
    """Commanding client of each winch (``A: …``) and the times of its changes, in order."""
    metadata: Mapping[str, str]
    notes: tuple[str, ...]


def info_of(log: Log) -> LogInfo:
    """Sum up a log.

    Parameters
    ----------
    log : Log
        The log.

    Returns
    -------
    LogInfo
        Summary by source.
    """
    require_type(log, Log, "log")
    first, last = log.span
    offset = log.layout.clock_offset
    begun = None
    if offset and np.isfinite(first):
        begun = datetime.fromtimestamp(first + offset / 1e9, UTC).isoformat(timespec="milliseconds")
    trips = (text for note in log.events for text in note.value.get("tripped", ()))
    return LogInfo(
        log.path,
        log.closed,
        begun,
        last - first,
        tuple(_source_info(item, log.samples[item.topic], log.span) for item in log.layout.sources),
        log.counters[-1].value if log.counters else {},
        tuple(dict.fromkeys(map(str, trips))),
        tuple(_changes(log.events, first, _tares)),
        tuple(_changes(log.events, first, _commanders)),
        log.metadata,
        log.notes,
    )


def _tares(event: Mapping[str, Any]) -> Mapping[str, str]:
    tares: Mapping[str, str] = event.get("tare", {})
    return tares


def _commanders(event: Mapping[str, Any]) -> Mapping[str, str]:
    winches = event.get("winch", {}).items()
    return {name: str(item.get("commander") or "none") for name, item in winches}


def _changes(
    events: Sequence[Note], first: float, of: Callable[[Mapping[str, Any]], Mapping[str, str]]
) -> Iterator[str]:
    """Named values in events: the first, and every change (s from ``first``)."""
    known: dict[str, str] = {}
    for note in events:
        for name, text in of(note.value).items():
            if known.get(name) != text:
                since = f" from {note.time - first:.3f} s on" if name in known else ""
                known[name] = text
                yield f"{name}{since}: {text}"


def _source_info(
    source: SignalSource, samples: SourceSamples, span: tuple[float, float]
) -> SourceInfo:
    times = np.unique(samples.times)
    steps = np.diff(times)
    even = steps[~lost_samples(times)]
    columns = {item.column: samples.values[:, n] for n, item in enumerate(source.signals)}
    gaps = gap_lengths(samples.times, columns, span, source.max_gap)
    names = [signal.column or signal.name for signal in source.signals]
    lacks = np.isnan(samples.values).sum(axis=0).tolist()
    flags = [n for n, signal in enumerate(source.signals) if signal.name == _QUALITY]
    return SourceInfo(
        source.topic,
        tuple(names),
        len(samples),
        1 / float(even.mean()) if len(even) else float("nan"),
        len(gaps),
        # The longest interval is given where there is no gap too.
        float(max([*steps, *gaps], default=np.nan)),
        {name: count for name, count in zip(names, lacks, strict=True) if count},
        int(np.count_nonzero(samples.values[:, flags])),
    )


@dataclass(frozen=True)
class RunSummary:
    """Size of a run, and its missing values."""

    rows: int
    duration: float
    """From the first sample to the last, s."""
    rate: float
    """Samples a second from the median interval, Hz; NaN where rows are not samples in time."""
    gaps: int
    """Number of gaps (see :mod:`winchkit.runs.gaps`)."""
    missing: Mapping[str, int]
    """Samples without a value, by channel."""
    constant: tuple[str, ...]
    """Channels with a constant value."""
    ended: Mapping[str, float] = field(default_factory=dict)
    """Time from the last value to the end of the run, s, by channel that has none there."""

    @property
    def text(self) -> str:
        """One line."""
        times = [] if np.isnan(self.rate) else [f"{self.duration:.6g} s at {self.rate:.4g} Hz"]
        holes = [f"{name} {count}" for name, count in self.missing.items() if count]
        parts = [
            counted(self.rows, "row"),
            *times,
            counted(self.gaps, "gap"),
            f"NaN: {', '.join(holes)}" if holes else "no NaN",
        ]
        parts += [f"{name} has no value in the last {t:.3g} s" for name, t in self.ended.items()]
        if self.constant:
            parts.append(f"constant: {', '.join(self.constant)}")
        return ", ".join(parts)


def summary_of(run: Run) -> RunSummary:
    """Size, rate, gaps and missing values of a run."""
    in_time = run.metadata.get("time") != "row number" and len(run) > 1
    constant = tuple(name for name in run if _is_constant(run, name))
    return RunSummary(
        rows=len(run),
        duration=float(run.time[-1] - run.time[0]),
        rate=1 / run.interval if in_time else float("nan"),
        gaps=run.gaps if in_time else 0,
        missing={name: channel.missing for name, channel in run.channels.items()},
        constant=constant,
        ended=dict(_ended(run)) if in_time else {},
    )


def _ended(run: Run) -> Iterator[tuple[str, float]]:
    """Channels whose values cease before the run does, and how long before, s."""
    for name, channel in run.channels.items():
        known = np.flatnonzero(~np.isnan(channel.values))
        if len(known) and not name.endswith(MAY_LACK):
            left = float(run.time[-1] - run.time[known[-1]])
            if left > max(PATIENCE, LOST * run.interval):
                yield name, left


def _is_constant(run: Run, name: str) -> bool:
    values = run[name][~np.isnan(run[name])]
    return len(values) > 1 and bool(np.all(values == values[0]))
