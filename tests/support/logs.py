"""Logs that tests write: one winch, its drive at 250 Hz, its load cell at 50 Hz."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSamples, SourceSignal
from winchkit.runs.recording.open_log import open_log
from winchkit.runs.recording.rotation import Rotation

OFFSET = 1_700_000_000_123_456_789
OPENED = 1000.0
DRIVE, CELL = "/A/drive", "/A/cell"
LAYOUT = Layout(
    (
        SignalSource(
            DRIVE,
            (
                SourceSignal("motor_angle", "rad", "motor_angle"),
                SourceSignal("motor_torque", "N m", "motor_torque"),
            ),
            0.1,
        ),
        SignalSource(
            CELL,
            (
                SourceSignal("tension", "N", "tension"),
                SourceSignal("raw", "1"),
                SourceSignal("quality", "1"),
            ),
            0.1,
        ),
    ),
    RowRule(CELL, OPENED),
    OFFSET,
)
METADATA = {"load_mass": "15 kg", "note": "two\nlines"}


def samples_until(end: float) -> dict[str, SourceSamples]:
    """What comes from ``OPENED`` on until a moment."""
    drive, cell = (
        np.arange(OPENED + delay, end, step) for delay, step in ((0, 4e-3), (7e-3, 0.02))
    )
    quality = np.where(np.arange(len(cell)) % 7 == 3, 2.0, 0.0)
    torque = np.where(drive < OPENED + 0.3, np.nan, np.cos(drive))
    return {
        DRIVE: SourceSamples(drive, drive, np.column_stack([np.sin(drive), torque])),
        CELL: SourceSamples(
            cell,
            cell + 5e-3,
            np.column_stack([100 + np.cos(cell), np.arange(float(len(cell))), quality]),
        ),
    }


def between(pieces: dict[str, SourceSamples], begin: float, end: float) -> dict[str, SourceSamples]:
    """What arrives in a stretch of time."""
    found = {}
    for topic, item in pieces.items():
        part = (item.received >= begin) & (item.received < end)
        found[topic] = SourceSamples(item.times[part], item.received[part], item.values[part])
    return found


def written(
    path: Path, duration: float = 2.0, rotation: Rotation | None = None, piece: float = 0.1
) -> list[Path]:
    """Record a log piece by piece, with counters and a trip; returns its files."""
    log = open_log(path, LAYOUT, METADATA, rotation)
    pieces = samples_until(OPENED + duration)
    log.add_event(OPENED, {"tripped": []})
    for begin in np.arange(OPENED, OPENED + duration, piece):
        log.count(begin, {"A.cell": {"readings": 3, "rate": float("nan")}})
        log.write(between(pieces, begin, begin + piece), begin + piece)
    log.add_event(OPENED + duration, {"tripped": ["winch A: tension above 800 N"]})
    log.close({"clock_offset": "1 s"})
    return log.parts
