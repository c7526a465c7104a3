"""Runs at rest: a load cell under known loads, without motion of the motor.

Without motion only the characteristic of the cell can be compared: its zero, span, curvature,
hysteresis, creep, drift and dependence on the temperature. Cable length and torque of such a run
have no information on the winch and are not compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_COMPARED = ("tension", "load", "temperature")
_BEYOND_NOISE = 5.0
"""Standard deviation of a channel, in its local noise, that is a motion."""
_LARGEST_TURN = 1e-3
"""Turn of the drum up to which it is at rest, rad: jitter of an encoder, 0.06 mm at 60 mm."""


def is_at_rest(run: Run, profile: WinchProfile) -> bool:
    """Whether a run has a tension under a known load, and no motion of the drum."""
    if isinstance(profile, AxisProfile) or "tension" not in run:
        return False
    if "load" not in run and run.load_mass is None:
        return False
    if any(_moves(run[name]) for name in ("cable_length", "motor_velocity") if name in run):
        return False  # The angle was not recorded, or its encoder is dead.
    if "motor_angle" not in run:
        return True
    known = run["motor_angle"][np.isfinite(run["motor_angle"])]
    return len(known) > 0 and bool(np.ptp(known) < _LARGEST_TURN * profile.gearbox.ratio)


def _moves(values: Array) -> bool:
    """Whether a channel changes by more than its noise."""
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.std(known) > _BEYOND_NOISE * local_noise(known))


def prepared_statics(runs: Sequence[Run], profile: WinchProfile) -> tuple[list[Run], list[str]]:
    """Runs, those at rest with the channels of the cell alone, and notes on them."""
    out, notes = [], []
    for run in runs:
        if not is_at_rest(run, profile):
            out.append(run)
            continue
        channels = {name: run.channels[name] for name in _COMPARED if name in run}
        angle = profile.reference.motor_angle
        if "motor_angle" in run:
            angle = float(np.nanmedian(run["motor_angle"]))
        channels["motor_angle"] = Channel(np.full(len(run), angle), "rad")
        out.append(replace(run, channels=channels))
        notes.append(f"{run.name}: at rest; the tension alone is compared, with the load")
    return out, notes
