"""Scores of candidates: explained sum of squares with BIC penalty, and its null distribution.

A candidate's score is the χ² that its signature would explain beside the present model, linearised,
minus ln n per parameter. The null distribution of the largest score of all candidates is simulated
with the estimated noise variance, whose own uncertainty is drawn from a scaled inverse χ²
distribution. Only inner products are needed.

References
----------
Schwarz, G. (1978). Estimating the dimension of a model. Ann. Stat. 6, 461-464.
Westfall, P. H., Young, S. S. (1993). Resampling-Based Multiple Testing (maximum statistic). Wiley.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.noise import BandNoise, satterthwaite_dof
from winchkit.diagnosis.regression.projection import inverse_information
from winchkit.diagnosis.selection.signatures import EffectShape, Signatures

_NOTHING = 1e-300
"""Floor of a squared length that is divided by; numerical."""
_SIMULATIONS = 400
"""Draws of the null distribution of the maximum; computing cost; the 99 % quantile of 400 draws has
a level of 1 % ± 0.5 %."""
_WELL_KNOWN = 100.0
"""Degrees of freedom from which a band's variance is taken as known; theory: its standard deviation
is below 14 % there, √(2/ν)."""
_LEVEL = 0.01
"""Level of a candidate's own quantile, over all candidates; convention: that of the largest
score."""
_MOST_DOF = 1e6
"""Degrees of freedom from which F is χ²; numerical."""
_UNIDENTIFIABLE = 1e-7
"""Squared length left of a unit column below which a direction is not identifiable; numerical."""
_ROUNDING = 1e-18
"""χ² of a signature below which it is rounding; numerical: 1e-16 of a signal of 1e4 times its
noise, over 1e6 samples. A usual size of a motor is a small one of a heavy, slow axis."""


@dataclass(frozen=True)
class Score:
    """Score of a candidate at one point of its shape grid; ``explained_ss`` is Δχ², linearised, and
    ``net_gain`` is less ln n per parameter.

    The amplitudes are in usual-size steps; ``noncentrality`` λ is that of one usual size, the
    squared length of its whitened, projected signature. Noise alone exceeds ``by_chance`` for any
    candidate in at most 1 % of cases, by the degrees of freedom of the noise where this one acts.
    """

    candidate: EffectShape
    explained_ss: float
    net_gain: float
    amplitudes: Array
    noncentrality: float
    by_chance: float = np.inf

    def is_significant(self, threshold: float) -> bool:
        """Whether it exceeds what noise gives it, or the threshold of the largest of all scores."""
        return self.net_gain > min(threshold, self.by_chance)


class Projected:
    """Signatures whitened under one noise variance, the unknowns of the present model partialled
    out; ``inner`` (p, p) are their inner products.
    """

    def __init__(
        self, regression: Regression, signatures: Signatures, jacobian: Array, noise: BandNoise
    ) -> None:
        self.signatures = signatures
        self._jacobian = jacobian
        self._inverse_variance = noise.inverse_sigma(regression) ** 2
        self._dof = noise.dof
        self._regression = regression
        self._cross, self._normal = _cross(regression, jacobian, signatures)
        self._share = share = 1 / noise.power
        cross, normal, gram = (
            np.tensordot(share, part, axes=1)
            for part in (self._cross, self._normal, signatures.gram)
        )
        self._through = -inverse_information(normal) @ cross
        self.inner = _projected(gram, cross, normal, self._through)
        """Inner products of the whitened, projected columns, (p, p)."""
        plain = np.einsum("b,bii->i", share, signatures.gram)
        self._dof_of_column = self._degrees_of_freedom()
        self._roots = [self._root(candidate, plain) for candidate in signatures.candidates]

    def products(self, residual: Array) -> Array:
        """Inner products of the whitened residual with the projected columns, shape (p,)."""
        weighted = residual * self._inverse_variance
        own = self.signatures.products(self._regression, weighted)
        return np.asarray(own + self._through.T @ (self._jacobian.T @ weighted))

    def explained_ss(self, products: Array) -> Array:
        """Explained sum of squares of each candidate; products (p,) or (p, n_samples)."""
        return np.array(
            [
                np.sum((root.T @ products[candidate.columns]) ** 2, axis=0)
                for candidate, root in zip(self.signatures.candidates, self._roots, strict=True)
            ]
        )

    def amplitudes(self, index: int, products: Array) -> Array:
        """Best amplitudes of one candidate, in usual-size steps."""
        root = self._roots[index]
        candidate = self.signatures.candidates[index]
        return np.asarray(root @ (root.T @ products[candidate.columns]))

    def noncentrality(self, index: int) -> float:
        """λ of one usual size of a candidate; zero where it is not identifiable."""
        first = self.signatures.candidates[index].columns.start
        return float(self.inner[first, first]) if self._roots[index].shape[1] else 0.0

    def degrees_of_freedom(self, index: int) -> float:
        """Degrees of freedom of the noise variance in a candidate's score."""
        candidate = self.signatures.candidates[index]
        return float(np.min(self._dof_of_column[candidate.columns]))

    def _degrees_of_freedom(self) -> Array:
        """Satterthwaite's degrees of freedom of the variance of every column's amplitude, (p,),
        whose parts are the column's information in the bands.
        """
        own = np.einsum("bii->bi", self.signatures.gram)
        mixed = np.einsum("bqi,qi->bi", self._cross, self._through)
        there = np.einsum(
            "qi,bqr,ri->bi", self._through, self._normal, self._through, optimize=True
        )
        parts = np.maximum(self._share[:, None] * (own + 2 * mixed + there), 0.0)
        return satterthwaite_dof(parts, self._dof[:, None])

    def simulated(self, samples: int = _SIMULATIONS) -> Array:
        """Products that noise alone gives, its variance drawn too; shape (p, n_samples)."""
        random = np.random.default_rng(0)
        out, q = np.zeros((len(self.inner), samples)), len(self._through)
        for output, bands, dof in self._groups():
            own = self.signatures.reached[output]
            gram, cross, normal = (
                np.tensordot(self._share[bands], part, axes=1)
                for part in (
                    self.signatures.gram[bands][:, own[:, None], own],
                    self._cross[bands][:, :, own],
                    self._normal[bands],
                )
            )
            # No Cholesky factor: columns that the model explains are zero up to rounding.
            values, vectors = np.linalg.eigh(np.block([[normal, cross], [cross.T, gram]]))
            factor = np.sqrt(dof / random.chisquare(dof, samples)) if dof < _WELL_KNOWN else 1.0
            noise = random.standard_normal((len(values), samples)) * factor
            # Symmetric root: the draws do not depend on the signs of the eigenvectors.
            drawn = (vectors * np.sqrt(np.maximum(values, 0.0))) @ (vectors.T @ noise)
            out[own] += drawn[q:]
            out += self._through.T @ drawn[:q]
        return out

    def _groups(self) -> Iterator[tuple[str, NDArray[np.intp], float]]:
        """Output, bands and degrees of freedom of noise that is drawn together: bands whose
        variance is well known; each other band is drawn by itself.
        """
        outputs = np.array([output for output, _, _ in self._regression.bands])
        for output in self._regression.outputs:
            own = np.flatnonzero(outputs == output)
            known = self._dof[own] >= _WELL_KNOWN
            if known.any():
                yield output, own[known], np.inf
            for band in own[~known]:
                yield output, np.array([band]), float(self._dof[band])

    def _root(self, candidate: EffectShape, plain: Array) -> Array:
        """R with R Rᵀ the inverse of a candidate's inner products, as far as identifiable."""
        inner = self.inner[candidate.columns, candidate.columns]
        if np.max(plain[candidate.columns]) < _ROUNDING:
            # A signature below rounding errors would give scores of any size.
            return np.zeros((len(inner), 0))
        size = np.sqrt(np.maximum(plain[candidate.columns], _NOTHING))
        values, vectors = np.linalg.eigh(inner / np.outer(size, size))
        kept = values > _UNIDENTIFIABLE
        return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / size[:, None])


def score_by_chance(penalty: float, columns: int, dof: float, candidates: int) -> float:
    """Score that noise alone exceeds for one of all candidates in at most 1 % of cases: k F(k, ν)
    at 1 % over their number (Bonferroni, all grid points), less the penalty; at least zero.
    """
    columns = max(1, columns)
    quantile = columns * float(fdtri(columns, min(dof, _MOST_DOF), 1 - _LEVEL / max(1, candidates)))
    return max(0.0, quantile - penalty)


def _projected(gram: Array, cross: Array, normal: Array, through: Array) -> Array:
    """Inner products of columns after partialling out by ``through``, shape (p, p)."""
    mixed = cross.T @ through
    return np.asarray(gram + mixed + mixed.T + through.T @ normal @ through)


def _cross(regression: Regression, jacobian: Array, signatures: Signatures) -> tuple[Array, Array]:
    """Inner products of unknowns with columns and among unknowns, per band."""
    count, q = len(regression.bands), jacobian.shape[1]
    cross, normal = np.zeros((count, q, signatures.count)), np.zeros((count, q, q))
    for band, rows in regression.rows_by_band() if q else ():
        output = regression.bands[band][0]
        columns = signatures.rows_of(output, rows)
        cross[band][:, signatures.reached[output]] += jacobian[rows].T @ columns.T
        normal[band] += jacobian[rows].T @ jacobian[rows]
    return cross, normal


def score(projected: Projected, residual: Array, rows: int) -> list[Score]:
    """Scores of all candidates, best first; ``rows`` is the sample size n of the BIC penalty."""
    products = projected.products(residual)
    out = []
    for index, explained_ss in enumerate(projected.explained_ss(products).tolist()):
        candidate = projected.signatures.candidates[index]
        net_gain = explained_ss - candidate.n_parameters * float(np.log(rows))
        by_chance = score_by_chance(
            explained_ss - net_gain,
            candidate.columns.stop - candidate.columns.start,
            projected.degrees_of_freedom(index),
            len(projected.signatures.candidates),
        )
        out.append(
            Score(
                candidate,
                explained_ss,
                net_gain,
                projected.amplitudes(index, products),
                projected.noncentrality(index),
                by_chance,
            )
        )
    return sorted(out, key=lambda s: -s.net_gain)


def zero_score(item: Score, rows: int) -> Score:
    """Score of a candidate that explains nothing."""
    net_gain = -item.candidate.n_parameters * float(np.log(rows))
    return replace(
        item, explained_ss=0.0, net_gain=net_gain, amplitudes=np.zeros_like(item.amplitudes)
    )


def null_maxima(projected: Projected, rows: int) -> Array:
    """Simulated null distribution of the largest score of all candidates, sorted, (400,)."""
    candidates = projected.signatures.candidates
    if not candidates:
        return np.zeros(1)
    penalty_per_parameter = np.array(
        [candidate.n_parameters * np.log(rows) for candidate in candidates]
    )
    explained_ss = projected.explained_ss(projected.simulated())
    return np.asarray(np.sort((explained_ss - penalty_per_parameter[:, None]).max(axis=0)))
