"""Layout of a log of a bench: sources, their signals, and the times of rows."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError

_LARGEST = 1 << 62
"""ns: offsets beyond are damaged, and would overflow 64 bits in a sum."""


@dataclass(frozen=True)
class SourceSignal:
    """One number of a source."""

    name: str
    unit: str
    column: str = ""
    """Column of the run; empty for a signal that a run does not contain, such as raw counts."""


@dataclass(frozen=True)
class SignalSource:
    """A drive or an instrument: signals that are sampled together."""

    topic: str
    """``/A/drive``, ``/A/cell``."""
    signals: tuple[SourceSignal, ...]
    max_gap: float
    """Longest interval over which samples are interpolated, s."""


@dataclass(frozen=True)
class RowRule:
    """Times of the rows of a run: those of the samples of one source."""

    topic: str
    opened: float
    """Start on the bench's clock, s; earlier samples are ignored."""
    period: float = 0.0
    """Least time between two rows, s."""
    start: float | None = None
    """Time of the first row, where it is in an earlier part of the log, s."""
    spacing: float = 0.01
    """Least time between two rows while that source is silent, s."""


@dataclass(frozen=True)
class Layout:
    """Sources in the order of their columns, and the rule for rows."""

    sources: tuple[SignalSource, ...]
    rule: RowRule
    clock_offset: int = 0
    """UTC less the bench's clock, ns."""

    def columns(self) -> list[tuple[str, str]]:
        """Names and units of a row, time first."""
        signals = (signal for source in self.sources for signal in source.signals)
        return [("time", "s"), *((item.column, item.unit) for item in signals if item.column)]


@dataclass(frozen=True)
class SourceSamples:
    """Samples of one source, in order of arrival."""

    times: Array
    """Times of sampling on the bench's clock, s, shape (n,)."""
    received: Array
    """Times of arrival, s, shape (n,)."""
    values: Array
    """Shape (n, signals); NaN where there is no value."""

    def __len__(self) -> int:
        return len(self.times)

    @staticmethod
    def joined(pieces: Sequence[SourceSamples], signals: int) -> SourceSamples:
        """Concatenated pieces."""
        if not pieces:
            return SourceSamples(np.empty(0), np.empty(0), np.empty((0, signals)))
        return SourceSamples(
            np.concatenate([item.times for item in pieces]),
            np.concatenate([item.received for item in pieces]),
            np.concatenate([item.values for item in pieces]),
        )


def write_layout(layout: Layout) -> str:
    """A layout as JSON."""
    return json.dumps(asdict(layout), separators=(",", ":"))


def read_layout(text: str, path: str) -> Layout:
    """A layout from JSON; raises RunError."""
    try:
        layout = _layout(json.loads(text))
    except (ValueError, TypeError, KeyError, ArithmeticError, RecursionError) as error:
        raise RunError(Fault(f"its layout cannot be read: {error!r}", path)) from None
    topics = [source.topic for source in layout.sources]
    if len(set(topics)) < len(topics):
        raise RunError(Fault("its layout names a source twice", path))
    if layout.rule.topic not in topics:
        raise RunError(
            Fault(f"its rows are those of the unknown source '{layout.rule.topic}'", path)
        )
    if not -_LARGEST < layout.clock_offset < _LARGEST:
        raise RunError(Fault(f"its clock offset {layout.clock_offset} ns is impossible", path))
    return layout


def _layout(found: dict[str, Any]) -> Layout:
    sources = tuple(
        SignalSource(
            str(item["topic"]),
            tuple(
                SourceSignal(str(signal["name"]), str(signal["unit"]), str(signal["column"]))
                for signal in item["signals"]
            ),
            float(item["max_gap"]),
        )
        for item in found["sources"]
    )
    rule = found["rule"]
    start = rule["start"]
    return Layout(
        sources,
        RowRule(
            str(rule["topic"]),
            float(rule["opened"]),
            float(rule["period"]),
            None if start is None else float(start),
            float(rule.get("spacing", RowRule.spacing)),
        ),
        int(found["clock_offset"]),
    )
