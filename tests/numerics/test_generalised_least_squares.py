"""Generalised least squares against its closed form (Aitken 1935), and projections against QR."""

from __future__ import annotations

import numpy as np
import pytest

from strd import Dataset, regression_of, start_of
from winchkit.arrays import Array
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.projection import explained_ss, explained_ss_of_sets, orthonormal

ROWS, UNKNOWNS = 400, 5


def drawn(seed: int) -> tuple[Array, Array, Array]:
    """Columns, measurements and 1/σ of every row; σ over three decades."""
    random = np.random.default_rng(seed)
    columns = random.standard_normal((ROWS, UNKNOWNS)) * 10.0 ** np.arange(UNKNOWNS)
    sigma = 10 ** random.uniform(-2, 1, ROWS)
    truth = random.standard_normal(UNKNOWNS) / 10.0 ** np.arange(UNKNOWNS)
    return columns, columns @ truth + sigma * random.standard_normal(ROWS), 1 / sigma


def closed_form(columns: Array, values: Array, weight: Array) -> Array:
    """(XᵀΣ⁻¹X)⁻¹XᵀΣ⁻¹y."""
    precision = np.diag(weight**2)
    normal = columns.T @ precision @ columns
    return np.asarray(np.linalg.solve(normal, columns.T @ precision @ values))


@pytest.mark.parametrize("seed", range(5))
def test_a_linear_fit_is_the_closed_form(seed: int) -> None:
    columns, values, weight = drawn(seed)
    data = Dataset("drawn", columns, values, lambda x, b: x @ b, (0.0,) * UNKNOWNS, 1.0)
    # 0.02 of χ² is the tolerance: a sharper weight makes it negligible and changes no estimate.
    found = fit(regression_of(data), start_of((0.0,) * UNKNOWNS), 1e6 * weight, 50)
    np.testing.assert_allclose(found.vector, closed_form(columns, values, weight), rtol=1e-9)
    left = (values - columns @ found.vector) * 1e6 * weight
    assert found.chi_square == pytest.approx(float(left @ left), rel=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_linear_fit_of_unit_variance_is_within_the_tolerance_of_the_closed_form(
    seed: int,
) -> None:
    columns, values, weight = drawn(seed)
    data = Dataset("drawn", columns, values, lambda x, b: x @ b, (0.0,) * UNKNOWNS, 1.0)
    found = fit(regression_of(data), start_of((0.0,) * UNKNOWNS), weight)
    best = values - columns @ closed_form(columns, values, weight)
    assert 0 <= found.chi_square - float(np.sum((best * weight) ** 2)) < 0.02


def test_a_bound_is_kept_and_the_other_unknowns_are_the_best_beside_it() -> None:
    columns, values, weight = drawn(7)
    free = closed_form(columns, values, weight)
    problem = regression_of(
        Dataset("drawn", columns, values, lambda x, b: x @ b, (0.0,) * UNKNOWNS, 1.0)
    )
    low, high = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
    low[2] = free[2] + 1.0
    problem.bounds = lambda like: (low, high)  # type: ignore[method-assign]
    start = np.zeros(UNKNOWNS)
    start[2] = low[2]
    found = fit(problem, start_of(tuple(start.tolist())), 1e6 * weight, 50)
    others = [0, 1, 3, 4]
    beside = closed_form(columns[:, others], values - columns[:, 2] * low[2], weight)
    assert found.vector[2] == low[2]
    np.testing.assert_allclose(found.vector[others], beside, rtol=1e-9)


def test_a_basis_spans_what_its_columns_span() -> None:
    columns, values, _ = drawn(3)
    basis = orthonormal(np.column_stack([columns, columns[:, 0] - columns[:, 1]]))
    assert basis.shape == (ROWS, UNKNOWNS)
    np.testing.assert_allclose(basis.T @ basis, np.eye(UNKNOWNS), atol=1e-8)
    q, _ = np.linalg.qr(columns)
    np.testing.assert_allclose(basis @ (basis.T @ values), q @ (q.T @ values), rtol=1e-6, atol=1e-6)


def test_explained_squares_are_those_of_a_regression() -> None:
    columns, values, _ = drawn(5)
    scaled = columns / np.linalg.norm(columns, axis=0)
    left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    explained = float(values @ values - left @ left)
    inner, products = scaled.T @ scaled, scaled.T @ values
    assert explained_ss(inner, products, 1e-7) == pytest.approx(explained, rel=1e-9)
    np.testing.assert_allclose(
        explained_ss_of_sets(inner[None], products[None], 1e-7), [explained], rtol=1e-9
    )
