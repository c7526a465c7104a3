"""How well the residual fits every candidate's signature, and how well noise alone would.

Only inner products are needed, so that scoring again with another noise, or simulating what noise
alone would score, costs next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.selection.signatures import Candidate, Signatures, pieces

__all__ = ["Projected", "Score", "null_maxima", "score", "zero_score"]

_NOTHING = 1e-300
_SIMULATIONS = 400
_UNIDENTIFIABLE = 1e-7
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Score:
    """How much of the residual's whitened squares an atom would take, and its chance level."""

    candidate: Candidate
    explained_ss: float
    net_gain: float
    """Gain less the price of its degrees of freedom."""
    amplitudes: Array
    """In units of the secants."""
    noncentrality: float
    """λ for one usual size: noncentrality of its whitened, projected signature."""


class Projected:
    """Signatures with the present model's unknowns projected out, under one noise."""

    def __init__(
        self, regression: Regression, signatures: Signatures, jacobian: Array, noise: Noise
    ) -> None:
        self.signatures = signatures
        self._jacobian = jacobian
        self._inverse_variance = noise.inverse_sigma(regression) ** 2
        self._dof = noise.dof
        self._cross, self._normal = _cross(regression, jacobian, signatures.columns)
        self._share = share = 1 / noise.power
        cross, normal, gram = (
            np.tensordot(share, part, axes=1)
            for part in (self._cross, self._normal, signatures.gram)
        )
        self._through = -np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ cross
        self.inner = _projected(gram, cross, normal, self._through)
        """Inner products of the whitened, projected columns, (p, p)."""
        plain = np.einsum("b,bii->i", share, signatures.gram)
        self._roots = [self._root(candidate, plain) for candidate in signatures.candidates]

    def products(self, residual: Array) -> Array:
        """Inner products of the whitened residual with the projected columns, (p,)."""
        weighted = residual * self._inverse_variance
        own = self.signatures.columns.T @ weighted
        return np.asarray(own + self._through.T @ (self._jacobian.T @ weighted))

    def explained_ss(self, products: Array) -> Array:
        """Whitened squares that each atom takes; products (p,) or (p, samples)."""
        return np.array(
            [
                np.sum((root.T @ products[candidate.columns]) ** 2, axis=0)
                for candidate, root in zip(self.signatures.candidates, self._roots, strict=True)
            ]
        )

    def amplitudes(self, index: int, products: Array) -> Array:
        """Amplitudes of one atom in units of its secants."""
        root = self._roots[index]
        candidate = self.signatures.candidates[index]
        return np.asarray(root @ (root.T @ products[candidate.columns]))

    def noncentrality(self, index: int) -> float:
        """λ for one usual size of an atom; zero where it cannot be identified."""
        first = self.signatures.candidates[index].columns.start
        return float(self.inner[first, first]) if self._roots[index].shape[1] else 0.0

    def simulated(self, samples: int = _SIMULATIONS) -> Array:
        """Products that noise alone would give, its power known only so well; (p, samples)."""
        random = np.random.default_rng(0)
        out = np.zeros((len(self.inner), samples))
        bands = zip(
            self._share, self.signatures.gram, self._cross, self._normal, self._dof, strict=True
        )
        for share, gram, cross, normal, n_parameters in bands:
            part = share * _projected(gram, cross, normal, self._through)
            # No Cholesky factor: what the present model explains whole is left with rounding only.
            values, vectors = np.linalg.eigh(part)
            factor = np.sqrt(n_parameters / random.chisquare(n_parameters, samples))
            noise = random.standard_normal((len(part), samples)) * factor
            # The symmetric root: the same draws whichever way rounding turns the vectors.
            out += (vectors * np.sqrt(np.maximum(values, 0.0))) @ (vectors.T @ noise)
        return out

    def _root(self, candidate: Candidate, plain: Array) -> Array:
        """R with R Rᵀ the inverse of an atom's inner products, where they can be identified."""
        inner = self.inner[candidate.columns, candidate.columns]
        if np.max(plain[candidate.columns]) < _ROUNDING:
            # What a usual size moves by less than rounding would let chance reach any level.
            return np.zeros((len(inner), 0))
        size = np.sqrt(np.maximum(plain[candidate.columns], _NOTHING))
        values, vectors = np.linalg.eigh(inner / np.outer(size, size))
        kept = values > _UNIDENTIFIABLE
        return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / size[:, None])


def _projected(gram: Array, cross: Array, normal: Array, through: Array) -> Array:
    """Inner products of columns from which unknowns were taken out by ``through``, (p, p)."""
    mixed = cross.T @ through
    return np.asarray(gram + mixed + mixed.T + through.T @ normal @ through)


def _cross(regression: Regression, jacobian: Array, columns: Array) -> tuple[Array, Array]:
    """Per band: inner products of unknowns with columns, and among unknowns."""
    count, q = len(regression.bands), jacobian.shape[1]
    cross, normal = np.zeros((count, q, columns.shape[1])), np.zeros((count, q, q))
    for band, rows in pieces(regression):
        cross[band] += jacobian[rows].T @ columns[rows]
        normal[band] += jacobian[rows].T @ jacobian[rows]
    return cross, normal


def score(projected: Projected, residual: Array, rows: int) -> list[Score]:
    """Scores of all atoms, best first: gain less (degrees of freedom) · ln(rows)."""
    products = projected.products(residual)
    out = []
    for index, explained_ss in enumerate(projected.explained_ss(products).tolist()):
        candidate = projected.signatures.candidates[index]
        net_gain = explained_ss - candidate.n_parameters * float(np.log(rows))
        noncentrality = projected.noncentrality(index)
        out.append(
            Score(
                candidate,
                explained_ss,
                net_gain,
                projected.amplitudes(index, products),
                noncentrality,
            )
        )
    return sorted(out, key=lambda s: -s.net_gain)


def zero_score(item: Score, rows: int) -> Score:
    """The score of an atom that takes nothing of the residual."""
    net_gain = -item.candidate.n_parameters * float(np.log(rows))
    return replace(
        item, explained_ss=0.0, net_gain=net_gain, amplitudes=np.zeros_like(item.amplitudes)
    )


def null_maxima(projected: Projected, rows: int) -> Array:
    """Largest score over all atoms that noise alone gives, simulated, sorted; (samples,)."""
    candidates = projected.signatures.candidates
    if not candidates:
        return np.zeros(1)
    penalty_per_parameter = np.array(
        [candidate.n_parameters * np.log(rows) for candidate in candidates]
    )
    explained_ss = projected.explained_ss(projected.simulated())
    return np.asarray(np.sort((explained_ss - penalty_per_parameter[:, None]).max(axis=0)))
