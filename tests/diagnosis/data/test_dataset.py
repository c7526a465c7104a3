"""Which samples of a run are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import GROOVED, SPIRAL, Ride, made, with_channel
from winchkit.diagnosis.data.preparation import prepare
from winchkit.schema.profiles.winch import WinchProfile

THICK = replace(SPIRAL, drum=replace(SPIRAL.drum, layer_growth=1e-3))
"""Layers of a millimetre: the step causes a transient of the load."""
THIN = replace(SPIRAL, drum=replace(SPIRAL.drum, layer_growth=1e-6))
RIDE = Ride(samples=800, stroke=800.0, period=8.0)


def compared(profile: WinchProfile, output: str, *, known_weight: bool = False) -> np.ndarray:
    run = made(1, profile, ride=RIDE)
    if known_weight:
        run = with_channel(run, "load", np.full(len(run), 98.0))
    return np.asarray(prepare([run], profile).recordings[0].valid[output])


def layers_begun(profile: WinchProfile) -> np.ndarray:
    """Samples after which the cable lies on another layer; it begins at rest on such a step."""
    wound = 2 * np.pi * profile.reference.wound_turns + RIDE.angle / profile.gearbox.ratio
    return np.flatnonzero(np.diff(np.floor(wound / (2 * np.pi))))


@pytest.mark.parametrize("output", ["tension", "motor_torque"])
def test_a_known_weight_is_not_compared_where_a_layer_begins(output: str) -> None:
    """The size of the transient depends on compliances that the profile does not have."""
    jumps = layers_begun(THICK)
    assert len(jumps) > 5
    used = compared(THICK, output)
    fast = jumps[np.abs(np.gradient(RIDE.angle, RIDE.time)[jumps]) > 50]
    assert len(fast) > 5
    assert not used[fast].any()
    assert not used[fast + 1].any()
    assert used[(jumps[:5] + jumps[1:6]) // 2].all()
    assert used[12:30].all(), "at rest nothing jerks"


def test_a_measured_load_and_a_drum_without_steps_are_compared_there() -> None:
    jumps = layers_begun(THICK)
    inner = jumps[(jumps > 10) & (jumps < RIDE.samples - 10)]
    assert compared(THICK, "tension", known_weight=True)[inner].all()
    assert compared(GROOVED, "tension")[inner].all()
    assert compared(THIN, "tension")[inner].all(), "a step lost in the noise"
    assert compared(THICK, "cable_length").all()
