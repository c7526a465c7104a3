"""What every candidate effect would look like in the data, and how well the residual fits it.

A signature is a set of columns: what the prediction gains from a usual size of the effect, by
secants and not by tangents, since a radius jumps at layers and some effects have no gradient at
their null. Only their inner products per noise band are needed to score, so that scoring again
with another noise, or simulating what noise alone would score, costs next to nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.noise import Noise
from winchkit.diagnosis.points import points
from winchkit.diagnosis.problem import Problem
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Effect

__all__ = [
    "Atom",
    "Projected",
    "Score",
    "Signatures",
    "chance_level",
    "redrawn",
    "score",
    "signatures",
    "worthless",
]

Array = NDArray[np.float64]
_NOTHING = 1e-300
_SIMULATIONS = 400
_UNIDENTIFIABLE = 1e-7
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Atom:
    """One effect at one point of its shape grid: its columns, and where a fit would start."""

    effect: Effect
    shape: dict[str, float]
    columns: slice
    secants: tuple[dict[str, float], ...]

    @property
    def freedom(self) -> int:
        """Degrees of freedom that choosing it costs."""
        return Coordinates(self.effect).freedom

    def of_law(self, law: Effect) -> Atom:
        """The same of a law with fewer coefficients, begun where these alone say so."""
        fixed = {p.name for p in law.parameters if p.role == "fixed"}
        secants = tuple(secant for secant in self.secants if not fixed & secant.keys())
        return replace(self, effect=law, secants=secants)


@dataclass(frozen=True)
class Signatures:
    """Columns of all candidates, and their inner products per noise band."""

    atoms: tuple[Atom, ...]
    columns: Array
    """(rows, p)."""
    gram: Array
    """(bands, p, p)."""
    beside: Hypothesis
    """The present model that they were drawn beside."""
    silent: tuple[tuple[Effect, dict[str, float]], ...] = ()
    """Effects with values at which they changed nothing there, and so have no column."""


@dataclass(frozen=True)
class Score:
    """How much of the residual's whitened squares an atom would take, and its chance level."""

    atom: Atom
    gain: float
    value: float
    """Gain less the price of its degrees of freedom."""
    amplitudes: Array
    """In units of the secants."""
    strength: float
    """λ for one usual size: noncentrality of its whitened, projected signature."""


def signatures(problem: Problem, present: Hypothesis, effects: Iterable[Effect]) -> Signatures:
    """Columns and inner products of every candidate among ``effects`` beside a present model."""
    here = problem.change(present)
    tried = list(points(problem, effects))
    atoms: list[Atom] = []
    silent: list[tuple[Effect, dict[str, float]]] = []
    # One column after another in memory: thousands of rows each, written and read whole.
    columns, count = np.empty((sum(len(secants) for *_, secants in tried), problem.rows)), 0
    for effect, shape, secants in tried:
        own = []
        for secant in secants:
            values = {**effect.null, **shape, **secant}
            columns[count] = _column(problem, present, here, effect, values)
            if columns[count].any():
                own.append(secant)
                count += 1
            else:
                silent.append((effect, values))
        if own:
            atoms.append(Atom(effect, shape, slice(count - len(own), count), tuple(own)))
    kept = columns[:count].T
    return Signatures(tuple(atoms), kept, _gram(problem, kept), present, tuple(silent))


def redrawn(problem: Problem, present: Hypothesis, found: Signatures) -> Signatures | None:
    """The same signatures beside a grown model, in the same memory; ``found`` is used up.

    Only those are drawn anew that lie on the way to an output which changed terms touch: a lag
    acts on what is there. None where an effect that had no column has one now.
    """
    changed = [t for t in present.terms if t not in found.beside.terms]
    changed += [t for t in found.beside.terms if t not in present.terms]
    touched = {output for term in changed for output in problem.outputs_of(term.effect.stage)}
    here = problem.change(present)
    for effect, values in found.silent:
        reached = touched & problem.outputs_of(effect.stage)
        if reached and _column(problem, present, here, effect, values).any():
            return None
    for atom in found.atoms:
        if touched & problem.outputs_of(atom.effect.stage):
            for index, secant in enumerate(atom.secants, atom.columns.start):
                values = {**atom.effect.null, **atom.shape, **secant}
                found.columns[:, index] = _column(problem, present, here, atom.effect, values)
    return replace(found, gram=_gram(problem, found.columns), beside=present)


def _column(
    problem: Problem, present: Hypothesis, here: Array, effect: Effect, values: dict[str, float]
) -> Array:
    """What the prediction gains from an effect beside the present model, rows."""
    column = problem.change(present.with_term(Term(effect, values), problem.runs)) - here
    return column if np.isfinite(column).all() else np.zeros_like(column)


def _gram(problem: Problem, columns: Array) -> Array:
    """Inner products per noise band, (bands, p, p)."""
    out = np.zeros((len(problem.bands), columns.shape[1], columns.shape[1]))
    for band, rows in _pieces(problem):
        out[band] += columns[rows].T @ columns[rows]
    return out


class Projected:
    """Signatures with the present model's unknowns projected out, under one noise."""

    def __init__(self, problem: Problem, found: Signatures, jacobian: Array, noise: Noise) -> None:
        self.found = found
        self._jacobian = jacobian
        self._weight2 = noise.weight(problem) ** 2
        self._freedom = noise.freedom
        self._cross, self._normal = _cross(problem, jacobian, found.columns)
        self._share = share = 1 / noise.power
        cross, normal, gram = (
            np.tensordot(share, part, axes=1) for part in (self._cross, self._normal, found.gram)
        )
        self._through = -np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ cross
        self.inner = _projected(gram, cross, normal, self._through)
        """Inner products of the whitened, projected columns, (p, p)."""
        plain = np.einsum("b,bii->i", share, found.gram)
        self._roots = [self._root(atom, plain) for atom in found.atoms]

    def products(self, residual: Array) -> Array:
        """Inner products of the whitened residual with the projected columns, (p,)."""
        weighted = residual * self._weight2
        own = self.found.columns.T @ weighted
        return np.asarray(own + self._through.T @ (self._jacobian.T @ weighted))

    def gains(self, products: Array) -> Array:
        """Whitened squares that each atom takes; products (p,) or (p, samples)."""
        return np.array(
            [
                np.sum((root.T @ products[atom.columns]) ** 2, axis=0)
                for atom, root in zip(self.found.atoms, self._roots, strict=True)
            ]
        )

    def amplitudes(self, index: int, products: Array) -> Array:
        """Amplitudes of one atom in units of its secants."""
        root = self._roots[index]
        atom = self.found.atoms[index]
        return np.asarray(root @ (root.T @ products[atom.columns]))

    def strength(self, index: int) -> float:
        """λ for one usual size of an atom; zero where it cannot be identified."""
        first = self.found.atoms[index].columns.start
        return float(self.inner[first, first]) if self._roots[index].shape[1] else 0.0

    def simulated(self, samples: int = _SIMULATIONS) -> Array:
        """Products that noise alone would give, its power known only so well; (p, samples)."""
        random = np.random.default_rng(0)
        out = np.zeros((len(self.inner), samples))
        bands = zip(
            self._share, self.found.gram, self._cross, self._normal, self._freedom, strict=True
        )
        for share, gram, cross, normal, freedom in bands:
            part = share * _projected(gram, cross, normal, self._through)
            # No Cholesky factor: what the present model explains whole is left with rounding only.
            values, vectors = np.linalg.eigh(part)
            factor = np.sqrt(freedom / random.chisquare(freedom, samples))
            noise = random.standard_normal((len(part), samples)) * factor
            # The symmetric root: the same draws whichever way rounding turns the vectors.
            out += (vectors * np.sqrt(np.maximum(values, 0.0))) @ (vectors.T @ noise)
        return out

    def _root(self, atom: Atom, plain: Array) -> Array:
        """R with R Rᵀ the inverse of an atom's inner products, where they can be identified."""
        inner = self.inner[atom.columns, atom.columns]
        if np.max(plain[atom.columns]) < _ROUNDING:
            # What a usual size moves by less than rounding would let chance reach any level.
            return np.zeros((len(inner), 0))
        size = np.sqrt(np.maximum(plain[atom.columns], _NOTHING))
        values, vectors = np.linalg.eigh(inner / np.outer(size, size))
        kept = values > _UNIDENTIFIABLE
        return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / size[:, None])


def _projected(gram: Array, cross: Array, normal: Array, through: Array) -> Array:
    """Inner products of columns from which unknowns were taken out by ``through``, (p, p)."""
    mixed = cross.T @ through
    return np.asarray(gram + mixed + mixed.T + through.T @ normal @ through)


def _cross(problem: Problem, jacobian: Array, columns: Array) -> tuple[Array, Array]:
    """Per band: inner products of unknowns with columns, and among unknowns."""
    count, q = len(problem.bands), jacobian.shape[1]
    cross, normal = np.zeros((count, q, columns.shape[1])), np.zeros((count, q, q))
    for band, rows in _pieces(problem):
        cross[band] += jacobian[rows].T @ columns[rows]
        normal[band] += jacobian[rows].T @ jacobian[rows]
    return cross, normal


def _pieces(problem: Problem) -> Iterator[tuple[int, slice]]:
    """Runs of rows that lie in one noise band."""
    for segment in problem.segments:
        ids = problem.band_of_row[segment.rows]
        edges = np.flatnonzero(np.diff(ids, prepend=-1, append=-1))
        for low, high in pairwise(edges.tolist()):
            yield int(ids[low]), slice(segment.rows.start + low, segment.rows.start + high)


def score(projected: Projected, residual: Array, rows: int) -> list[Score]:
    """Scores of all atoms, best first: gain less (degrees of freedom) · ln(rows)."""
    products = projected.products(residual)
    out = []
    for index, gain in enumerate(projected.gains(products).tolist()):
        atom = projected.found.atoms[index]
        value = gain - atom.freedom * float(np.log(rows))
        strength = projected.strength(index)
        out.append(Score(atom, gain, value, projected.amplitudes(index, products), strength))
    return sorted(out, key=lambda s: -s.value)


def worthless(item: Score, rows: int) -> Score:
    """The score of an atom that takes nothing of the residual."""
    value = -item.atom.freedom * float(np.log(rows))
    return replace(item, gain=0.0, value=value, amplitudes=np.zeros_like(item.amplitudes))


def chance_level(projected: Projected, rows: int) -> Array:
    """Largest score over all atoms that noise alone gives, simulated, sorted; (samples,)."""
    atoms = projected.found.atoms
    if not atoms:
        return np.zeros(1)
    price = np.array([atom.freedom * np.log(rows) for atom in atoms])
    gains = projected.gains(projected.simulated())
    return np.asarray(np.sort((gains - price[:, None]).max(axis=0)))
