"""Linear fits of free curves to a residual with the fitted unknowns projected out."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.verdict.spline_alternatives import Columns, CurveFamily, curves

UNIDENTIFIABLE = 1e-7
"""Squared length left of a unit column below which a direction is not identifiable; numerical."""
_LEAST_SQUARED_LENGTH = 1e-300
"""Squared length below which a curve changes nothing; numerical."""


@dataclass(frozen=True)
class FittedCurve:
    """A curve over one variable and the net decrease of χ² by it."""

    place: str
    """Output that it is added to, or ``cable_force`` or ``winding``, which act on several."""
    variable: str
    net_gain: float
    """Decrease of χ² less the penalty of its parameters."""
    explained_ss: float
    """Decrease of χ²."""
    law: Array = field(repr=False, compare=False)
    """Values at the knots of its basis, shape (knots, k)."""

    @property
    def words(self) -> str:
        """Its variable in words."""
        return self.variable.replace("_", " ")


class PartialRegression:
    """Whitened residual with the fitted unknowns projected out, to which curves are fitted."""

    def __init__(self, residual: Array, jacobian: Array, inverse_sigma: Array) -> None:
        """Whiten ``residual`` (rows,) and project out the columns of ``jacobian`` (rows, k)."""
        self.inverse_sigma = inverse_sigma
        self.explained = orthonormal(jacobian * inverse_sigma[:, None])
        self.residual = self.projected(residual)

    def projected(self, vector: Array) -> Array:
        """A vector (rows,), whitened, with the fitted unknowns projected out."""
        whitened = vector * self.inverse_sigma
        return np.asarray(whitened - self.explained @ (self.explained.T @ whitened))

    @property
    def chi_square(self) -> float:
        """χ² that is left."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True)
class BasisProducts:
    """Gram matrices of whitened basis functions, before and after projection."""

    before: Array
    """Before projection, (knots, knots)."""
    after: Array
    """After projection, (knots, knots)."""

    def root(self, coefficients: Array) -> Array:
        """R (knots, rank): curves of ``coefficients`` (knots, k) decrease χ² by |Rᵀp|².

        p are the inner products of the projected basis functions with the residual. Directions that
        the fit explains leave only rounding and are left out.
        """
        length = np.diag(coefficients.T @ self.before @ coefficients)
        # A curve that changes nothing has no direction.
        size = np.sqrt(np.where(length > _LEAST_SQUARED_LENGTH, length, np.inf))
        after = coefficients.T @ self.after @ coefficients / np.outer(size, size)
        values, vectors = np.linalg.eigh(after)
        kept = values > UNIDENTIFIABLE
        return np.asarray((coefficients / size) @ (vectors[:, kept] / np.sqrt(values[kept])))

    def explained_ss(self, coefficients: Array, products: Array) -> float:
        """Decrease of χ² by the curves of ``coefficients`` (knots, k), given p (knots,)."""
        return float(np.sum((self.root(coefficients).T @ products) ** 2))


def basis_products(
    partial: PartialRegression, columns: Columns, count: int
) -> tuple[BasisProducts, Array]:
    """Gram matrices of ``count`` basis functions, and their products with the residual."""
    before, products = np.zeros((count, count)), np.zeros(count)
    explained_products = np.zeros((count, partial.explained.shape[1]))
    for rows, signal in columns:
        whitened = signal * partial.inverse_sigma[rows]
        before += whitened @ whitened.T
        explained_products += whitened @ partial.explained[rows]
        products += whitened @ partial.residual[rows]
    after = before - explained_products @ explained_products.T
    return BasisProducts(before, after), products


def ranked_curves(
    regression: TimeSeriesRegression,
    partial: PartialRegression,
    outputs: Sequence[str],
    penalty_per_parameter: float,
    only: Container[tuple[str, str]] | None = None,
) -> list[FittedCurve]:
    """Best curve of every place and variable (of those in ``only``), that of the largest net
    decrease of χ² first.
    """
    families = curves(regression, outputs, only)
    found = _fitted(regression, partial, families, penalty_per_parameter)
    return sorted(found, key=lambda curve: -curve.net_gain)


def _fitted(
    regression: TimeSeriesRegression,
    partial: PartialRegression,
    families: Iterator[CurveFamily],
    penalty_per_parameter: float,
) -> Iterator[FittedCurve]:
    for family in families:
        columns = family.columns(regression)
        grams, products = basis_products(partial, columns, len(family.knots))
        fitted = [
            (grams.explained_ss(coefficients, products), n_parameters, coefficients)
            for coefficients, n_parameters in family.laws
        ]
        gain, count, law = max(fitted, key=lambda fit: fit[0] - penalty_per_parameter * fit[1])
        net_gain = gain - penalty_per_parameter * count
        yield FittedCurve(family.place, family.variable, net_gain, gain, law)
