"""The control cycles around a trip as a run file, which other commands read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.run import Channel, Run
from winchkit.runs.writer import write_run

_CHANNELS = {
    "motor_angle": ("motor_angle", "rad"),
    "motor_velocity": ("motor_velocity", "rad/s"),
    "motor_torque": ("motor_torque", "N m"),
    "tension": ("tension", "N"),
    "load": ("load", "N"),
    "length": ("cable_length", "m"),
    "cable_speed": ("drive_cable_speed", "m/s"),
    "commanded_speed": ("commanded_cable_speed", "m/s"),
}
"""Name in a run, and unit, by channel of the trip's history. A run's ``cable_length`` is that of
the length instrument, and the speeds here are those of the drive."""


def trip_run(found: Mapping[str, Any], bench: str) -> Run:
    """The cycles of a station's ``trip_history`` as a run; the trip is at time 0."""
    channels = {
        f"{winch}.{name}": Channel(values, unit)
        for winch, own in found["winch"].items()
        for key, (name, unit) in _CHANNELS.items()
        if np.isfinite(values := _numbers(own[key])).any()
    }
    metadata = {
        "bench": bench,
        "tripped": "; ".join(one["message"] for one in found["tripped"]),
        "programme": "trip",
    }
    return Run("trip", np.array(found["time"], dtype=float), channels, metadata)


def trip_file(found: Mapping[str, Any], bench: str, folder: Path) -> tuple[str, str]:
    """File name with the present time (UTC), and text of the run as CSV."""
    name = f"trip-{datetime.now(UTC):%Y%m%d-%H%M%S}.csv"
    path = folder / name
    write_run(trip_run(found, bench), path, replace=True)
    text = path.read_text(encoding="utf-8")
    path.unlink()
    return name, text


def _numbers(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=float)
