"""Drums of bars: a wave of any whole number per drum turn is found from its own start."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, Ride, made, with_channel
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.search import selection_engine

RIDE = Ride(samples=800, rate=40.0, period=20.0, stroke=300.0)
RATIO = GROOVED.gearbox.ratio
MASS, GRAVITY = 10.0, 9.80665
SIZE = 0.4e-3
"""m; the noise of the length is 0.3 mm."""


@pytest.mark.parametrize("bars", [6, 7, 9, 11, 12])
def test_a_drum_of_bars_has_their_number(bars: int) -> None:
    """Closed form without the load's acceleration: W + a sin(n φ), torque m g dW/dφ over i."""
    runs = []
    for seed in (1, 2):
        run = made(seed, GROOVED, load_mass=MASS, ride=RIDE)
        wave = bars * RIDE.angle / RATIO
        slope = MASS * GRAVITY * bars * SIZE * np.cos(wave) / RATIO
        run = with_channel(run, "cable_length", run["cable_length"] - SIZE * np.sin(wave), "m")
        runs.append(with_channel(run, "motor_torque", run["motor_torque"] + slope, "N m"))
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    best = engine.scores(*engine.fit_with_noise(engine.initial_model))[0].candidate
    assert (best.effect.id, best.shape["lobes"]) == ("drum-roundness", bars)
