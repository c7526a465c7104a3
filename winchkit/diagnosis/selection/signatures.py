"""What every candidate effect would look like in the data.

A signature is a set of columns: what the prediction gains from a usual size of the effect, by
secants and not by tangents, since a radius jumps at layers and some effects have no gradient at
their null. Their inner products are kept per noise band, for whichever noise they are scored by.
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
    """One effect at one point of its shape grid: its columns, and where a fit would start."""

    effect: Effect
    shape: dict[str, float]
    columns: slice
    usual_steps: tuple[dict[str, float], ...]

    @property
    def n_parameters(self) -> int:
        """Degrees of freedom that choosing it costs."""
        return Coordinates(self.effect).n_parameters

    def with_law(self, law: Effect) -> Candidate:
        """The same of a law with fewer coefficients, begun where these alone say so."""
        fixed = {p.name for p in law.parameters if p.role == "fixed"}
        usual_steps = tuple(
            usual_step for usual_step in self.usual_steps if not fixed & usual_step.keys()
        )
        return replace(self, effect=law, usual_steps=usual_steps)


@dataclass(frozen=True)
class Signatures:
    """Columns of all candidates, and their inner products per noise band."""

    candidates: tuple[Candidate, ...]
    columns: Array
    """(rows, p)."""
    gram: Array
    """(bands, p, p)."""
    model: Hypothesis
    """The present model that they were drawn beside."""
    without_signature: tuple[tuple[Effect, dict[str, float]], ...] = ()
    """Effects with values at which they changed nothing there, and so have no column."""


class _Canvas:
    """Some outputs beside a present model, into whose rows columns are drawn."""

    def __init__(
        self, regression: Regression, present: Hypothesis, outputs: Collection[str]
    ) -> None:
        self._regression = regression
        self._present = present
        self._here = regression.change(present, outputs)

    def draw(self, column: Array, term: Term, outputs: Collection[str]) -> bool:
        """Write what some of the outputs gain from a term, rows; tells whether they do.

        What has no finite size is nothing.
        """
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
    """Columns and inner products of every candidate among ``effects`` beside a present model."""
    outputs = regression.outputs
    canvas = _Canvas(regression, present, outputs)
    tried = list(points(regression, effects))
    candidates: list[Candidate] = []
    without_signature: list[tuple[Effect, dict[str, float]]] = []
    # One column after another in memory: thousands of rows each, written and read whole.
    columns, count = (
        np.empty((sum(len(usual_steps) for *_, usual_steps in tried), regression.n_rows)),
        0,
    )
    for effect, shape, usual_steps in tried:
        own = []
        for usual_step in usual_steps:
            values = {**effect.null, **shape, **usual_step}
            if canvas.draw(columns[count], Term(effect, values), outputs):
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
    regression: Regression, present: Hypothesis, found: Signatures
) -> Signatures | None:
    """The same signatures beside a grown model, in the same memory; ``found`` is used up.

    Drawn anew is only what lies on the way to an output which changed terms touch: a lag acts on
    what is there. None where an effect that had no column has one now.
    """
    changed = [t for t in present.terms if t not in found.model.terms]
    changed += [t for t in found.model.terms if t not in present.terms]
    touched = {output for term in changed for output in regression.outputs_of(term.effect.stage)}
    canvas, spare = _Canvas(regression, present, touched), np.empty(regression.n_rows)
    for effect, values in found.without_signature:
        reached = touched & regression.outputs_of(effect.stage)
        if canvas.draw(spare, Term(effect, values), reached):
            return None
    for candidate in found.candidates:
        reached = touched & regression.outputs_of(candidate.effect.stage)
        for index, usual_step in enumerate(candidate.usual_steps, candidate.columns.start):
            term = Term(
                candidate.effect, {**candidate.effect.null, **candidate.shape, **usual_step}
            )
            canvas.draw(found.columns[:, index], term, reached)
    _multiply(found.gram, regression, found.columns, touched)
    return replace(found, model=present)


def _multiply(
    gram: Array, regression: Regression, columns: Array, outputs: Collection[str]
) -> None:
    """Inner products per noise band of some outputs, into (bands, p, p)."""
    for band, (output, _, _) in enumerate(regression.bands):
        if output in outputs:
            gram[band] = 0.0
    for band, rows in pieces(regression):
        if regression.bands[band][0] in outputs:
            gram[band] += columns[rows].T @ columns[rows]


def pieces(regression: Regression) -> Iterator[tuple[int, slice]]:
    """Runs of rows that lie in one noise band, with its number."""
    for segment in regression.segments:
        ids = regression.band_of_row[segment.rows]
        edges = np.flatnonzero(np.diff(ids, prepend=-1, append=-1))
        for low, high in pairwise(edges.tolist()):
            yield int(ids[low]), slice(segment.rows.start + low, segment.rows.start + high)
