"""Runs as files, in the format that the project promises to read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from winchkit.arrays import Array

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


def write_run(
    path: Path,
    channels: Mapping[str, Array],
    metadata: Mapping[str, str],
    units: Mapping[str, tuple[str, float]] = MappingProxyType({}),
    digits: int = 9,
) -> None:
    """Write one CSV: metadata lines, a header, rows; columns of a winch named ``A.tension``.

    Columns of ``units`` have another unit, given with its size in SI.
    """
    head = [f"# {key}: {value}" for key, value in metadata.items()]
    si = {name: (UNITS[name.rpartition(".")[2]], 1.0) for name in channels} | dict(units)
    head.append(",".join(f"{name} [{si[name][0]}]" for name in channels))
    table = np.column_stack([x / si[name][1] for name, x in channels.items()])
    with path.open("w", encoding="utf-8") as out:
        out.write("\n".join(head) + "\n")
        np.savetxt(out, table, fmt=f"%.{digits}g", delimiter=",")
