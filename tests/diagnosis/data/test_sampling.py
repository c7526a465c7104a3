"""Uneven and gappy sampling: which samples are used, and at which instants they were taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis_runs import GROOVED, Ride, made, term
from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.sampling import away_from, even_instants
from winchkit.diagnosis.search import selection_engine
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

FAST = Ride(samples=8000, rate=200.0, period=8.0, stroke=200.0)


def picked(run: Run, indices: Array) -> Run:
    channels = {n: replace(c, values=c.values[indices]) for n, c in run.channels.items()}
    return replace(run, time=run.time[indices], channels=channels)


def uneven(run: Run, seed: int) -> Run:
    """Every tenth sample of 200 Hz, five more or less, with half a second lost every four."""
    random = np.random.default_rng(seed)
    indices = np.cumsum(random.integers(5, 16, len(run) // 5))
    indices = indices[indices < len(run)]
    return picked(run, indices[run.time[indices] % 4.0 > 0.5])


@pytest.mark.parametrize("load_mass", [None, 10.0])
def test_nearly_all_samples_of_an_uneven_run_with_gaps_are_used(load_mass: float | None) -> None:
    run = uneven(made(1, ride=FAST, load_mass=load_mass), 1)
    assert np.count_nonzero(np.diff(run.time) > 0.4) >= 9
    recording = prepare([run], GROOVED).recordings[0]
    for output, valid in recording.valid.items():
        assert np.mean(valid) >= 0.95, output
    assert recording.valid["cable_length"].all()


def test_a_missing_output_costs_no_other_sample_and_a_missing_angle_its_derivatives() -> None:
    run = made(1)
    values = run["motor_torque"].copy()
    values[200] = np.nan
    torque = replace(run.channels["motor_torque"], values=values)
    lacking = replace(run, channels={**run.channels, "motor_torque": torque})
    whole = prepare([run], GROOVED).recordings[0].valid["motor_torque"]
    less = prepare([lacking], GROOVED).recordings[0].valid["motor_torque"]
    assert np.flatnonzero(whole != less).tolist() == [200]
    values = run["motor_angle"].copy()
    values[200] = np.nan
    angle = replace(run.channels["motor_angle"], values=values)
    less = prepare(
        [replace(run, channels={**run.channels, "motor_angle": angle})], GROOVED
    ).recordings[0]
    assert np.flatnonzero(whole != less.valid["motor_torque"]).tolist() == [198, 199, 200, 201, 202]
    assert np.flatnonzero(~less.valid["cable_length"]).tolist() == [200]


@given(st.sets(st.integers(0, 30)), st.integers(0, 5))
def test_differences_use_no_unknown_sample(unknown: set[int], reach: int) -> None:
    mask = np.isin(np.arange(31), list(unknown))
    known = away_from(mask, reach)
    for index in range(31):
        needed = range(index - reach, index + reach + 1)
        assert known[index] == all(0 <= k < 31 and k not in unknown for k in needed)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 0.4), st.floats(0.01, 0.2))
def test_stamps_that_jitter_about_even_instants_are_mended(
    seed: int, jitter: float, step: float
) -> None:
    random = np.random.default_rng(seed)
    instants = 100.0 + step * np.arange(800)[random.random(800) > 0.05]
    stamps = instants + step * jitter * random.uniform(-1, 1, len(instants))
    angle = 50 * np.sin(2 * np.pi * instants / (150 * step)) + 1e-4 * random.standard_normal(
        len(instants)
    )
    found = even_instants(stamps, angle)
    assert found is not None
    # The mean of the jitter is not observable. The period is the slope of a straight line through n
    # stamps, whose error spreads over the run with a standard deviation of 1/√n of the jitter's.
    error = found - instants
    assert np.std(error) < 5 * np.std(stamps - instants) / np.sqrt(len(instants))


@pytest.mark.parametrize("seed", range(5))
def test_samples_that_were_taken_unevenly_keep_their_stamps(seed: int) -> None:
    random = np.random.default_rng(seed)
    stamps = np.arange(800) * 0.05 + 0.02 * random.uniform(-1, 1, 800)
    angle = 50 * np.sin(stamps) + 1e-4 * random.standard_normal(800)
    assert even_instants(stamps, angle) is None


def test_an_even_run_is_left_alone() -> None:
    run = made(1)
    assert even_instants(run.time, run["motor_angle"]) is None
    assert np.array_equal(prepare([run], GROOVED).recordings[0].signals.time, run.time)


def coulomb(runs: list[Run]) -> float:
    """Coulomb torque fitted to runs that hide 50 mN m."""
    engine = selection_engine(prepare(runs, GROOVED), load_catalogue())
    start = engine.initial_model.with_term(term("motor-coulomb", torque=0.04), len(runs))
    fitted, _ = engine.fit_with_noise(start)
    return float(fitted.hypothesis.terms[-1].values["torque"])


@pytest.fixture(scope="module")
def fine() -> list[Run]:
    """Two runs under each of two loads, at 200 Hz."""
    hidden = [term("motor-coulomb", torque=0.05)]
    return [made(k, GROOVED, hidden, load_mass=10.0 + 15.0 * (k // 2), ride=FAST) for k in range(4)]


@pytest.mark.slow
def test_a_fit_on_uneven_samples_is_not_biased(fine: list[Run]) -> None:
    """Rows are transforms over the samples' numbers of measured and predicted alike.

    5 mN m of noise in 3000 samples: a standard deviation of 0.2 %, four of which are 0.8 %.
    """
    assert coulomb([uneven(run, k) for k, run in enumerate(fine)]) == pytest.approx(0.05, rel=0.008)


@pytest.mark.slow
def test_stamps_that_jitter_change_no_value(fine: list[Run]) -> None:
    even = [picked(run, np.arange(0, len(run), 10)) for run in fine]
    random = np.random.default_rng(8)
    stamped = [
        replace(run, time=run.time + 0.0125 * random.uniform(-1, 1, len(run))) for run in even
    ]
    assert coulomb(stamped) == pytest.approx(coulomb(even), rel=1e-3)


def test_an_angle_that_the_logger_holds_is_compared_at_its_new_values() -> None:
    """An instrument of 67 Hz in a log of 1 kHz, with a rest: inertia and friction by formula."""
    random, time = np.random.default_rng(1), np.arange(0.0, 30.0, 0.001)
    moving = np.minimum(time, 20.0)
    angle = 0.8 * np.sin(2.1 * moving) + 0.4 * np.sin(5.3 * moving + 1)
    rate = np.gradient(angle, time)
    torque = 0.5 * np.gradient(rate, time) + 6 * np.tanh(rate / 0.03) + 0.3 * rate
    held = np.arange(len(time)) // 15 * 15
    measured = {
        "motor_angle": (angle + random.normal(0, 1e-4, len(time)), "rad"),
        "motor_torque": (torque + random.normal(0, 0.3, len(time)), "N m"),
    }
    channels = {name: Channel(values[held], unit) for name, (values, unit) in measured.items()}
    data = prepare([Run("held", time, channels, {})], AxisProfile(name="joint"))
    (recording,) = data.recordings
    assert np.diff(recording.signals.time) == pytest.approx(0.015)
    assert recording.signals.time[-1] > 29.9
    assert any("every 15th row" in note for note in data.notes)
    away = (np.abs(rate[held][::15]) > 0.3) & (time[::15] < 19.9)
    count = min(len(away), len(recording.raw.at.motor_rate))
    found = recording.raw.at.motor_rate[:count][away[:count]]
    assert found == pytest.approx(rate[held][::15][:count][away[:count]], abs=0.1)
