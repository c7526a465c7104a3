"""The fit against certified values of the Statistical Reference Datasets of NIST.

The fit stops where a step promises a decrease of χ² below 0.02. So the weights, equal for all rows,
are 10⁶ over the certified residual deviation: 0.02 is then far below the sixth digit. What the
fit reaches with residuals of unit variance, as in a diagnosis, is tested by itself.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from operator import mul

import numpy as np
import pytest

from strd import LINEAR, NONLINEAR, Dataset, digits, regression_of, start_of
from winchkit.diagnosis.regression.gls import Fit, fit

CERTIFIED = 6
STEPS = 5000
SHARP = 1e6
_ILL = "a scaled condition number above 3·10⁴: the normal equations are truncated at 10⁻⁹"
_FAR = "no minimum from this start within the steps"
FAR_FAILS = ("MGH09", "Eckerle4", "BoxBOD", "MGH10")
SLOW = ("MGH10",)
"""From the near start it takes more than 500 steps; a diagnosis takes 15."""


def sets(failing: tuple[str, ...]) -> list[object]:
    """All nonlinear sets; those that fail are expected to."""
    fails = pytest.mark.xfail(reason=_FAR, strict=True)
    return [pytest.param(n, marks=[fails] if n in failing else []) for n in NONLINEAR]


def fitted(
    data: Dataset, start: tuple[float, ...], scale: float = SHARP, steps: int | None = STEPS
) -> Fit:
    weight = np.full(len(data.y), scale / data.deviation)
    return fit(regression_of(data), start_of(start), weight, steps)


def zeros(data: Dataset) -> tuple[float, ...]:
    return (0.0,) * len(data.certified)


def squares(found: Fit) -> float:
    return float(found.residual @ found.residual)


def exact_solution(x: list[list[Fraction]], y: list[Fraction]) -> list[Fraction]:
    """Least squares by Gauss-Jordan elimination of the normal equations, without rounding."""
    columns = list(zip(*x, strict=True))
    rows = [
        [*(sum(map(mul, a, b)) for b in columns), sum(map(mul, a, y))]  # type: ignore[list-item]
        for a in columns
    ]
    for k in range(len(rows)):
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for j in range(len(rows)):
            if j != k:
                rows[j] = [a - rows[j][k] * b for a, b in zip(rows[j], rows[k], strict=True)]
    return [row[-1] for row in rows]


@pytest.mark.parametrize("name", LINEAR)
def test_certified_values_follow_from_the_data_in_exact_arithmetic(name: str) -> None:
    """Data and certified values were typed correctly: they agree in all digits that NIST gives."""
    data = LINEAR[name]
    if name == "Longley":
        x = [[Fraction(repr(value)) for value in row] for row in data.x.tolist()]
    else:
        order = data.x.shape[1]
        x = [[Fraction(repr(row[1])) ** k for k in range(order)] for row in data.x.tolist()]
    found = exact_solution(x, [Fraction(repr(value)) for value in data.y.tolist()])
    assert [float(value) for value in found] == pytest.approx(data.certified, rel=1e-13)


@pytest.mark.parametrize(
    "name",
    [
        "Norris",
        "Wampler1",
        pytest.param("Longley", marks=pytest.mark.xfail(reason=_ILL, strict=True)),
        pytest.param("Filip", marks=pytest.mark.xfail(reason=_ILL, strict=True)),
    ],
)
def test_linear_regressions_reach_six_certified_digits(name: str) -> None:
    data = LINEAR[name]
    assert digits(fitted(data, zeros(data)).vector, data.certified) >= CERTIFIED


def test_longley_about_its_means_reaches_six_certified_digits() -> None:
    data = LINEAR["Longley"]
    middle = data.x[:, 1:].mean(axis=0)
    centred = replace(data, x=np.column_stack([data.x[:, 0], data.x[:, 1:] - middle]))
    found = fitted(centred, zeros(data))
    slopes = found.vector[1:]
    intercept = found.vector[0] - slopes @ middle
    assert digits(np.array([intercept, *slopes]), data.certified) >= CERTIFIED
    assert squares(found) == pytest.approx(data.squares, rel=10**-CERTIFIED)


def test_filip_in_orthogonal_polynomials_reaches_six_digits_of_the_residual_squares() -> None:
    data = LINEAR["Filip"]
    x = data.x[:, 1]
    z = 2 * (x - x.min()) / np.ptp(x) - 1
    found = fitted(replace(data, x=np.polynomial.chebyshev.chebvander(z, 10)), zeros(data))
    assert squares(found) == pytest.approx(data.squares, rel=10**-CERTIFIED)


@pytest.mark.parametrize("name", NONLINEAR)
def test_nonlinear_regressions_reach_six_certified_digits_from_the_near_start(name: str) -> None:
    data = NONLINEAR[name]
    found = fitted(data, data.starts[1])
    assert digits(found.vector, data.certified) >= CERTIFIED
    assert squares(found) == pytest.approx(data.squares, rel=1e-9)


@pytest.mark.parametrize("name", sets(FAR_FAILS))
def test_nonlinear_regressions_reach_six_certified_digits_from_the_far_start(name: str) -> None:
    data = NONLINEAR[name]
    assert digits(fitted(data, data.starts[0]).vector, data.certified) >= CERTIFIED


@pytest.mark.parametrize("name", NONLINEAR)
def test_a_fit_that_misses_the_minimum_has_not_converged(name: str) -> None:
    """From the far start, with the steps of a diagnosis and with many."""
    data = NONLINEAR[name]
    for steps in (None, STEPS):
        found = fitted(data, data.starts[0], steps=steps)
        right = digits(found.vector, data.certified) >= CERTIFIED
        assert right or not found.converged or found.rank < len(found.vector)
        assert not right or steps is None or found.converged


@pytest.mark.parametrize("name", sets(SLOW))
def test_residuals_of_unit_variance_are_fitted_to_the_tolerance_of_chi_square(name: str) -> None:
    """As in a diagnosis: the usual number of steps, and 0.02 of χ² to spare."""
    data = NONLINEAR[name]
    found = fitted(data, data.starts[1], scale=1.0, steps=None)
    free = len(data.y) - len(data.certified)
    assert found.chi_square == pytest.approx(free, abs=0.02)
