"""Noise has the size and the memory that it declares, and comes back with its seed."""

from random import Random

import numpy as np
import pytest

from plant_benches import GROOVED, hide
from winchkit.schema.simbench import NoiseSpec, WinchTruth
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.sensors import GaussianNoise, Measurement
from winchkit.sim.plant.servo import DriveCommand

COUNT = 40_000


def samples(colour: float, interval: float = 0.02) -> np.ndarray:
    noise = GaussianNoise(2.0, colour, 0.5, Random(7))
    return np.array([noise.sample(interval) for _ in range(COUNT)])


@pytest.mark.parametrize("colour", [0.0, 0.3, 1.0])
def test_size_and_memory(colour: float) -> None:
    x = samples(colour)
    effective = COUNT / (1 + 2 * 25 * colour)
    assert np.std(x) == pytest.approx(2.0, rel=4 / np.sqrt(effective))
    assert abs(np.mean(x)) < 4 * 2.0 / np.sqrt(effective)
    for lag in (1, 25, 60):
        expected = colour * np.exp(-lag * 0.02 / 0.5)
        found = np.corrcoef(x[:-lag], x[lag:])[0, 1]
        assert found == pytest.approx(expected, abs=5 / np.sqrt(effective))


def test_memory_counts_time_and_not_samples() -> None:
    fast, slow = samples(1.0, 0.005), samples(1.0, 0.5)
    assert np.corrcoef(fast[:-1], fast[1:])[0, 1] > 0.97
    assert np.corrcoef(slow[:-1], slow[1:])[0, 1] == pytest.approx(np.exp(-1), abs=0.02)


def readings(seed: int) -> list[Measurement]:
    noise = NoiseSpec(3e-4, 0.8, 5e-3, 0.8, 0.05, 0.3, 0.5)
    truth = WinchTruth(hidden=(hide("elastic rope"),))
    winch = WinchPlant(GROOVED, truth, seed=seed, noise=noise)
    out = []
    for _ in range(500):
        winch.advance(0.004, DriveCommand(speed=20.0))
        out.append(winch.measure())
    return out


def test_a_seed_brings_everything_back() -> None:
    assert readings(3) == readings(3)


def test_seeds_and_instruments_differ() -> None:
    one, other = readings(3), readings(4)
    assert [m.motor_angle for m in one] == [m.motor_angle for m in other]
    errors = {
        (name, seed): np.array([getattr(m, name) for m in rows])
        for seed, rows in ((3, one), (4, other))
        for name in ("tension", "load", "cable_length", "motor_torque", "temperature")
    }
    differences = errors["tension", 3] - errors["tension", 4]
    assert np.std(differences) == pytest.approx(0.8 * np.sqrt(2), rel=0.35)
    load = errors["load", 3] - errors["load", 4]
    assert abs(np.corrcoef(differences, load)[0, 1]) < 0.35


def test_without_noise_the_instruments_measure_the_truth() -> None:
    winch = WinchPlant(GROOVED, WinchTruth(), seed=1)
    winch.advance(0.5, DriveCommand(speed=30.0))
    read = winch.measure()
    for name in ("motor_angle", "motor_velocity", "motor_torque", "tension", "load"):
        assert getattr(read, name) == getattr(winch, name)
    assert read.cable_length == winch.cable_length
    assert read.temperature == winch.temperature == 20.0
