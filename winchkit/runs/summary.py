"""What a run holds, in numbers and in one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from winchkit.runs.run import Run

__all__ = ["RunSummary", "summary_of"]


@dataclass(frozen=True)
class RunSummary:
    """Size and holes of a run."""

    rows: int
    duration: float
    """From the first sample to the last, s."""
    rate: float
    """Samples a second from the median interval, Hz; NaN where rows are not samples in time."""
    gaps: int
    """How often the time jumps by more than 1.5 intervals."""
    missing: Mapping[str, int]
    """Samples without a value, by channel."""
    constant: tuple[str, ...]
    """Channels that have values, but only one."""

    @property
    def text(self) -> str:
        """One line."""
        times = [] if np.isnan(self.rate) else [f"{self.duration:.6g} s at {self.rate:.4g} Hz"]
        holes = [f"{name} {count}" for name, count in self.missing.items() if count]
        parts = [
            _counted(self.rows, "row"),
            *times,
            _counted(self.gaps, "gap"),
            f"NaN: {', '.join(holes)}" if holes else "no NaN",
        ]
        if self.constant:
            parts.append(f"constant: {', '.join(self.constant)}")
        return ", ".join(parts)


def summary_of(run: Run) -> RunSummary:
    """Count what a run holds and what it lacks."""
    in_time = run.metadata.get("time") != "row number" and len(run) > 1
    constant = tuple(name for name in run if _is_constant(run, name))
    return RunSummary(
        rows=len(run),
        duration=float(run.time[-1] - run.time[0]),
        rate=1 / run.interval if in_time else float("nan"),
        gaps=run.gaps if in_time else 0,
        missing={name: channel.missing for name, channel in run.channels.items()},
        constant=constant,
    )


def _is_constant(run: Run, name: str) -> bool:
    values = run[name][~np.isnan(run[name])]
    return len(values) > 1 and bool(np.all(values == values[0]))


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count or 'no'} {noun}s"
