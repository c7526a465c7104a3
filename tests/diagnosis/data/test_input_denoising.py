"""Noise taken out of measured inputs, and what is real kept."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis_runs import GROOVED, Array, Ride, made, with_channel
from winchkit.diagnosis.add import add
from winchkit.diagnosis.data.input_denoising import (
    contrasts,
    shared_by_instruments,
    shared_by_repeats,
    wiener_filtered,
)
from winchkit.diagnosis.data.preparation import prepare

COUNT = 2000


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("runs", [2, 3, 5])
def test_contrasts_are_a_rotation_of_the_runs(runs: int) -> None:
    mean, differences = contrasts(np.eye(runs))
    turned = np.vstack([mean, differences])
    assert np.allclose(turned @ turned.T, np.eye(runs))
    assert np.allclose(mean, 1 / np.sqrt(runs))
    assert np.allclose(differences.sum(axis=1), 0.0)


def test_quiet_takes_white_noise_and_leaves_what_is_slow() -> None:
    random = np.random.default_rng(1)
    slow = 20 + 3 * np.cos(2 * np.pi * np.arange(COUNT) / 700)
    noisy = slow + 0.5 * random.standard_normal(COUNT)
    assert rms(wiener_filtered(noisy) - slow) < 0.2 * 0.5
    assert np.ptp(wiener_filtered(20 + 0.5 * random.standard_normal(COUNT))) < 0.2
    assert np.allclose(wiener_filtered(slow), slow, atol=1e-3)


def test_what_repeats_agree_on_stays_and_what_they_do_not_goes() -> None:
    random = np.random.default_rng(2)
    shared = np.sin(2 * np.pi * np.arange(COUNT) / 23)
    rows = [np.arange(COUNT)] * 2
    for size in (0.2, 1.0):
        signals = [shared + size * random.standard_normal(COUNT) for _ in range(2)]
        for left in shared_by_repeats(signals, rows):
            assert rms(left - shared) < 0.75 * size
            assert left @ shared / (shared @ shared) > 0.8
    noise = [random.standard_normal(COUNT) for _ in range(2)]
    for left in shared_by_repeats(noise, rows):
        assert rms(left) < 0.35


def coloured(random: np.random.Generator, size: float) -> Array:
    """Noise with a correlation time of 20 samples."""
    return size * np.asarray(lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], random.normal(size=COUNT)))


def test_coloured_noise_of_one_instrument_goes_and_what_both_show_stays() -> None:
    """A white floor leaves coloured noise; its cross power with another instrument is chance."""
    swing = 3 * np.sin(2 * np.pi * np.arange(COUNT) / 300)
    alone, floor, both = [], [], []
    for seed in range(8):
        random = np.random.default_rng(seed)
        noise, other = coloured(random, 1.0), coloured(random, 2.0)
        alone.append(shared_by_instruments(noise, other))
        floor.append(wiener_filtered(noise))
        both.append(shared_by_instruments(swing + noise, 1.05 * swing + other))
    assert rms(np.array(alone)) < rms(np.array(floor)) / 2
    assert rms(np.array(both) - swing) < rms(np.array(floor))
    assert all(x @ swing / (swing @ swing) > 0.8 for x in both)


def test_what_has_no_partner_is_not_accepted() -> None:
    wave = np.sin(2 * np.pi * np.arange(COUNT) / 200)
    rows = [np.arange(100, COUNT), np.arange(COUNT - 100)]
    first, second = shared_by_repeats([wave, wave[100:]], rows)
    assert not first[:100].any()
    assert np.allclose(first[100:], wave[100:], atol=1e-6)
    assert not second[COUNT - 100 :].any()


def test_a_noisy_load_is_quietened_and_its_real_acceleration_kept() -> None:
    """A load cell under a weight that is really accelerated, by more than its noise."""
    ride, mass, noise = Ride(samples=1000), 20.0, 3.0
    swing = 2 * np.pi / 3
    angle = 150.0 * (1 - np.cos(swing * ride.time))
    arm = np.hypot(0.06, 0.005 / (2 * np.pi)) / 20.4
    true = mass * (9.80665 + arm * 150.0 * swing**2 * np.cos(swing * ride.time))
    assert np.std(true) > noise
    random = np.random.default_rng(3)
    runs = []
    for seed in range(2):
        run = with_channel(made(seed, noise={"motor_torque": 0.1}, ride=ride), "motor_angle", angle)
        runs.append(with_channel(run, "load", true + noise * random.standard_normal(1000)))
    for recording in prepare(runs, GROOVED).recordings:
        assert recording.raw.load is not None
        assert recording.smooth.load is not None
        inner = slice(25, -25)  # accelerations at the ends of a run are not known
        assert rms((recording.raw.load - true)[inner]) == pytest.approx(noise, rel=0.1)
        assert rms((recording.smooth.load - true)[inner]) < noise / 3


def test_crosstalk_is_that_of_the_torque_and_not_of_the_noise_of_its_measurement() -> None:
    """Least squares on a torque whose noise is as large as its changes halves the share."""
    share, noise = 40.0, 0.3
    random, runs, torques = np.random.default_rng(8), [], []
    for seed in range(4):
        ride = Ride(samples=4000)
        quiet = made(seed, noise={"tension": 0.5, "motor_torque": 0.0}, ride=ride)
        torque = quiet["motor_torque"] + 0.3 * np.sin(quiet["motor_angle"] / 60)
        coupled = with_channel(quiet, "tension", quiet["tension"] + share * torque, "N")
        read = torque + noise * random.standard_normal(len(torque))
        runs.append(with_channel(coupled, "motor_torque", read, "N m"))
        torques.append(torque)
    for recording, torque in zip(prepare(runs, GROOVED).recordings, torques, strict=True):
        assert rms(recording.smooth.at.motor_torque - torque) < noise / 3
    error = np.concatenate(
        [
            r["tension"] - made(n, noise={"tension": 0.0}, ride=ride)["tension"]
            for n, r in enumerate(runs)
        ]
    )
    measured = np.concatenate([run["motor_torque"] for run in runs])
    attenuated = np.polyfit(measured, error, 1)[0]
    (found,) = add("cell-crosstalk", runs, GROOVED).added[1].values()
    assert attenuated < 0.6 * share
    assert found.value == pytest.approx(share, rel=0.02)
