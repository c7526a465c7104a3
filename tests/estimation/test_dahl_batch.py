"""Dahl friction along whole recordings: pieces, scan and loop are one law."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.estimation import Kernels
from winchkit.estimation.dahl_batch import dahl_batch
from winchkit.model.friction import dahl, dahl_constant, dahl_step

shapes = st.sampled_from([0.0, 0.5, 1.0, 1.3, 2.0])
steps = st.lists(st.one_of(st.just(0.0), st.floats(-0.03, 0.03)), max_size=60)


@given(steps, shapes, st.floats(-1, 1))
def test_pieces_are_step_after_step(moves: list[float], shape: float, start: float) -> None:
    position = np.cumsum([0.0, *moves])
    force, expected = start * 20.0, [start * 20.0]
    for before, after in pairwise(position):
        force = dahl_step(force, float(after - before), 20.0, 3000.0, shape)
        expected.append(force)
    found = dahl_constant(position, 20.0, 3000.0, shape, start)
    # Near the limit and below β = 1 a rounding of the force moves what is left by its root.
    assert np.allclose(found, expected, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("shape", [0.5, 1.0, 1.3])
def test_the_ways_agree_on_a_long_recording(shape: float) -> None:
    rng = np.random.default_rng(1)
    smooth = 0.05 * np.sin(np.linspace(0, 60, 20_000))
    rough = smooth + rng.normal(0, 1e-4, len(smooth))
    for position in (smooth, rough):
        pieces = dahl_constant(position, 20.0, 3000.0, shape, 0.3)
        stepped = dahl(position, np.full(len(position), 20.0), 3000.0, shape, 0.3)
        assert np.allclose(pieces, stepped, atol=1e-6)
        assert np.allclose(dahl_batch(position, 20.0, 3000.0, shape, 0.3), pieces, atol=1e-6)


def test_a_limit_that_changes_is_followed() -> None:
    position = 0.05 * np.sin(np.linspace(0, 30, 2000))
    limit = 20 + 5 * np.cos(np.linspace(0, 11, 2000))
    for shape in (1.0, 1.4):
        force, expected = 0.0, []
        for moved, most in zip(np.diff(position, prepend=position[0]), limit, strict=True):
            force = dahl_step(force, float(moved), float(most), 3000.0, shape)
            expected.append(force)
        assert np.allclose(dahl_batch(position, limit, 3000.0, shape), expected, atol=1e-9)


@pytest.mark.slow
def test_compiled_loops_agree(compiled_kernels: Kernels) -> None:
    rng = np.random.default_rng(1)
    position = np.cumsum(rng.normal(0, 1e-3, 3000))
    limit = 20 + 5 * np.cos(np.linspace(0, 11, 3000))
    for shape in (0.5, 1.0, 1.4):
        for most in (limit, 20.0):
            plain = dahl_batch(position, most, 3000.0, shape, 0.2)
            fast = dahl_batch(position, most, 3000.0, shape, 0.2, kernels=compiled_kernels)
            assert np.allclose(fast, plain, rtol=1e-6, atol=1e-6)


def test_nothing_and_no_limit() -> None:
    assert dahl_batch([], 20.0, 3000.0).shape == (0,)
    assert dahl_batch([1.0], 20.0, 3000.0, start=0.5).tolist() == [10.0]
    assert np.array_equal(dahl_batch(np.arange(5.0), 0.0, 3000.0), np.zeros(5))
    assert np.array_equal(dahl_batch(np.ones(5), 20.0, 3000.0, start=-1.0), np.full(5, -20.0))


@pytest.mark.parametrize(
    ("position", "limit"), [(np.ones((2, 2)), 1.0), (np.ones(3), np.ones(4)), (1.0, 1.0)]
)
def test_shapes_that_do_not_fit_are_refused(position: object, limit: object) -> None:
    with pytest.raises(UsageError, match="shape"):
        dahl_batch(position, limit, 1.0)  # type: ignore[arg-type]
