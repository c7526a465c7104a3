"""Inverse of normal matrices."""

import numpy as np
import pytest

from winchkit.diagnosis.regression.projection import inverse_normal

RANDOM = np.random.default_rng(1)
COLUMNS = RANDOM.standard_normal((50, 3)) @ np.array([[1.0, 0.4, 0.0], [0.0, 1.0, 0.3], [0, 0, 1]])


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_an_inverse_has_the_units_of_its_columns(unit: float) -> None:
    """An unknown with a variance of 10¹⁸ times that of the others keeps it."""
    size = np.array([1.0, unit, 1.0])
    expected = np.linalg.inv(COLUMNS.T @ COLUMNS) / np.outer(size, size)
    np.testing.assert_allclose(inverse_normal(COLUMNS * size), expected, rtol=1e-9)


def test_columns_of_zeros_have_no_variance() -> None:
    with_zeros = np.column_stack([COLUMNS, np.zeros(50)])
    found = inverse_normal(with_zeros)
    np.testing.assert_allclose(found[:3, :3], inverse_normal(COLUMNS))
    assert not found[3].any()
    assert not found[:, 3].any()


def test_equal_columns_share_what_they_determine() -> None:
    """The generalised inverse of least norm: half of the sum for each."""
    one = COLUMNS[:, :1]
    found = inverse_normal(np.hstack([one, one]))
    np.testing.assert_allclose(found, np.full((2, 2), 0.25 / np.sum(one**2)))
