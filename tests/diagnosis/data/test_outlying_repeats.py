"""A run made under another unrecorded condition is found among its repeats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from winchkit.diagnosis.data.repeats import outlying_repeat

TURN = np.linspace(0, 2 * np.pi, 512)
COGGING = np.sin(7 * TURN) + 0.5 * np.sin(14 * TURN)
HALF_A_TURN_ON = -np.sin(7 * TURN) + 0.5 * np.sin(14 * TURN)


@pytest.mark.parametrize("place", range(4))
def test_a_run_with_another_zero_of_the_angle_is_found(place: int) -> None:
    random = np.random.default_rng(place)
    clean = [COGGING] * 4
    clean[place] = HALF_A_TURN_ON
    found = outlying_repeat(np.array(clean) + 0.1 * random.standard_normal((4, 512)))
    assert found is not None
    assert found.index == place
    assert found.rms == pytest.approx(np.sqrt(2), rel=0.05)
    assert found.usual == pytest.approx(0.1 * np.sqrt(2), rel=0.15)


def test_a_noisier_run_and_one_with_another_offset_are_repeats() -> None:
    random = np.random.default_rng(5)
    runs = COGGING + 0.05 * random.standard_normal((4, 512))
    runs[2] += 0.15 * random.standard_normal(512)
    runs[1] += 3.0
    assert outlying_repeat(runs) is None


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_noise_alone_is_seldom_outlying(colour: float) -> None:
    """A level of 1e-3 at a ratio of at least four: none of 300."""
    random = np.random.default_rng(6)
    found = 0
    for _ in range(300):
        noise = lfilter([1.0], [1.0, -colour], random.standard_normal((4, 600)), axis=1)
        found += outlying_repeat(noise) is not None
    assert found == 0


def test_two_repeats_show_that_they_differ_and_not_which_one_is_wrong() -> None:
    assert outlying_repeat(np.array([COGGING, HALF_A_TURN_ON])) is None
