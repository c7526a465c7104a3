"""A dataset as one regression: the residual vector of a hypothesis, in frequency.

Rows are the kept cosine coefficients of every output of every run. A hypothesis is a tuple of
terms with nuisances and, for effects with memory, one initial state per run. Nuisances are the
length instrument's offset and, where a known weight is the load, how its acceleration is rounded.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.spectrum import Band, band_edges, narrow_edges, to_time
from winchkit.diagnosis.regression.hypothesis import START, Hypothesis, started
from winchkit.diagnosis.regression.prediction_cache import Predictor, masked
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.model.line import Line
from winchkit.model.stages import Stage

__all__ = ["Problem", "Segment"]


@dataclass(frozen=True)
class Segment:
    """Where one output of one run stands in the rows."""

    run: int
    output: str
    rows: slice
    band: Band


class Problem:
    """Residuals of hypotheses on a dataset, and how hypotheses become vectors to fit."""

    def __init__(self, dataset: Dataset) -> None:
        self.dataset = dataset
        self.runs = len(dataset.recordings)
        self.segments = _segments(dataset)
        self.rows = self.segments[-1].rows.stop
        self._predictors = [Predictor(dataset.profile, r) for r in dataset.recordings]
        self.base = self._base()
        offset, rounding = self._offset_column(), self._rounding_column()
        self.fits_offset = bool(np.any(offset))
        """Whether the length instrument's offset is an unknown; it is the first one then."""
        self.rounds = bool(np.any(rounding))
        """Whether how a known weight's acceleration is rounded is an unknown; the last one then."""
        present = [column for column in (offset, rounding) if np.any(column)]
        self.nuisance_columns = np.array(present).reshape(len(present), self.rows).T
        """By their unknowns, (rows, nuisances)."""

    @cached_property
    def band_of_row(self) -> NDArray[np.intp]:
        """Noise band of every row; bands are numbered through all outputs."""
        return self._bands[0]

    @cached_property
    def bands(self) -> list[tuple[str, float, float]]:
        """Output and frequency range of every noise band."""
        return self._bands[1]

    @cached_property
    def floor(self) -> Array:
        """Least noise power that is believed per band, a 10⁻⁸ of what the output measures."""
        size = {
            output: max(
                float(np.std(r.measured[output]))
                for r in self.dataset.recordings
                if output in r.measured
            )
            for output in self.dataset.outputs
        }
        return np.array([(1e-8 * size[output]) ** 2 or 1e-300 for output, _, _ in self.bands])

    def samples(self, output: str) -> int:
        """How many samples of an output are compared; the others are zero in every residual."""
        there = [r.valid[output] for r in self.dataset.recordings if output in r.valid]
        return max(1, sum(int(np.count_nonzero(valid)) for valid in there))

    def change(self, hypothesis: Hypothesis, outputs: Container[str] | None = None) -> Array:
        """What the terms add to the nominal prediction, rows; only those of some outputs count.

        What the others hold then is of no meaning.
        """
        if not hypothesis.terms:
            return np.zeros(self.rows)
        terms = [started(hypothesis, run) for run in range(self.runs)]
        sharper = hypothesis.nuisances[-1] if self.rounds and hypothesis.nuisances else None
        out = np.empty(self.rows)
        for segment in self.segments:
            if outputs is None or segment.output in outputs:
                predictor = self._predictors[segment.run]
                out[segment.rows] = predictor.change(segment.output, terms[segment.run], sharper)
        return out

    def rows_of(self, outputs: Container[str]) -> list[slice]:
        """Where the segments of some outputs stand."""
        return [s.rows for s in self.segments if s.output in outputs]

    def outputs_of(self, stage: Stage) -> set[str]:
        """Outputs on whose way a stage lies, in some run."""
        return {output for p in self._predictors for output in p.outputs_of(stage)}

    def residual(self, hypothesis: Hypothesis) -> Array:
        """Measured minus predicted, rows."""
        residual = self.base - self.change(hypothesis)
        if hypothesis.nuisances:
            residual -= self.nuisance_columns @ np.array(hypothesis.nuisances)
        return residual

    def in_time(self, rows: Array) -> list[Array]:
        """Rows back in time, one array per segment."""
        return [to_time(rows[s.rows], s.band) for s in self.segments]

    def vector(self, hypothesis: Hypothesis) -> Array:
        """Everything to fit: nuisances, coordinates of the terms, initial states."""
        count = self.nuisance_columns.shape[1]
        parts = [np.array(hypothesis.nuisances or (0.0,) * count)]
        parts += [Coordinates(t.effect).vector(t.values) for t in hypothesis.terms]
        parts += [np.array(start) for start in hypothesis.starts]
        return np.concatenate([np.zeros(0), *parts])

    def hypothesis(self, vector: Array, like: Hypothesis) -> Hypothesis:
        """A hypothesis of the same terms at a vector."""
        at = self.nuisance_columns.shape[1]
        nuisances = tuple(vector[:at].tolist())
        terms, starts = [], []
        for term in like.terms:
            coordinates = Coordinates(term.effect)
            part = vector[at : at + len(coordinates)]
            terms.append(Term(term.effect, coordinates.values(part, term.values)))
            at += len(coordinates)
        for start in like.starts:
            starts.append(tuple(vector[at : at + len(start)].tolist()))
            at += len(start)
        return Hypothesis(tuple(terms), nuisances, tuple(starts))

    def unknowns_of(self, index: int, like: Hypothesis) -> NDArray[np.bool_]:
        """Which elements of the vector belong to one term: its coordinates, its states."""
        owners = [np.full(self.nuisance_columns.shape[1], -1)]
        owners += [np.full(len(Coordinates(t.effect)), i) for i, t in enumerate(like.terms)]
        owners += [np.full(len(start), i) for i, start in enumerate(like.starts)]
        return np.asarray(np.concatenate(owners) == index)

    def bounds(self, like: Hypothesis) -> tuple[Array, Array]:
        """Lower and upper ends of the vector."""
        pairs = [Coordinates(t.effect).bounds() for t in like.terms]
        count = self.nuisance_columns.shape[1]
        low = [np.full(count, -np.inf), *(pair[0] for pair in pairs)]
        high = [np.full(count, np.inf), *(pair[1] for pair in pairs)]
        for term, start in zip(like.terms, like.starts, strict=True):
            if start:
                parameter = term.effect.parameter(START)
                low.append(np.full(len(start), parameter.low))
                high.append(np.full(len(start), parameter.high))
        return np.concatenate(low), np.concatenate(high)

    def jacobian(self, vector: Array, like: Hypothesis) -> Array:
        """Derivative of the prediction by the vector, by differences; (rows, len)."""
        here = self.change(self.hypothesis(vector, like))
        _, high = self.bounds(like)
        out = np.empty((len(vector), self.rows)).T  # Columns are written one by one.
        states = sum(len(start) for start in like.starts)
        count = self.nuisance_columns.shape[1]
        out[:, :count] = self.nuisance_columns
        # What sharpens a weight's force also acts through the terms.
        through = [count - 1] if self.rounds and like.terms else []
        for index in (*through, *range(count, len(vector) - states)):
            step = 1e-3 * max(1.0, abs(vector[index]))
            if vector[index] + step > high[index]:
                step = -step
            moved = vector.copy()
            moved[index] += step
            own = self.nuisance_columns[:, index] if index < count else 0.0
            out[:, index] = own + (self.change(self.hypothesis(moved, like)) - here) / step
        self._by_states(out, vector, like, here, len(vector) - states)
        return out

    def _by_states(
        self, out: Array, vector: Array, like: Hypothesis, here: Array, first: int
    ) -> None:
        """Columns of initial states: each touches one run only, so one evaluation serves all."""
        for start in like.starts:
            if not start:
                continue
            steps = np.where(vector[first : first + len(start)] > 0, -1e-3, 1e-3)
            moved = vector.copy()
            moved[first : first + len(start)] += steps
            difference = self.change(self.hypothesis(moved, like)) - here
            out[:, first : first + len(start)] = 0.0
            for segment in self.segments:
                out[segment.rows, first + segment.run] = (
                    difference[segment.rows] / steps[segment.run]
                )
            first += len(start)

    def _masked(self, segment: Segment, signal: Array) -> Array:
        return masked(self.dataset.recordings[segment.run], segment.output, signal)

    def _base(self) -> Array:
        out = np.zeros(self.rows)
        for segment in self.segments:
            recording = self.dataset.recordings[segment.run]
            error = recording.measured[segment.output] - recording.nominal[segment.output]
            out[segment.rows] = self._masked(segment, error)
        return out

    def _offset_column(self) -> Array:
        out = np.zeros(self.rows)
        for segment in self.segments:
            recording = self.dataset.recordings[segment.run]
            if segment.output == "cable_length" and not recording.zeroed:
                out[segment.rows] = self._masked(segment, np.ones(segment.band.count))
        return out

    def _rounding_column(self) -> Array:
        """What the outputs gain from a known weight's acceleration being a little less rounded.

        Differences of the angle round the acceleration by its own curvature, by how much depends
        on the sampling: without this unknown it is taken for a lag of the cell.
        """
        out = np.zeros(self.rows)
        for run, recording in enumerate(self.dataset.recordings):
            rounded = recording.raw.rounding
            if rounded is None or recording.raw.load is None:
                continue
            line = Line(self.dataset.profile)
            moved = line.predict(replace(recording.raw, load=recording.raw.load + rounded))
            for segment in (s for s in self.segments if s.run == run):
                gained = moved[segment.output] - recording.nominal[segment.output]
                out[segment.rows] = self._masked(segment, gained)
        return out

    @cached_property
    def _bands(self) -> tuple[NDArray[np.intp], list[tuple[str, float, float]]]:
        ids = np.zeros(self.rows, dtype=np.intp)
        bands: list[tuple[str, float, float]] = []
        for output in self.dataset.outputs:
            own = [s for s in self.segments if s.output == output]
            longest = max(own, key=lambda s: s.band.count)
            # Repeats are smoothed over narrow bands; what a saturated fit leaves is not.
            frequency = longest.band.frequency
            repeated = bool(self.dataset.repeated)
            edges = narrow_edges(frequency) if repeated else band_edges(frequency, 1)
            for segment in own:
                inside = np.searchsorted(edges, segment.band.frequency, side="right") - 1
                ids[segment.rows] = len(bands) + inside
            bands += [(output, max(0.0, float(low)), float(high)) for low, high in pairwise(edges)]
        return ids, bands


def _segments(dataset: Dataset) -> list[Segment]:
    segments, at = [], 0
    for output in dataset.outputs:
        for run, recording in enumerate(dataset.recordings):
            if output in recording.measured:
                band = recording.bands[output]
                kept = len(band.frequency)
                segments.append(Segment(run, output, slice(at, at + kept), band))
                at += kept
    return segments
