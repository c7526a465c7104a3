"""What a stretch of readings says, against readings made with a known noise, drift, hum, creep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from winchkit.calibration.cell.health import CellSamples, Health, examine
from winchkit.errors import RunError

RATE, DIVISION = 120.0, 0.01


def made(
    *,
    seconds: float = 10.0,
    noise: float = 0.5,
    drift: float = 0.0,
    hum: float = 0.0,
    step: float = 0.0,
    creep: float = 0.0,
    broken: int = 0,
) -> CellSamples:
    """Readings of 100 N; ``creep`` N a unit of the logarithm of the time after a step at 3 s."""
    random = np.random.default_rng(7)
    time = np.arange(round(seconds * RATE)) / RATE
    value = 100.0 + random.normal(0, noise, len(time)) + drift * time
    value += hum * np.sin(2 * np.pi * 50.0 * time + 0.4)
    since = time - 3.0
    late = since > 0
    value[late] += step + creep * np.log(since[late])
    raw = np.round(value / DIVISION)
    usable = np.ones(len(time), bool)
    usable[:broken] = False
    value = np.where(usable, raw * DIVISION, np.nan)
    return CellSamples(time, raw, value, usable, ~usable)


def remarks(health: Health) -> str:
    return " / ".join(health.remarks)


def test_a_good_cell_is_reported_in_numbers_and_without_remarks() -> None:
    health = examine(made())
    assert health.rate == pytest.approx(RATE)
    assert health.noise == pytest.approx(0.5, rel=0.08)
    assert health.noise_counts == pytest.approx(50.0, rel=0.08)
    assert health.mean == pytest.approx(100.0, abs=0.1)
    assert abs(health.drift) < 4 * health.drift_std
    assert health.creep is None
    assert health.remarks == ()


def test_counts_that_stand_still_at_an_end_of_their_range_may_saturate() -> None:
    samples = made(hum=0.0)
    samples.value[300:700] = 103.0
    samples.raw[300:700] = 103.0 / DIVISION
    assert "at the end of their range" in remarks(examine(samples))


def test_a_drift_is_found_with_its_uncertainty() -> None:
    health = examine(made(drift=0.2))
    assert health.drift == pytest.approx(0.2, abs=4 * health.drift_std)
    assert "drifted" in remarks(health)


def test_slow_noise_is_no_drift() -> None:
    """Noise with a correlation time of 1 s: its slope is uncertain, not large."""
    random, found = np.random.default_rng(11), 0
    for _ in range(30):
        time = np.arange(round(10 * RATE)) / RATE
        value = np.zeros(len(time))
        for k in range(1, len(time)):
            value[k] = value[k - 1] * math.exp(-1 / RATE) + random.normal(0, 0.05)
        raw = np.round((100 + value) / DIVISION)
        usable = np.ones(len(time), bool)
        health = examine(CellSamples(time, raw, raw * DIVISION, usable, ~usable))
        found += abs(health.drift) > 4 * health.drift_std
    assert found <= 3


def test_hum_of_the_mains_is_found_and_only_where_it_is() -> None:
    health = examine(made(hum=0.4))
    fifty, sixty = health.hum
    assert fifty.amplitude == pytest.approx(0.4, abs=4 * fifty.std)
    assert fifty.there
    assert not math.isfinite(sixty.amplitude)
    assert "50 Hz" in remarks(health)


def test_a_tone_at_half_the_rate_is_not_made_up() -> None:
    assert math.isnan(examine(made()).hum[1].amplitude)


def test_creep_after_a_load_is_reported_for_thirty_minutes() -> None:
    """Of 200 N 0.4 N a unit of ln t: from 1 to 30 minutes 0.4 ln 30."""
    health = examine(made(seconds=40.0, noise=0.05, step=200.0, creep=0.4))
    assert health.creep.step == pytest.approx(200.0, rel=0.01)
    assert health.creep.change == pytest.approx(0.4 * math.log(30), abs=4 * health.creep.std)
    assert "creeps" in remarks(health)


def test_a_change_of_load_without_creep_is_not_called_creep() -> None:
    health = examine(made(seconds=20.0, step=200.0))
    assert abs(health.creep.change) < 4 * health.creep.std
    assert "creeps" not in remarks(health)


def test_counts_that_never_change_are_reported() -> None:
    samples = made(noise=0.0)
    health = examine(samples)
    assert health.unique == 1
    assert health.longest_still == pytest.approx(10.0, abs=0.02)
    assert "frozen" in remarks(health)


def test_readings_that_repeat_are_reported() -> None:
    samples = made()
    raw = np.repeat(samples.raw[::4], 4)[: len(samples.raw)]
    health = examine(
        CellSamples(samples.time, raw, raw * DIVISION, samples.usable, samples.saturated)
    )
    assert health.duplicates == pytest.approx(0.75, abs=0.02)
    assert "faster than it converts" in remarks(health)


def test_saturated_readings_are_counted_and_left_out() -> None:
    health = examine(made(broken=300))
    assert (health.readings, health.usable, health.saturated) == (1200, 900, 300)
    assert "saturated" in remarks(health)


def test_too_few_readings_say_nothing() -> None:
    with pytest.raises(RunError, match="10 usable readings"):
        examine(made(broken=1190))
