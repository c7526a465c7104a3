"""Null distribution of the specification test: gain of the best curve where the names are right.

Parametric bootstrap in the linearised model: data are the named effects at their fitted values plus
noise, whose variance is drawn per band from its own uncertainty (ν/χ²(ν)). In every draw all
curves and the named effects are fitted to the same noise, and the largest net gain of a curve over
the names is kept. Few degrees of freedom of the lowest bands, in which slow curves have their
power, make its upper tail heavy.

References
----------
Cox, D. R. (1962). Further results on tests of separate families of hypotheses. J. R. Statist. Soc.
B 24, 406-424.
Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap. Chapman & Hall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Segment
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.projection import orthonormal_of_projected
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.verdict.curve_fits import UNIDENTIFIABLE, BasisProducts, PartialRegression
from winchkit.diagnosis.verdict.spline_alternatives import CurveFamily

__all__ = ["Named", "null_excess"]

_DRAWS = 2000
_WELL_KNOWN = 100.0
"""Degrees of freedom from which a band's variance is taken as known."""


@dataclass(frozen=True)
class Named:
    """Named effects beside which curves are compared."""

    change: Array
    """Their change of the outputs, whitened and projected, (rows,)."""
    columns: Array
    """Derivatives by their unknowns, whitened to unit length, then projected, (rows, k)."""
    n_parameters: int
    whole: Array
    """Change of the outputs by all effects of the model, SI, (rows,): rounded with them."""


def null_excess(
    regression: TimeSeriesRegression,
    noise: Noise,
    partial: PartialRegression,
    named: Named,
    families: Sequence[CurveFamily],
) -> Array:
    """Largest net gain of a curve less that of the named effects, where these are right.

    Parameters
    ----------
    regression, noise
        Data, and the variance of the noise with its degrees of freedom.
    partial
        Residual without the named effects; its projection is used.
    named
        The named effects.
    families
        Curves; each of their parameters has the penalty ln n.

    Returns
    -------
    ndarray of shape (2000,)
        Draws, sorted.
    """
    penalty_per_parameter = float(np.log(regression.n_observations))
    design = _Design(regression, partial, named, families)
    products = design.noise_products(noise)
    refitted = np.sum(products[1 : design.n_own] ** 2, axis=0)
    size = float(named.change @ named.change)
    effects = size + 2 * products[0] + refitted - named.n_parameters * penalty_per_parameter
    best = np.full(_DRAWS, -np.inf)
    for family, grams, rows in design.families():
        drawn = products[rows] + design.change_products[rows][:, None]
        for coefficients, n_parameters in family.laws:
            gain = np.sum((grams.root(coefficients).T @ drawn) ** 2, axis=0)
            best = np.maximum(best, gain - penalty_per_parameter * n_parameters)
    return np.asarray(np.sort(best - effects))


class _Design:
    """Whitened, projected columns: the named effects' change and unknowns, and basis functions."""

    def __init__(
        self,
        regression: TimeSeriesRegression,
        partial: PartialRegression,
        named: Named,
        families: Sequence[CurveFamily],
    ) -> None:
        self._regression, self._partial, self._families = regression, partial, families
        self._whole = named.whole
        self._own = np.column_stack(
            [named.change, orthonormal_of_projected(named.columns, UNIDENTIFIABLE)]
        )
        self.n_own = self._own.shape[1]
        counts = [len(family.knots) for family in families]
        self._ends = self.n_own + np.cumsum([0, *counts])
        n_columns = int(self._ends[-1])
        self._through = np.zeros((partial.explained.shape[1], n_columns))
        self._before = np.zeros((n_columns, n_columns))
        for segment in regression.segments:
            columns = self._columns(segment)
            self._through += partial.explained[segment.rows].T @ columns
            self._before += columns.T @ columns
        self._after = self._before - self._through.T @ self._through
        self.change_products = self._after[0]

    def families(self) -> list[tuple[CurveFamily, BasisProducts, slice]]:
        """Every family with its Gram matrices and its place among the columns."""
        out = []
        for index, family in enumerate(self._families):
            own = slice(int(self._ends[index]), int(self._ends[index + 1]))
            out.append((family, BasisProducts(self._before[own, own], self._after[own, own]), own))
        return out

    def noise_products(self, noise: Noise) -> Array:
        """Inner products of drawn noise with the columns, (columns, draws).

        Bands of few degrees of freedom have few rows, which are drawn one by one; the sum over all
        other bands is drawn by its covariance.
        """
        random = np.random.default_rng(0)
        n_columns = len(self._after)
        uncertain = np.flatnonzero(noise.dof < _WELL_KNOWN)
        factor = {
            int(band): np.sqrt(noise.dof[band] / random.chisquare(noise.dof[band], _DRAWS))
            for band in uncertain
        }
        out, known = np.zeros((n_columns, _DRAWS)), np.zeros((n_columns, n_columns))
        rounding: dict[str, Array] = {}
        rows_of = {s.rows.start: s for s in self._regression.segments}
        segment, columns = self._regression.segments[0], np.zeros((0, n_columns))
        for band, rows in self._regression.rows_by_band():
            if rows.start in rows_of:
                segment = rows_of[rows.start]
                columns = self._columns(segment)
                columns -= self._partial.explained[segment.rows] @ self._through
                self._add_rounding(rounding, segment, columns)
            own = columns[rows.start - segment.rows.start : rows.stop - segment.rows.start]
            if band in factor:
                drawn = random.standard_normal((len(own), _DRAWS)) * factor[band]
                out += own.T @ drawn
            else:
                known += own.T @ own
        values, vectors = np.linalg.eigh(known)
        # Symmetric root: the draws do not depend on the signs of the eigenvectors.
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        out += root @ random.standard_normal((n_columns, _DRAWS))
        for products in rounding.values():
            zero = 2 * np.pi * random.random(_DRAWS)
            turned = np.outer(np.arange(1, products.shape[1] // 2 + 1), zero)
            out += products @ np.concatenate([np.sin(turned), np.cos(turned)])
        return np.asarray(out)

    def _add_rounding(self, products: dict[str, Array], segment: Segment, columns: Array) -> None:
        """Add a segment's inner products of columns and mean rounding errors by instrument."""
        for error in self._regression.rounding_errors(segment, self._whole):
            components = error.components * self._partial.inverse_sigma[segment.rows]
            own = columns.T @ components.T
            products[error.instrument] = products.get(error.instrument, 0.0) + own

    def _columns(self, segment: Segment) -> Array:
        """Whitened columns of one segment, (rows, columns)."""
        rows = segment.rows
        out = np.zeros((rows.stop - rows.start, int(self._ends[-1])))
        out[:, : self.n_own] = self._own[rows]
        for index, family in enumerate(self._families):
            own = family.columns_in(self._regression, segment)
            if own is not None:
                at = slice(int(self._ends[index]), int(self._ends[index + 1]))
                out[:, at] = (own * self._partial.inverse_sigma[rows]).T
        return out
