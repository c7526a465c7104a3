"""What a log of a bench holds: sources, their signals, and where a row of the run stands."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError

__all__ = ["Layout", "RowRule", "Samples", "Signal", "Source", "read_layout", "write_layout"]

_LARGEST = 1 << 62


@dataclass(frozen=True)
class Signal:
    """One number that a source gives."""

    name: str
    unit: str
    column: str = ""
    """Of the run; empty for what a run does not hold, such as raw counts."""


@dataclass(frozen=True)
class Source:
    """A drive or an instrument: signals that are sampled together."""

    topic: str
    """``/A/drive``, ``/A/cell``."""
    signals: tuple[Signal, ...]
    max_gap: float
    """Samples further apart are not interpolated between, s."""


@dataclass(frozen=True)
class RowRule:
    """Where the rows of the run stand: at the samples of one source."""

    topic: str
    opened: float
    """On the bench's clock, s; samples from before do not count."""
    period: float = 0.0
    """Least time between two rows, s."""
    start: float | None = None
    """Moment of the first row, where an earlier part of the log has it, s."""


@dataclass(frozen=True)
class Layout:
    """Sources in the order of their columns, and the rule for rows."""

    sources: tuple[Source, ...]
    rule: RowRule
    clock_offset: int = 0
    """UTC less the bench's clock, ns."""

    def columns(self) -> list[tuple[str, str]]:
        """Names and units of a row, time first."""
        signals = (signal for source in self.sources for signal in source.signals)
        return [("time", "s"), *((item.column, item.unit) for item in signals if item.column)]


@dataclass(frozen=True)
class Samples:
    """What came from one source, in order of arrival."""

    times: Array
    """Moments of sampling on the bench's clock, s, shape (n,)."""
    received: Array
    """Moments of arrival, s, shape (n,)."""
    values: Array
    """Shape (n, signals); NaN where there is no value."""

    def __len__(self) -> int:
        return len(self.times)

    @staticmethod
    def joined(pieces: Sequence[Samples], signals: int) -> Samples:
        """Pieces one after another."""
        if not pieces:
            return Samples(np.empty(0), np.empty(0), np.empty((0, signals)))
        return Samples(
            np.concatenate([item.times for item in pieces]),
            np.concatenate([item.received for item in pieces]),
            np.concatenate([item.values for item in pieces]),
        )


def write_layout(layout: Layout) -> str:
    """As JSON."""
    return json.dumps(asdict(layout), separators=(",", ":"))


def read_layout(text: str, path: str) -> Layout:
    """From JSON; raises RunError."""
    try:
        layout = _layout(json.loads(text))
    except (ValueError, TypeError, KeyError, ArithmeticError, RecursionError) as error:
        raise RunError(Fault(f"its layout cannot be read: {error!r}", path)) from None
    topics = [source.topic for source in layout.sources]
    if len(set(topics)) < len(topics):
        raise RunError(Fault("its layout names a source twice", path))
    if layout.rule.topic not in topics:
        raise RunError(Fault(f"its rows stand at the unknown source '{layout.rule.topic}'", path))
    if not -_LARGEST < layout.clock_offset < _LARGEST:
        raise RunError(Fault(f"its clock offset {layout.clock_offset} ns cannot be", path))
    return layout


def _layout(found: dict[str, Any]) -> Layout:
    sources = tuple(
        Source(
            str(item["topic"]),
            tuple(
                Signal(str(signal["name"]), str(signal["unit"]), str(signal["column"]))
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
        ),
        int(found["clock_offset"]),
    )
