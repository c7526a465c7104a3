"""Signals in frequency, against scipy's own filters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from winchkit.diagnosis.data.spectrum import (
    Band,
    band_edges,
    fast_count,
    low_pass,
    to_frequency,
    to_time,
)


@pytest.mark.parametrize(("rate", "cut_off"), [(1000.0, 20.0), (200.0, 20.0), (50.0, 5.0)])
def test_low_pass_is_a_butterworth_run_both_ways(rate: float, cut_off: float) -> None:
    signal = np.random.default_rng(1).standard_normal(4000).cumsum()
    ours = low_pass(signal, rate, cut_off)
    theirs = sosfiltfilt(butter(4, cut_off, fs=rate, output="sos"), signal)
    inside = slice(500, -500)
    lost = signal - theirs
    assert np.std(lost[inside]) > 0.0
    # A filter of samples bends frequency towards half their rate; at a tenth of it by 3 %.
    assert np.std((ours - theirs)[inside]) < 0.03 * np.std(lost[inside])


def test_low_pass_passes_halves_and_stops() -> None:
    rate, cut_off = 100.0, 5.0
    time = np.arange(2000) / rate
    for frequency, gain in ((0.5, 1.0), (5.0, 0.5), (20.0, 1 / (1 + 4**8))):
        wave = np.cos(2 * np.pi * frequency * time + 0.3)
        left = low_pass(wave, rate, cut_off)[200:-200]
        assert np.allclose(left, gain * wave[200:-200], atol=2e-3)


@given(st.integers(2, 300), st.integers(0, 2**32 - 1))
def test_there_and_back_is_the_identity(count: int, seed: int) -> None:
    signal = 10 * np.random.default_rng(seed).standard_normal(count)
    band = Band(count, 50.0)
    there = to_frequency(signal, band)
    assert np.allclose(to_time(there, band), signal)
    assert there @ there == pytest.approx(float(signal @ signal))


def test_white_noise_keeps_its_variance_in_every_coefficient() -> None:
    random, band = np.random.default_rng(2), Band(64, 50.0)
    power = np.mean(
        [to_frequency(3 * random.standard_normal(64), band) ** 2 for _ in range(4000)], 0
    )
    # The mean of 4000 squares varies by 9 √(2/4000) = 0.2.
    assert np.all(np.abs(power - 9.0) < 5 * 0.2)


def test_a_band_keeps_what_its_filter_passes() -> None:
    signal = np.random.default_rng(3).standard_normal(500)
    whole = Band(500, 50.0, 5.0, kept_cut_offs=np.inf)
    assert np.allclose(to_time(to_frequency(signal, whole), whole), low_pass(signal, 50.0, 5.0))
    band = Band(500, 50.0, 5.0)
    assert band.frequency.max() <= 5.0
    assert len(to_frequency(signal, band)) == len(band.frequency) == len(band.gain) == 101
    assert band.gain[-1] == pytest.approx(0.5)


@given(st.integers(1, 5000), st.integers(1, 6))
def test_bands_of_noise_are_in_order_and_hold_enough(count: int, copies: int) -> None:
    frequency = np.arange(count) * 0.01
    edges = band_edges(frequency, copies)
    assert edges[0] == -np.inf
    assert edges[-1] == np.inf
    assert np.all(np.diff(edges) > 0)
    inside, _ = np.histogram(frequency, np.clip(edges, -1.0, 1e9))
    assert inside.sum() == count
    if len(edges) > 2:
        assert inside.min() * copies >= 8


def test_a_fast_length_is_the_largest_with_small_factors_only() -> None:
    """Against a sieve, to 50 000; at most 1.3 % of a run is left out, less than 0.1 % of most."""
    counts = np.arange(1, 50_001)
    rest = counts.copy()
    for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23):
        while np.any(divisible := rest % prime == 0):
            rest[divisible] //= prime
    largest = np.maximum.accumulate(np.where(rest == 1, counts, 0))
    expected = np.where(counts < 1000, counts, largest)
    assert np.array_equal([fast_count(int(count)) for count in counts], expected)
    left_out = (counts - expected) / counts
    assert np.max(left_out) < 0.013
    assert np.median(left_out[4000:]) < 0.001
