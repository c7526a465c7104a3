"""Signatures: regressor columns of every candidate beside the present model.

A column is the change of the prediction by one usual-size step of the effect (a finite difference
instead of a derivative, since a layer change makes the radius jump and some effects have no
gradient at zero). Inner products are kept per noise band, to be combined under any noise variance.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Coarse, Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.candidates import points
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term


@dataclass(frozen=True)
class EffectShape:
    """An effect at one point of its shape grid, with its columns among the signatures and the
    values of one usual-size step for each of them.
    """

    effect: Effect
    shape: dict[str, float]
    columns: slice
    usual_steps: tuple[dict[str, float], ...]

    @property
    def n_parameters(self) -> int:
        """Number of fitted parameters, counting a scanned order as one."""
        return Coordinates(self.effect).n_parameters

    def with_law(self, law: Effect) -> EffectShape:
        """The same candidate with a shorter series, its columns limited accordingly."""
        fixed = {p.name for p in law.parameters if p.role == "fixed"}
        usual_steps = tuple(
            usual_step for usual_step in self.usual_steps if not fixed & usual_step.keys()
        )
        return replace(self, effect=law, usual_steps=usual_steps)


Absent = tuple[Effect, dict[str, float], tuple[dict[str, float], ...]]
"""An effect at a point of its shape grid, and its usual steps that change nothing there."""
_BLOCK = 4096
"""Rows of columns that are converted to double precision at once."""
_ROOM = 100
"""Columns that may be added later; their pages are not allocated before."""
_UNCHANGED = 0.01
"""Change of a column on the coarse regression, relative to it, below which it is kept."""


@dataclass(frozen=True)
class Signatures:
    """Columns of all candidates beside one model, and their inner products ``gram`` per noise band.

    ``memory`` (at least p, n_rows) has one column after another and room for more. Its single
    precision rounds far below the uncertainty of every column; sums over it are in double
    precision. ``coarse`` has the columns on the coarse regression as they were when last computed
    on all samples.
    """

    candidates: tuple[EffectShape, ...]
    memory: NDArray[np.float32]
    gram: Array
    reached: Mapping[str, NDArray[np.intp]]
    model: Hypothesis
    without_signature: tuple[Absent, ...] = ()
    coarse: NDArray[np.float32] | None = None

    @property
    def count(self) -> int:
        """Number of columns p."""
        return self.candidates[-1].columns.stop if self.candidates else 0

    @property
    def columns(self) -> NDArray[np.float32]:
        """Change of the prediction by one usual-size step each, (n_rows, p)."""
        return self.memory[: self.count].T

    def rows_of(self, output: str, rows: slice) -> Array:
        """The columns that change an output at some of its rows, in double precision."""
        return self.memory[self.reached[output], rows].astype(np.float64)

    def products(self, regression: Regression, weighted: Array) -> Array:
        """Inner products of all columns with a vector (n_rows,), shape (p,)."""
        out = np.zeros(self.count)
        for segment in regression.segments:
            own = self.reached[segment.output]
            for first in range(segment.rows.start, segment.rows.stop, _BLOCK):
                rows = slice(first, min(first + _BLOCK, segment.rows.stop))
                out[own] += self.rows_of(segment.output, rows) @ weighted[rows]
        return out


class _ColumnWriter:
    """Writes the columns of effects beside one model, for some outputs."""

    def __init__(
        self, regression: Regression, present: Hypothesis, outputs: Collection[str]
    ) -> None:
        self._regression = regression
        self._present = present
        self._here = regression.change(present, outputs)

    def write(self, column: NDArray[np.float32], term: Term, outputs: Collection[str]) -> bool:
        """Write the change by a term into its rows of some outputs; False where there is none."""
        if not outputs:
            return False
        there = self._regression.change(
            self._present.with_term(term, self._regression.n_runs), outputs
        )
        size = 0.0
        for rows in self._regression.rows_of(outputs):
            own = column[rows]
            np.subtract(there[rows], self._here[rows], out=own, casting="same_kind")
            size += float(own @ own)
        if not np.isfinite(size):
            column[:] = 0.0
        return 0.0 < size < np.inf


def signatures(
    regression: Regression,
    present: Hypothesis,
    effects: Iterable[Effect],
    coarse: Coarse | None = None,
) -> Signatures:
    """Signatures of candidate effects beside a model; ``coarse`` shows later changes of them."""
    writer = _ColumnWriter(regression, present, regression.outputs)
    tried = list(points(regression, effects))
    candidates: list[EffectShape] = []
    without_signature: list[Absent] = []
    # Columns are contiguous in memory, since each is written and read as a whole. Pages of zeros,
    # the rows of outputs that an effect does not act on, are not allocated by the system.
    most = sum(len(usual_steps) for *_, usual_steps in tried) + _ROOM
    memory, count = np.zeros((most, regression.n_rows), np.float32), 0
    for effect, shape, usual_steps in tried:
        own, absent = [], []
        reached = regression.outputs_of(effect.stage)
        for usual_step in usual_steps:
            term = Term(effect, {**effect.null, **shape, **usual_step})
            if writer.write(memory[count], term, reached):
                own.append(usual_step)
                count += 1
            else:
                absent.append(usual_step)
        if absent:
            without_signature.append((effect, shape, tuple(absent)))
        if own:
            candidates.append(
                EffectShape(effect, shape, slice(count - len(own), count), tuple(own))
            )
    found = Signatures(
        tuple(candidates),
        memory,
        np.zeros((len(regression.bands), count, count)),
        _reached(regression, candidates),
        present,
        tuple(without_signature),
    )
    _multiply(found, regression, dict.fromkeys(regression.outputs))
    if coarse is None:
        return found
    on_coarse = np.zeros((most, coarse.regression.n_rows), np.float32)
    _write_columns(coarse.regression, coarse.reduced(present), candidates, on_coarse)
    return replace(found, coarse=on_coarse)


def updated_signatures(
    regression: Regression,
    present: Hypothesis,
    previous: Signatures,
    effects: Iterable[Effect] = (),
    coarse: Coarse | None = None,
) -> Signatures | None:
    """Signatures beside another model in the memory of ``previous``, which is not valid afterwards.

    Only outputs on which changed effects act are computed again, and of columns known on the coarse
    regression only those that change there by 1 % or more. None where a candidate has a further
    column, or where there is no room for new candidates.
    """
    changed = [t for t in present.terms if t not in previous.model.terms]
    changed += [t for t in previous.model.terms if t not in present.terms]
    touched = {output for term in changed for output in regression.outputs_of(term.effect.stage)}
    known = [(effect.id, shape) for effect, shape, _ in previous.without_signature]
    known += [(candidate.effect.id, candidate.shape) for candidate in previous.candidates]
    new_points = [
        (effect, shape, tuple(steps))
        for effect, shape, steps in points(regression, effects)
        if (effect.id, shape) not in known
    ]
    updated = _with_new_candidates(regression, present, previous, touched, new_points)
    if updated is None:
        return None
    found, new = updated
    again = _changed_columns(found, present, touched, coarse)
    again[new] = True
    writer = _ColumnWriter(regression, present, touched)
    for candidate in previous.candidates:
        reached = touched & regression.outputs_of(candidate.effect.stage)
        for index, term in _terms(candidate):
            if again[index]:
                writer.write(found.memory[index], term, reached)
    written = {
        output: np.flatnonzero(again[found.reached[output]])
        for output in regression.outputs
        if output in touched or len(new)
    }
    _multiply(found, regression, written)
    return found


def _with_new_candidates(
    regression: Regression,
    present: Hypothesis,
    previous: Signatures,
    touched: Collection[str],
    new_points: Sequence[Absent],
) -> tuple[Signatures, NDArray[np.intp]] | None:
    """Signatures with candidates that had no column before, and the numbers of their columns; None
    where a candidate that has columns gets a further one, or where there is no room.
    """
    writer, spare = (
        _ColumnWriter(regression, present, touched),
        np.empty(regression.n_rows, np.float32),
    )
    known = [(candidate.effect.id, candidate.shape) for candidate in previous.candidates]
    complete: _ColumnWriter | None = None
    candidates, left, count = list(previous.candidates), [], previous.count
    for place, (effect, shape, usual_steps) in enumerate(
        (*previous.without_signature, *new_points)
    ):
        stage = regression.outputs_of(effect.stage)
        terms = [Term(effect, {**effect.null, **shape, **step}) for step in usual_steps]
        before = place < len(previous.without_signature)
        if before and not any(writer.write(spare, term, set(touched) & stage) for term in terms):
            left.append((effect, shape, usual_steps))
            continue
        if (effect.id, shape) in known or count + len(terms) > len(previous.memory):
            return None
        complete = complete or _ColumnWriter(regression, present, regression.outputs)
        own: list[dict[str, float]] = []
        for term, step in zip(terms, usual_steps, strict=True):
            if complete.write(previous.memory[count], term, stage):
                own.append(step)
                count += 1
        if own:
            candidates.append(
                EffectShape(effect, shape, slice(count - len(own), count), tuple(own))
            )
        absent = tuple(step for step in usual_steps if step not in own)
        left += [(effect, shape, absent)] if absent else []
    first = previous.count
    gram = np.zeros((len(regression.bands), count, count))
    gram[:, :first, :first] = previous.gram
    found = replace(
        previous,
        candidates=tuple(candidates),
        gram=previous.gram if count == first else gram,
        reached=_reached(regression, candidates),
        model=present,
        without_signature=tuple(left),
    )
    return found, np.arange(first, count)


def _terms(candidate: EffectShape) -> Iterator[tuple[int, Term]]:
    """Number and term of every column of a candidate."""
    base = {**candidate.effect.null, **candidate.shape}
    for index, usual_step in enumerate(candidate.usual_steps, candidate.columns.start):
        yield index, Term(candidate.effect, {**base, **usual_step})


def _reached(
    regression: Regression, candidates: Iterable[EffectShape]
) -> dict[str, NDArray[np.intp]]:
    """Numbers of the columns that change each output."""
    out: dict[str, list[int]] = {output: [] for output in regression.outputs}
    for candidate in candidates:
        for output in regression.outputs_of(candidate.effect.stage) & set(regression.outputs):
            out[output] += range(candidate.columns.start, candidate.columns.stop)
    return {output: np.array(own, dtype=np.intp) for output, own in out.items()}


def _write_columns(
    regression: Regression,
    present: Hypothesis,
    candidates: Iterable[EffectShape],
    memory: NDArray[np.float32],
) -> None:
    """Write the columns of candidates beside a model."""
    writer = _ColumnWriter(regression, present, regression.outputs)
    for candidate in candidates:
        reached = regression.outputs_of(candidate.effect.stage)
        for index, term in _terms(candidate):
            writer.write(memory[index], term, reached)


def _changed_columns(
    found: Signatures, present: Hypothesis, touched: Collection[str], coarse: Coarse | None
) -> NDArray[np.bool_]:
    """Mask (p,) of the columns that a new model changes in touched outputs, by 1 % or more on the
    coarse regression, whose columns are renewed.
    """
    count = found.count
    if coarse is None or found.coarse is None:
        return np.ones(count, dtype=bool)
    here = np.zeros((count, coarse.regression.n_rows), np.float32)
    _write_columns(coarse.regression, coarse.reduced(present), found.candidates, here)
    out = np.zeros(count, dtype=bool)
    for rows in coarse.regression.rows_of(touched):
        before, after = found.coarse[:count, rows], here[:, rows]
        size = np.einsum("ij,ij->i", before, before, dtype=np.float64)
        change = after - before
        out |= np.einsum("ij,ij->i", change, change, dtype=np.float64) > _UNCHANGED**2 * size
    found.coarse[:count][out] = here[out]
    return out


def _multiply(
    found: Signatures,
    regression: Regression,
    written: Mapping[str, NDArray[np.intp] | None],
) -> None:
    """Write the inner products per band of some outputs into ``gram``: by output those of the new
    columns among its own, or of all (None).
    """
    for band, (output, _, _) in enumerate(regression.bands):
        own = found.reached[output]
        new = own if written.get(output, ()) is None else own[written.get(output, np.arange(0))]
        found.gram[band][np.ix_(new, own)] = found.gram[band][np.ix_(own, new)] = 0.0
    for band, rows in regression.rows_by_band():
        output = regression.bands[band][0]
        if output not in written:
            continue
        places, own, columns = written[output], found.reached[output], found.rows_of(output, rows)
        if places is None:
            found.gram[band][np.ix_(own, own)] += columns @ columns.T
        elif len(places):
            products, old = columns[places] @ columns.T, np.setdiff1d(np.arange(len(own)), places)
            found.gram[band][np.ix_(own[places], own)] += products
            found.gram[band][np.ix_(own[old], own[places])] += products[:, old].T
