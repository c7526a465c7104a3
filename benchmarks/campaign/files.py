"""Runs as files, in the format that the project promises to read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from winchkit.arrays import Array

__all__ = ["write_run"]

UNITS = {
    "time": "s",
    "motor_angle": "rad",
    "motor_velocity": "rad/s",
    "motor_torque": "N m",
    "tension": "N",
    "load": "N",
    "cable_length": "m",
    "temperature": "degC",
}


def write_run(path: Path, channels: Mapping[str, Array], metadata: Mapping[str, str]) -> None:
    """Write one CSV: metadata lines, a header, rows; columns of a winch named ``A.tension``."""
    head = [f"# {key}: {value}" for key, value in metadata.items()]
    head.append(",".join(f"{name} [{UNITS[name.rpartition('.')[2]]}]" for name in channels))
    table = np.column_stack(list(channels.values()))
    with path.open("w", encoding="utf-8") as out:
        out.write("\n".join(head) + "\n")
        np.savetxt(out, table, fmt="%.9g", delimiter=",")
