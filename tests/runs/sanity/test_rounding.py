"""Mean rounding error against simulated instruments."""

import numpy as np
import pytest
from scipy.fft import dct

from winchkit.arrays import Array
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.runs.sanity.rounding import mean_error, noise_before_rounding

STEP = 0.5


def rounded(values: Array) -> Array:
    return np.asarray(np.round(values / STEP) * STEP)


@pytest.mark.parametrize("noise", [0.05, 0.1, 0.2, 0.4])
def test_mean_error_of_a_slow_signal(noise: float) -> None:
    random = np.random.default_rng(1)
    signal = np.linspace(0.0, 3.3, 600)
    many = rounded(signal + random.normal(0, noise, (4000, 600)))
    simulated = many.mean(axis=0) - signal
    components, white = mean_error(signal, STEP, noise)
    order = np.arange(1, 9)
    signs = (-1.0) ** order
    # Cosines first, then sines: with the zero at a whole step only sines are left.
    expected = signs @ components[8:]
    # Near a jump half a step and the noise are the standard deviation.
    within = 5 * (STEP / 2 + noise) / np.sqrt(len(many))
    np.testing.assert_allclose(simulated, expected, atol=within)
    apart = float(np.mean((many - signal - simulated) ** 2))
    assert apart == pytest.approx(noise**2 + white, rel=0.05)


@pytest.mark.parametrize("zero", [0.0, 0.1, 0.23])
def test_its_spectrum_is_bounded_whatever_the_zero_is(zero: float) -> None:
    time = np.linspace(0, 60, 3000)
    signal = 0.9 * np.sin(0.4 * time) + 0.3 * time
    error = rounded(signal + zero) - signal - zero
    components, white = mean_error(signal, STEP, 0.0)
    bound = np.sum(np.asarray(dct(components, norm="ortho")) ** 2, axis=0) + white
    power = np.asarray(dct(error, norm="ortho")) ** 2
    # Over bands: a harmonic's phase moves its power from one coefficient to the next.
    for rows in np.array_split(np.arange(3000), 30)[:10]:
        assert power[rows].mean() < 1.3 * bound[rows].mean()


@pytest.mark.parametrize("noise", [0.0, 0.06, 0.12, 0.25, 0.7])
def test_noise_before_rounding_from_that_after_it(noise: float) -> None:
    random = np.random.default_rng(2)
    signal = np.linspace(0.0, 8.0, 40_000)
    after = local_noise(rounded(signal + random.normal(0, 1, 40_000) * noise))
    assert noise_before_rounding(after, STEP) == pytest.approx(noise, abs=0.03)
