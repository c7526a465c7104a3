"""Signatures: regressor columns of every candidate beside the present model.

A column is the change of the prediction by one usual-size step of the effect (a finite difference
instead of a derivative, since a layer change makes the radius jump and some effects have no
gradient at zero). Inner products are kept per noise band, to be combined under any noise variance.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.candidates import points
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = ["Candidate", "Signatures", "pieces", "signatures", "updated_signatures"]


@dataclass(frozen=True)
class Candidate:
    """An effect at one point of its shape grid.

    Attributes
    ----------
    effect : Effect
        The effect.
    shape : dict of str to float
        Its shape parameters.
    columns : slice
        Its columns among the signatures.
    usual_steps : tuple of dict
        Values of one usual-size step per column.
    """

    effect: Effect
    shape: dict[str, float]
    columns: slice
    usual_steps: tuple[dict[str, float], ...]

    @property
    def n_parameters(self) -> int:
        """Number of fitted parameters, counting a scanned order as one."""
        return Coordinates(self.effect).n_parameters

    def with_law(self, law: Effect) -> Candidate:
        """The same candidate with a shorter series, its columns limited accordingly."""
        fixed = {p.name for p in law.parameters if p.role == "fixed"}
        usual_steps = tuple(
            usual_step for usual_step in self.usual_steps if not fixed & usual_step.keys()
        )
        return replace(self, effect=law, usual_steps=usual_steps)


@dataclass(frozen=True)
class Signatures:
    """Columns of all candidates beside one model.

    Attributes
    ----------
    candidates : tuple of Candidate
        Effects at their grid points.
    columns : ndarray of shape (n_rows, p)
        Change of the prediction by one usual-size step each.
    gram : ndarray of shape (n_bands, p, p)
        Inner products per noise band.
    model : Hypothesis
        Model beside which the columns were computed.
    without_signature : tuple
        Effects with values that change nothing beside that model.
    """

    candidates: tuple[Candidate, ...]
    columns: Array
    gram: Array
    model: Hypothesis
    without_signature: tuple[tuple[Effect, dict[str, float]], ...] = ()


class _Canvas:
    """Writes the columns of effects beside one model, for some outputs."""

    def __init__(
        self, regression: Regression, present: Hypothesis, outputs: Collection[str]
    ) -> None:
        self._regression = regression
        self._present = present
        self._here = regression.change(present, outputs)

    def draw(self, column: Array, term: Term, outputs: Collection[str]) -> bool:
        """Write the change by a term into its rows of some outputs; False where there is none."""
        if not outputs:
            return False
        there = self._regression.change(
            self._present.with_term(term, self._regression.n_runs), outputs
        )
        size = 0.0
        for rows in self._regression.rows_of(outputs):
            np.subtract(there[rows], self._here[rows], out=column[rows])
            size += float(column[rows] @ column[rows])
        if not np.isfinite(size):
            column[:] = 0.0
        return 0.0 < size < np.inf


def signatures(
    regression: Regression, present: Hypothesis, effects: Iterable[Effect]
) -> Signatures:
    """Signatures of candidate effects beside a model.

    Parameters
    ----------
    regression
        The data and the model.
    present
        Model beside which the effects are added.
    effects
        Candidates.
    """
    outputs = regression.outputs
    canvas = _Canvas(regression, present, outputs)
    tried = list(points(regression, effects))
    candidates: list[Candidate] = []
    without_signature: list[tuple[Effect, dict[str, float]]] = []
    # Columns are contiguous in memory, since each is written and read as a whole. Pages of zeros,
    # the rows of outputs that an effect does not act on, are not allocated by the system.
    columns, count = (
        np.zeros((sum(len(usual_steps) for *_, usual_steps in tried), regression.n_rows)),
        0,
    )
    for effect, shape, usual_steps in tried:
        own = []
        reached = regression.outputs_of(effect.stage)
        for usual_step in usual_steps:
            values = {**effect.null, **shape, **usual_step}
            if canvas.draw(columns[count], Term(effect, values), reached):
                own.append(usual_step)
                count += 1
            else:
                without_signature.append((effect, values))
        if own:
            candidates.append(Candidate(effect, shape, slice(count - len(own), count), tuple(own)))
    kept = columns[:count].T
    gram = np.zeros((len(regression.bands), count, count))
    _multiply(gram, regression, kept, outputs)
    return Signatures(tuple(candidates), kept, gram, present, tuple(without_signature))


def updated_signatures(
    regression: Regression, present: Hypothesis, previous: Signatures
) -> Signatures | None:
    """Signatures beside another model, computed in the memory of ``previous``.

    Only outputs that changed effects act on are computed again. None where an effect that had no
    column has one now.
    """
    changed = [t for t in present.terms if t not in previous.model.terms]
    changed += [t for t in previous.model.terms if t not in present.terms]
    touched = {output for term in changed for output in regression.outputs_of(term.effect.stage)}
    canvas, spare = _Canvas(regression, present, touched), np.empty(regression.n_rows)
    for effect, values in previous.without_signature:
        reached = touched & regression.outputs_of(effect.stage)
        if canvas.draw(spare, Term(effect, values), reached):
            return None
    for candidate in previous.candidates:
        reached = touched & regression.outputs_of(candidate.effect.stage)
        for index, usual_step in enumerate(candidate.usual_steps, candidate.columns.start):
            term = Term(
                candidate.effect, {**candidate.effect.null, **candidate.shape, **usual_step}
            )
            canvas.draw(previous.columns[:, index], term, reached)
    _multiply(previous.gram, regression, previous.columns, touched)
    return replace(previous, model=present)


def _multiply(
    gram: Array, regression: Regression, columns: Array, outputs: Collection[str]
) -> None:
    """Inner products per noise band of some outputs, written into (n_bands, p, p)."""
    for band, (output, _, _) in enumerate(regression.bands):
        if output in outputs:
            gram[band] = 0.0
    for band, rows in pieces(regression):
        if regression.bands[band][0] in outputs:
            gram[band] += columns[rows].T @ columns[rows]


def pieces(regression: Regression) -> Iterator[tuple[int, slice]]:
    """Contiguous rows of one noise band, with its number."""
    for segment in regression.segments:
        ids = regression.band_of_row[segment.rows]
        edges = np.flatnonzero(np.diff(ids, prepend=-1, append=-1))
        for low, high in pairwise(edges.tolist()):
            yield int(ids[low]), slice(segment.rows.start + low, segment.rows.start + high)
