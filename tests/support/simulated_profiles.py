"""Profiles and torques of simulated motions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from winchkit import read_profile
from winchkit.runs import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile

AXIS = """\
schema = 1
kind = "axis"
name = "axis"

[motor]
inertia = "0.5 kg m^2"
"""
WINCH = """\
schema = 1
kind = "winch"
name = "winch"

[drum]
kind = "grooved"
winding_radius = "50 mm"
groove_pitch = "0 mm"

[gearbox]
ratio = 10

[motor]
inertia = "0.0004 kg m^2"

[reference]
cable_length = "4 m"
"""
INERTIA, MASS, ARM, ROTOR, GRAVITY = 0.5, 10.0, 5e-3, 4e-4, 9.80665


def profile_of(folder: Path, text: str, *effects: tuple[str, str]) -> WinchProfile:
    tables = "".join(f'\n[[effect]]\nid = "{name}"\n{values}\n' for name, values in effects)
    path = folder / "machine.toml"
    path.write_text(text + tables)
    return read_profile(path)


def torque_run(
    torque: NDArray[np.float64], rate: float = 100.0, angle: float = 0.0, **metadata: str
) -> Run:
    time = np.arange(len(torque)) / rate
    channels = {
        "motor_angle": Channel(np.full(len(time), angle), "rad"),
        "motor_torque": Channel(torque, "N m"),
    }
    return Run("pushed", time, channels, metadata)
