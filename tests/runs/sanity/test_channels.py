"""Findings on channels: a fault of random size is found, a clean channel has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.consistency import LATE
from winchkit.runs.sanity.factors import Slope, named_factor
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.inspection import inspect_run, inspect_runs
from winchkit.runs.sanity.local_noise import local_noise, sorted_quantile
from winchkit.runs.sanity.outliers import _chance, outlier_mask
from winchkit.runs.sanity.quantisation import _BINS, _PADDED, _SEARCHED, _cosine_sums, resolution
from winchkit.runs.sanity.saturation import at_limit

Array = NDArray[np.float64]
SEEDS = st.integers(0, 2**31)
COUNT = 1500
RATE = 50.0


def tension(seed: int, noise: float = 0.8) -> Array:
    """A force with ramps, steps and white noise."""
    random = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    signal = 150 + 40 * np.sin(2 * np.pi * time / random.uniform(3, 12))
    signal += random.uniform(5, 20) * np.sign(np.sin(2 * np.pi * time / random.uniform(4, 9)))
    return np.asarray(signal + random.normal(0, noise, COUNT))


def run_of(values: Array, name: str = "tension", unit: str = "N") -> Run:
    time = np.arange(len(values)) / RATE
    angle = 40 * np.sin(2 * np.pi * time / 7)
    channels = {"motor_angle": Channel(angle, "rad"), name: Channel(values, unit)}
    return Run("r", time, channels)


def found(run: Run, code: str) -> list[Finding]:
    return [finding for finding in inspect_run(run).findings if finding.code == code]


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_a_clean_channel_has_no_finding(seed: int) -> None:
    assert inspect_run(run_of(tension(seed))).findings == ()


@given(SEEDS, st.integers(1, 300), st.floats(0, 1))
def test_the_quantile_of_sorted_values_is_that_of_numpy(
    seed: int, count: int, share: float
) -> None:
    values = np.random.default_rng(seed).normal(size=count)
    assert sorted_quantile(np.sort(values), share) == pytest.approx(np.quantile(values, share))


def test_the_transform_of_a_histogram_is_the_sum_of_its_cosines() -> None:
    counts = np.random.default_rng(1).poisson(0.2, _BINS)
    phase = 2 * np.pi * np.outer(np.arange(0, _SEARCHED, 50), np.arange(_BINS) + 0.5) / _PADDED
    assert _cosine_sums(counts)[::50] == pytest.approx(np.cos(phase) @ counts, abs=1e-8)


@given(SEEDS, st.floats(0.1, 10.0))
@settings(max_examples=40, deadline=None)
def test_the_local_noise_is_that_of_the_samples(seed: int, noise: float) -> None:
    random = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    values = 50 * np.sin(time) + random.normal(0, noise, COUNT)
    assert local_noise(values) == pytest.approx(noise, rel=0.12)


@given(SEEDS, st.floats(1e-4, 20.0), st.integers(4, 9))
@settings(max_examples=80, deadline=None)
def test_the_resolution_is_the_step(seed: int, step: float, digits: int) -> None:
    """Also where printing rounds to a few digits, in another unit."""
    random = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    noise = random.uniform(0.0, 1.0) * step
    signal = random.uniform(20, 300) * step * np.sin(time) + random.normal(0, 1, COUNT) * noise
    values = step * np.round(signal / step)
    largest = 10.0 ** np.floor(np.log10(np.abs(values).max()))
    printed = np.round(values / largest, digits) * largest
    rounding = largest * 10.0**-digits
    if rounding > 0.01 * step:
        return
    assert resolution(printed) == pytest.approx(step, rel=0.01)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_a_continuous_channel_has_no_resolution(seed: int) -> None:
    assert resolution(tension(seed)) == 0.0


@given(SEEDS, st.integers(7, 40), st.floats(1e-3, 0.3))
@settings(max_examples=80, deadline=None)
def test_a_wave_with_few_samples_a_period_is_not_quantised(
    seed: int, samples: int, noise: float
) -> None:
    """Its differences have few values, whose common step is none of an instrument."""
    random = np.random.default_rng(seed)
    phase = 2 * np.pi * np.arange(COUNT) / samples + random.uniform(0, 6)
    values = 10 * np.sin(phase) + random.normal(0, noise, COUNT)
    assert not found(run_of(values), "quantised")


@given(SEEDS, st.floats(1.5, 30.0))
@settings(max_examples=40, deadline=None)
def test_a_coarse_cell_is_quantised(seed: int, step: float) -> None:
    values = step * np.round(tension(seed) / step)
    (finding,) = found(run_of(values), "quantised")
    assert finding.value == pytest.approx(step, rel=0.01)


@given(SEEDS, st.integers(1, 12), st.floats(20.0, 1e4))
@settings(max_examples=60, deadline=None)
def test_spikes_are_outliers_and_nothing_else_is(seed: int, count: int, size: float) -> None:
    random = np.random.default_rng(seed)
    values = tension(seed)
    places = np.sort(random.choice(np.arange(3, COUNT - 3, 7), count, replace=False))
    spiked = values.copy()
    spiked[places] += size * 2.5 * random.choice([-1, 1], count)
    mask = outlier_mask(spiked)
    assert not np.any(np.delete(mask, places))
    # A spike on the flank of a step is a part of the step.
    assert np.count_nonzero(mask[places]) >= 0.6 * count - 1


@given(SEEDS, st.integers(1, 30), st.floats(12.0, 1e4), st.floats(-1e5, 1e5))
@settings(max_examples=40, deadline=None)
def test_spikes_in_a_fast_motion_are_those_at_rest(
    seed: int, count: int, size: float, speed: float
) -> None:
    """A motion at constant speed has a step of any size per sample."""
    random = np.random.default_rng(seed)
    values = random.normal(0, 0.8, COUNT)
    values[random.choice(np.arange(10, COUNT - 10, 5), count, replace=False)] += 2.5 * size
    moving = values + speed * np.arange(COUNT)
    assert np.array_equal(outlier_mask(moving), outlier_mask(values))
    assert np.count_nonzero(outlier_mask(moving)) >= (count if size > 20 else 0)


@given(SEEDS, st.integers(0, 2**31), st.floats(200.0, 1e4), st.sampled_from([-1.0, 1.0]))
@settings(max_examples=40, deadline=None)
def test_two_spikes_with_one_sample_between_them_are_outliers(
    seed: int, place: int, size: float, sign: float
) -> None:
    # White noise about a constant: both spikes are certain.
    values = 150 + np.random.default_rng(seed).normal(0, 0.8, COUNT)
    first = 10 + place % (COUNT - 20)
    values[first] += size
    values[first + 2] += sign * size
    assert np.flatnonzero(outlier_mask(values)).tolist() == [first, first + 2]


@given(SEEDS, st.integers(0, 2**31), st.floats(-0.05, 0.05))
@settings(max_examples=40, deadline=None)
def test_three_zeros_within_six_samples_are_outliers(seed: int, place: int, speed: float) -> None:
    """The two outer ones hide that between them: the local slope is that of the spikes."""
    values = 150 + np.random.default_rng(seed).normal(0, 0.8, COUNT) + speed * np.arange(COUNT)
    first = 10 + place % (COUNT - 20)
    zeros = [first, first + 2, first + 5]
    values[zeros] = 0.0
    assert np.flatnonzero(outlier_mask(values)).tolist() == zeros


@pytest.mark.parametrize("peaks", [False, True])
def test_spikes_that_coincide_by_chance_are_outliers_and_peaks_are_not(peaks: bool) -> None:
    """Spikes in 1 % of the samples of two channels; or peaks of the force, which both show."""
    random = np.random.default_rng(11)
    places = [5 + random.choice(COUNT // 5 - 2, 15, replace=False) * 5 for _ in range(2)]
    places[1] = (
        places[0] if peaks else np.append(places[1][places[1] != places[0][0]], places[0][0])
    )
    run = run_of(150 + random.normal(0, 0.8, COUNT))
    torque = Channel(4 + random.normal(0, 0.02, COUNT), "N m")
    run = replace(run, channels={**run.channels, "motor_torque": torque})
    names = ("tension", "motor_torque")
    for name, rows in zip(names, places, strict=True):
        run[name][rows] += 300.0 * random.choice([-1, 1], len(rows))
    masks = inspect_run(run).outliers
    if peaks:
        assert not masks
    else:
        for name, rows in zip(names, places, strict=True):
            assert np.flatnonzero(masks[name]).tolist() == sorted(set(rows.tolist()))


@pytest.mark.parametrize("shared", [1, 3])
def test_one_peak_is_physical_where_more_channels_show_it_than_by_chance(shared: int) -> None:
    """Three other channels deviate in 1.5 % of the samples: in 13 % of runs one does at a spike."""
    random = np.random.default_rng(23)
    run = run_of(150 + random.normal(0, 0.8, COUNT))
    names = ("motor_torque", "motor_angle", "load")
    others = {}
    for number, name in enumerate(names):
        values = 4 + random.normal(0, 0.02, COUNT)
        own = 20 + random.choice((COUNT - 60) // 12, 22, replace=False) * 12
        values[own] += 0.2 * random.choice([-1, 1], len(own))
        values[COUNT - 20] += 0.2 if number < shared else 0.0
        others[name] = Channel(values, {"motor_torque": "N m", "motor_angle": "rad"}.get(name, "N"))
    run = replace(run, channels={**run.channels, **others})
    run["tension"][COUNT - 20] += 300.0
    assert ("tension" in inspect_run(run).outliers) == (shared == 1)


@pytest.mark.parametrize("shares", [(0.98, 0.02), (0.8, 0.1, 0.03, 0.07)])
def test_the_chance_of_coincidences_is_that_of_a_sum_of_draws(shares: tuple[float, ...]) -> None:
    trials = 7
    whole = reduce(np.convolve, [np.array(shares)] * trials)
    for count in range(len(whole)):
        chance = _chance(count, trials, np.array(shares))
        assert chance == pytest.approx(whole[count:].sum(), abs=1e-12)


@given(SEEDS, st.floats(5.0, 24.0), st.integers(3, 20))
@example(seed=3, frequency=RATE / 4, periods=12).via("every second sample is an extreme")
@example(seed=3, frequency=RATE / 4 + 0.005, periods=20).via("every second sample is an extreme")
@settings(max_examples=40, deadline=None)
def test_a_vibration_of_short_duration_loses_a_few_samples_at_its_ends(
    seed: int, frequency: float, periods: int
) -> None:
    values = 150 + np.random.default_rng(seed).normal(0, 0.05, COUNT)
    time = np.arange(COUNT) / RATE
    window = (time > 10.0) & (time < 10.0 + periods / frequency)
    values += np.where(window, 20 * np.sin(2 * np.pi * frequency * (time - 10.0)), 0.0)
    assert np.count_nonzero(outlier_mask(values)) <= 4


@given(SEEDS, st.floats(0.55, 0.95), st.booleans())
@settings(max_examples=40, deadline=None)
def test_a_limit_of_the_instrument_is_saturation(seed: int, share: float, low: bool) -> None:
    values = tension(seed)
    limit = float(np.quantile(values, 1 - share if low else share))
    cut = np.maximum(values, limit) if low else np.minimum(values, limit)
    (finding,) = found(run_of(cut), "saturated")
    assert finding.value == pytest.approx(1 - share, abs=0.01)


@given(SEEDS, st.floats(0.55, 0.9), st.floats(0.2, 0.8))
@settings(max_examples=100, deadline=None)
def test_a_coarse_cell_saturates_too(seed: int, share: float, step: float) -> None:
    values = tension(seed)
    limit = step * round(float(np.quantile(values, share)) / step)
    (finding,) = found(run_of(np.minimum(step * np.round(values / step), limit)), "saturated")
    assert finding.value == pytest.approx(1 - share, abs=0.1)


@given(SEEDS, st.floats(0.2, 20.0))
@settings(max_examples=150, deadline=None)
def test_a_coarse_cell_that_does_not_saturate(seed: int, step: float) -> None:
    assert not found(run_of(step * np.round(tension(seed) / step)), "saturated")


@given(SEEDS, st.floats(1.5, 10.0), st.floats(0.6, 1.5))
@settings(max_examples=40, deadline=None)
def test_a_channel_of_a_few_levels_is_quantised_and_nothing_else(
    seed: int, levels: float, ratio: float
) -> None:
    """A resolution of up to 13 times the noise, and a slow signal of a few steps.

    Less noise changes the level too rarely to distinguish such a channel from a commanded one of
    two or three levels: of 200 channels of 2.5 steps 1 with noise of 1/20 of a step, 121 with 1/32.
    """
    random = np.random.default_rng(seed)
    noise, step = ratio * 0.25, 2.0
    signal = 150 + step * levels / 2 * np.sin(np.arange(COUNT) / 100)
    values = step * np.round((signal + random.normal(0, noise, COUNT)) / step)
    assert resolution(values) == pytest.approx(step, rel=1e-9)
    codes = {finding.code for finding in inspect_run(run_of(values)).findings}
    assert codes <= {"quantised"}


def test_a_command_of_three_levels_is_not_quantised() -> None:
    values = 0.1 * np.sign(np.round(1.4 * np.sin(np.arange(20 * COUNT) / 60)))
    assert len(np.unique(values)) == 3
    assert resolution(values) == 0.0


def test_a_smooth_signal_is_cut_off_at_a_slope() -> None:
    time = np.arange(COUNT) / RATE
    assert found(run_of(np.minimum(100 * np.sin(time), 60.0)), "saturated")


def smooth(seed: int) -> Array:
    """A sine with its harmonic, or a weight that swings, every 50 to 1 ms."""
    random = np.random.default_rng(seed)
    time = np.arange(0, random.uniform(1, 8), 1 / random.choice([20, 50, 100, 500, 1000]))
    phase = 2 * np.pi * random.uniform(0.05, 3) * time + random.uniform(0, 6)
    values = np.sin(phase) + random.uniform(0, 0.3) * np.sin(2 * phase + random.uniform(0, 6))
    return np.asarray(values if seed % 2 else np.sin(random.uniform(0.5, 3) * np.sin(phase)))


@pytest.mark.parametrize("noise", [1e-6, 0.1, 0.3, 1.0])
def test_the_bend_of_a_coarse_smooth_signal_is_no_limit(noise: float) -> None:
    """A flat top is indistinguishable from a limit: 3 of 100 may be one (measured: 11 of 1600)."""
    alarms = 0
    for seed in range(100):
        values = smooth(seed)
        random = np.random.default_rng(seed)
        step = float(np.ptp(values)) / random.uniform(8, 1000)
        rounded = step * np.round(values / step + random.normal(0, noise, len(values)))
        alarms += bool(at_limit(rounded, resolution(rounded)).any())
    assert alarms <= 3


def weight(seed: int, noise: float) -> Array:
    """Torque of a pendulum that swings by 140 degrees, of 2 N m, with noise, every 10 ms."""
    random = np.random.default_rng(seed)
    time, phase = np.arange(2000) * 0.01, random.uniform(0, 6)
    angle = 1.8 * np.sin(1.3 * time + phase) + 0.7 * np.sin(2.9 * time)
    return 2.0 * np.sin(angle) + random.normal(0.0, noise, len(time))


@given(SEEDS, st.floats(0.001, 0.1), st.floats(0.001, 0.02), st.floats(1.2, 1.6))
@settings(max_examples=60, deadline=None)
def test_a_steep_torque_is_cut_off_whatever_its_resolution(
    seed: int, step: float, noise: float, limit: float
) -> None:
    rounded = step * np.round(weight(seed, noise) / step)
    level = step * round(limit / step)
    time = np.arange(len(rounded)) * 0.01
    assert not inspect_run(_drive(time, 90 * time, rounded)).outliers
    cut = np.clip(rounded, -level, level)
    mask = inspect_run(_drive(time, 90 * time, cut)).outliers["motor_torque"]
    assert np.array_equal(mask, np.abs(cut) > level - step / 2)


@given(SEEDS, st.floats(0.02, 0.2))
@settings(max_examples=60, deadline=None)
def test_a_torque_that_is_constant_by_itself_is_not_cut_off(seed: int, step: float) -> None:
    """Coulomb friction, and the inertia of a motion with trapezoidal velocity, of coarse values."""
    time = np.arange(3000) * 0.01
    noise = np.random.default_rng(seed).normal(0.0, 0.1 * step, len(time))
    for torque in (
        np.sign(np.sin(time)) + 0.2 * np.sin(3 * time),
        np.interp(time % 8, [0.5, 0.7, 2, 2.2, 4.5, 4.7, 6, 6.2], [0, 2, 2, 0, 0, -2, -2, 0]),
    ):
        values = step * np.round((torque + noise) / step)
        assert not inspect_run(_drive(time, 90 * time, values)).outliers


def test_rest_at_the_end_of_a_smooth_travel_is_no_saturation() -> None:
    phase = np.clip(np.arange(COUNT) / RATE - 5, 0, np.pi)
    assert not found(run_of(2 - np.cos(phase), "cable_length", "m"), "saturated")


@given(SEEDS, st.integers(2, 20))
@settings(max_examples=40, deadline=None)
def test_held_values_are_those_of_a_slower_instrument(seed: int, held: int) -> None:
    values = np.repeat(tension(seed)[: COUNT // held], held)
    (finding,) = found(run_of(values), "repeated-values")
    assert finding.value == pytest.approx(1 - 1 / held, abs=0.02)
    rate = float(finding.text.partition("about ")[2].partition(" Hz")[0])
    assert rate == pytest.approx(RATE / held, rel=0.02)


def test_a_slow_channel_of_coarse_resolution_is_not_held() -> None:
    time = np.arange(COUNT) / RATE
    values = np.round(40 * np.sin(2 * np.pi * time / 15))
    assert not found(run_of(values), "repeated-values")


@given(SEEDS)
def test_few_levels_have_the_resolution_that_another_run_shows(seed: int) -> None:
    """A slow run of a coarse cell: no slower instrument, and no spike of a single step."""
    random, time = np.random.default_rng(seed), np.arange(COUNT) / RATE
    slow = 150 + 6 * np.sin(2 * np.pi * time / 20) + random.normal(0, 0.1, COUNT)
    runs = [run_of(5 * np.round(values / 5)) for values in (tension(seed), slow)]
    for inspected in inspect_runs(runs):
        assert inspected.resolutions["tension"] == pytest.approx(5.0, rel=1e-3)
        assert {finding.code for finding in inspected.findings} == {"quantised"}


def test_a_constant_channel() -> None:
    (finding,) = found(run_of(np.full(COUNT, 26.0), "temperature", "degC"), "constant")
    assert finding.value == 26.0


@given(SEEDS, st.floats(0.1, 0.45))
@settings(max_examples=30, deadline=None)
def test_jitter_of_the_clock(seed: int, jitter: float) -> None:
    random = np.random.default_rng(seed)
    time = np.cumsum((1 + random.uniform(-1, 1, COUNT) * np.sqrt(3) * jitter) / RATE)
    run = Run("r", time, {"tension": Channel(tension(seed), "N")})
    (finding,) = found(run, "clock-jitter")
    assert finding.value == pytest.approx(jitter, rel=0.1)


def test_gaps_are_counted_with_what_they_lose() -> None:
    time = np.arange(COUNT) / RATE
    time[500:] += 2.0
    time[900:] += 0.5
    (finding,) = found(Run("r", time, {"tension": Channel(tension(1), "N")}), "gap")
    assert finding.value == pytest.approx(2.5)
    assert "2 gaps" in finding.text


def test_lost_samples_are_gaps_and_no_jitter_nor_resolution() -> None:
    random = np.random.default_rng(4)
    kept = random.random(COUNT) > 0.03
    time = (np.arange(COUNT) / RATE)[kept]
    # A motion of two speeds, without noise.
    angle = np.interp(time, [0, time[-1] / 2, time[-1]], [0, 3.0 * time[-1], 4.0 * time[-1]])
    run = Run("r", time, {"motor_angle": Channel(angle, "rad")})
    codes = {f.code: f for f in inspect_run(run).findings}
    assert set(codes) == {"gap"}
    lost = np.count_nonzero(~kept[np.flatnonzero(kept)[0] : np.flatnonzero(kept)[-1]])
    assert codes["gap"].value == pytest.approx(lost / RATE)


@pytest.mark.parametrize(
    ("change", "code", "word"),
    [
        (lambda v: -v, "inverted-sign", "inverted"),
        (lambda v: v * 60 / (2 * np.pi), "wrong-factor", "rpm"),
        (np.degrees, "wrong-factor", "degrees"),
        (lambda v: v / (2 * np.pi), "wrong-factor", "turns"),
        (lambda v: v * 1000, "wrong-factor", "power of ten"),
        (lambda v: v, "", ""),
    ],
)
def test_velocity_against_angle(change: Callable[[Array], Array], code: str, word: str) -> None:
    time = np.arange(COUNT) / RATE
    angle, velocity = 40 * np.sin(time), 40 * np.cos(time)
    velocity = velocity + np.random.default_rng(2).normal(0, 1.0, COUNT)
    channels = {
        "motor_angle": Channel(angle, "rad"),
        "motor_velocity": Channel(change(velocity), "rad/s"),
    }
    findings = [
        f for f in inspect_run(Run("r", time, channels)).findings if f.channel == "motor_velocity"
    ]
    assert [f.code for f in findings] == ([code] if code else [])
    assert all(word in f.text for f in findings)


def test_a_velocity_is_in_no_unit_of_force() -> None:
    """0.981 is decanewtons and kilograms, 2.2 pounds, 25.4 inches."""
    for value in (0.981 * 0.75, 2.2046, 25.4):
        assert not named_factor(Slope(value, 1e-3), "angle")
    assert "inches" in named_factor(Slope(25.4, 1e-3))
    assert named_factor(Slope(9.81, 0.01)) == "9.81: kilograms and newtons"
    both = named_factor(Slope(9.9, 0.1))
    assert "kilograms" in both
    assert "power of ten" in both
    assert "rpm" in named_factor(Slope(60 / (2 * np.pi), 1e-3), "angle")


@pytest.mark.parametrize(("spread", "codes"), [(0.3, []), (0.05, ["inconsistent-velocity"])])
def test_a_slope_is_judged_by_its_uncertainty(spread: float, codes: list[str]) -> None:
    """40 blocks with slopes of 0.7 ± spread: 0.70 ± 0.05 may be 0.8, 0.700 ± 0.008 may not.

    No unit explains 0.7: the velocity is left out, and the angle remains.
    """
    time = np.arange(COUNT) / RATE
    block = np.minimum(np.arange(COUNT) * 40 // COUNT, 39)
    channels = {
        "motor_angle": Channel(time.copy(), "rad"),
        "motor_velocity": Channel(0.7 + spread * np.where(block % 2, 1.0, -1.0), "rad/s"),
    }
    findings = inspect_run(Run("r", time, channels)).findings
    own = [f.code for f in findings if f.channel == "motor_velocity"]
    assert [code for code in own if code != "repeated-values"] == codes


@given(SEEDS, st.floats(0.02, 0.16), st.integers(3, 6))
@settings(max_examples=40, deadline=None)
def test_a_filter_of_the_logger_is_a_low_pass(seed: int, share: float, order: int) -> None:
    cut_off = share * RATE
    filtered = sosfilt(butter(order, cut_off, fs=RATE, output="sos"), tension(seed))[100:]
    (finding,) = found(run_of(np.asarray(filtered)), "low-pass")
    assert 0.4 * cut_off < finding.value < 2 * cut_off


def test_a_jerk_is_no_spike() -> None:
    """One sample of acceleration is in the angle and in the force."""
    time = np.arange(COUNT) / RATE
    random = np.random.default_rng(3)
    angle = np.where(time > 10, 5.0 * (time - 10), 0.0)
    force = 98 + random.normal(0, 0.3, COUNT)
    force[int(10 * RATE)] += 20
    channels = {"motor_angle": Channel(angle, "rad"), "tension": Channel(force, "N")}
    assert not found(Run("r", time, channels), "outliers")
    force[int(20 * RATE)] += 20
    (finding,) = found(Run("r", time, channels), "outliers")
    assert finding.text.startswith("1 spike of 20.0 N")


def test_a_corrupted_row_is_no_jerk() -> None:
    """A position that leaves and returns within two samples makes no peak of a force physical."""
    random = np.random.default_rng(3)
    length = 5.0 + np.arange(COUNT) * 1e-3 + random.normal(0, 1e-4, COUNT)
    force = 98 + random.normal(0, 0.3, COUNT)
    rows = np.arange(200, COUNT - 200, 150)
    length[rows] += 0.3
    force[rows] += 40
    run = Run("r", np.arange(COUNT) / RATE, {
        "cable_length": Channel(length, "m"), "tension": Channel(force, "N")
    })  # fmt: skip
    texts = [finding.text for finding in found(run, "outliers")]
    assert len(texts) == 2
    assert all(text.startswith(f"{len(rows)} ") for text in texts)


def _with_velocity(angle: Array, velocity: Array) -> list[str]:
    time = np.arange(len(angle)) / RATE
    channels = {"motor_angle": Channel(angle, "rad"), "motor_velocity": Channel(velocity, "rad/s")}
    findings = inspect_run(Run("r", time, channels)).findings
    return [f.code for f in findings if f.channel == "motor_velocity"]


@pytest.mark.parametrize("seed", range(5))
def test_a_velocity_of_another_axis_or_delayed_is_inconsistent(seed: int) -> None:
    """A quarter of a period is no correlation, a tenth is cos²(36°) = 0.65 of the variance."""
    rng = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    period = time[-1] / (30 + 10 * rng.random())
    phase = 2 * np.pi * time / period
    angle, noise = 3 * np.sin(phase), rng.normal(0, 0.02, COUNT)
    size = 2 * np.pi / period
    turned = [3 * size * np.cos(phase - 2 * np.pi * share) for share in (0.0, 0.1, 0.25)]
    codes = [_with_velocity(angle, own + noise) for own in turned]
    assert codes[:1] == [[]]
    assert "inconsistent-velocity" not in codes[1]
    assert codes[2] == ["inconsistent-velocity"]
    assert _with_velocity(angle, np.cos(1.7 * phase) + noise) == ["inconsistent-velocity"]


def test_a_velocity_that_says_nothing_of_the_angle_is_not_inconsistent() -> None:
    """At rest, with an offset, or of noise alone: nothing contradicts the angle."""
    time, rng = np.arange(COUNT) / RATE, np.random.default_rng(4)
    quantised = np.round(rng.normal(0, 1e-3, COUNT), 3)
    slow = 1e-3 * np.sin(0.1 * time)
    assert "inconsistent-velocity" not in _with_velocity(quantised, slow)
    assert "inconsistent-velocity" not in _with_velocity(40 * np.sin(time), 40 * np.cos(time) + 90)
    assert "inconsistent-velocity" not in _with_velocity(np.sin(time), rng.normal(0, 1, COUNT))


@pytest.mark.parametrize("row", [0, -1])
@pytest.mark.parametrize("seed", range(4))
def test_a_first_or_last_row_of_another_moment_is_an_outlier(row: int, seed: int) -> None:
    """A logger's first row has values from before: angle and torque jump together."""
    rng = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    angle, torque = 3 * np.sin(time), 0.2 * np.cos(time) + rng.normal(0, 0.01, COUNT)
    assert not inspect_run(_drive(time, angle, torque)).outliers
    angle[row] -= 4.0
    torque[row] += 0.5
    masks = inspect_run(_drive(time, angle, torque)).outliers
    assert {name: np.flatnonzero(mask).tolist() for name, mask in masks.items()} == {
        "motor_angle": [range(COUNT)[row]],
        "motor_torque": [range(COUNT)[row]],
    }


def test_a_run_may_begin_in_motion_or_with_a_step_like_later_ones() -> None:
    time = np.arange(COUNT) / RATE
    square = 0.3 * np.sign(np.sin(20 * time + 1e-3))
    square[0] = -0.3
    assert not inspect_run(_drive(time, 90 * time, square)).outliers


def _drive(time: Array, angle: Array, torque: Array) -> Run:
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run("r", time, channels)


@pytest.mark.parametrize(("factor", "found"), [(1.0, False), (180 / np.pi, True)])
def test_an_angle_in_degrees_turns_faster_than_any_motor(factor: float, found: bool) -> None:
    """A motor at 1,700 rpm; without a velocity only its speed shows the unit."""
    time = np.arange(0.0, 4.0, 0.01)
    run = Run("r", time, {"motor_angle": Channel(factor * 178.0 * time, "rad")})
    codes = [(f.code, f.channel) for f in inspect_run(run).findings if f.code == "wrong-factor"]
    assert codes == [("wrong-factor", "motor_angle")] * found


@pytest.mark.parametrize(("late", "words"), [(0.02, "20.0 ms late"), (-0.02, "20.0 ms ahead")])
def test_a_velocity_beside_its_angle_in_time_is_found(late: float, words: str) -> None:
    time = np.arange(0.0, 20.0, 0.01)
    angle, velocity = 30.0 * np.sin(1.3 * time), 39.0 * np.cos(1.3 * (time - late))
    channels = {
        "motor_angle": Channel(angle, "rad"),
        "motor_velocity": Channel(velocity, "rad/s"),
    }
    (found,) = (f for f in inspect_run(Run("r", time, channels)).findings if f.code == LATE)
    assert found.value == pytest.approx(late, rel=0.02)
    assert words in found.text
