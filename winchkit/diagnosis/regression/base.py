"""The regression problem: the interface that fit, noise, cross-validation and selection use.

A regression has rows (observations), each with a noise band, and predicts them from a hypothesis:
effects with values, nuisance parameters and initial states. Only its implementations know what the
rows are: spectral coefficients of a winch's runs
(:class:`~winchkit.diagnosis.regression.time_series.TimeSeriesRegression`) or equations of a robot's
poses.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.diagnosis.data.spectrum import Band
from winchkit.diagnosis.regression.hypothesis import START, Hypothesis
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.model.stages import At, Stage


@dataclass(frozen=True)
class Segment:
    """Rows of one output of one run."""

    run: int
    output: str
    rows: slice
    band: Band


@dataclass(frozen=True)
class Folds:
    """A partition of the data for cross-validation."""

    of: tuple[NDArray[np.intp], ...]
    """Fold of every sample, one array per segment."""
    count: int


_CORRECTION = (-0.25, 0.0)
"""Range of the correction of second differences, in squared intervals; theory: -1/12 for exact
samples, none for a rate of the drive's own. Measured: 25 right models lie between -0.14 and 0
where their deviation is below 0.1; a free one took the place of a lag (2.3) or of inertia (-1.4)
in the errors of the unchanged profile."""


class Regression(ABC):
    """A nonlinear regression problem with effects, nuisance parameters and initial states.

    The vector of unknowns holds the nuisance parameters, the coordinates of every effect
    (:class:`~winchkit.effects.parametrization.Coordinates`), then the initial states, one per run
    and effect with memory.
    """

    dataset: Dataset
    nominal_residual: Array
    """Measured minus predicted by the profile without effects, (n_rows,)."""
    nuisance_columns: Array
    """Regressors of the nuisance parameters, which are linear, (n_rows, n_nuisances)."""
    fits_offset: bool = False
    """Whether the first nuisance parameter after the offsets of single runs is the offset of the
    length instrument, one of all runs."""
    n_run_offsets: int = 0
    """Number of the first nuisance parameters that are offsets of single runs, of instruments that
    were zeroed anew; as initial states they keep their run's values whatever is held out."""
    fits_discretization: bool = False
    """Whether the last nuisance parameter corrects the discretisation error, also of effects."""

    def __init__(self, segments: Sequence[Segment], n_runs: int) -> None:
        self.segments = tuple(segments)
        self.n_runs = n_runs
        self.n_rows: int = self.segments[-1].rows.stop

    # The data

    @property
    @abstractmethod
    def outputs(self) -> tuple[str, ...]:
        """Measured outputs, in a fixed order."""

    @property
    @abstractmethod
    def bands(self) -> Sequence[tuple[str, float, float]]:
        """Output and frequency range in Hz of every noise band."""

    @property
    @abstractmethod
    def band_of_row(self) -> NDArray[np.intp]:
        """Noise band of every row, shape (n_rows,)."""

    @property
    @abstractmethod
    def power_floor(self) -> Array:
        """Lower limit of the noise variance of every band, shape (n_bands,)."""

    @property
    @abstractmethod
    def n_observations(self) -> int:
        """Number of rows that are observations, the sample size n of the BIC."""

    @property
    def share_of_row(self) -> Array:
        """Share of the samples behind a row that are compared, (n_rows,): a row of a run of which a
        half is compared has half the variance and counts half."""
        return np.ones(self.n_rows)

    def compared_rows(self, output: str) -> float:
        """Number of rows of an output, each by the share of its samples that is compared."""
        own = [s.rows for s in self.segments if s.output == output]
        return sum(float(np.sum(self.share_of_row[rows])) for rows in own)

    @abstractmethod
    def n_samples(self, output: str) -> int:
        """Number of compared samples of an output, at least one."""

    @abstractmethod
    def in_time(self, rows: Array) -> list[Array]:
        """Rows transformed to samples, one array per segment."""

    @abstractmethod
    def signal_rms(self, output: str) -> float:
        """Rms of a measured output within its band, SI; NaN where rows have no unit."""

    @property
    def n_priors(self) -> int:
        """Number of unknowns with a prior, whose rows are no observations."""
        return 0

    # The model

    @property
    def nuisance_names(self) -> tuple[str, ...]:
        """Name of every nuisance parameter."""
        names = [f"offset of a run {index + 1}" for index in range(self.n_run_offsets)]
        names += ["length offset"] * int(self.fits_offset)
        names += ["discretisation correction"] * int(self.fits_discretization)
        count = self.nuisance_columns.shape[1]
        return (*names, *(f"nuisance {index + 1}" for index in range(len(names), count)))

    @abstractmethod
    def change(self, hypothesis: Hypothesis, outputs: Container[str] | None = None) -> Array:
        """Change of the prediction by the effects of a hypothesis, (n_rows,)."""

    @abstractmethod
    def outputs_of(self, stage: Stage) -> set[str]:
        """Outputs that a stage of the model acts on in at least one run."""

    @abstractmethod
    def discretization_error(self, hypothesis: Hypothesis) -> Array:
        """Change of the prediction on a finer time grid than the samples', shape (n_rows,)."""

    @abstractmethod
    def unfiltered(self) -> Regression:
        """The same regression with the rows above the low-pass filter's cut-off."""

    # What effects need

    @property
    @abstractmethod
    def motions(self) -> tuple[At, ...]:
        """Motion of every run, for effects that show in a part of it only; none for poses."""

    @abstractmethod
    def missing_needs(self, effect: Effect) -> list[str]:
        """Parts and channels that an effect needs and that are absent, in words."""

    @abstractmethod
    def excites(self, shape: Mapping[str, float]) -> bool:
        """Whether the data excite an effect with these shape parameters."""

    # Replicates and folds

    @property
    @abstractmethod
    def replicates(self) -> Sequence[Repeats]:
        """Sets of at least two runs that repeat each other."""

    @property
    @abstractmethod
    def group_of_run(self) -> Sequence[int]:
        """Group of equal programme and load of every run, shape (n_runs,)."""

    @property
    @abstractmethod
    def blocks(self) -> Folds:
        """Many short contiguous blocks, for paired tests and the block jackknife."""

    @property
    @abstractmethod
    def groups(self) -> Folds:
        """Few large parts, for leave-group-out cross-validation."""

    # What follows from these

    def rows_of(self, outputs: Container[str]) -> list[slice]:
        """Rows of every segment of some outputs."""
        return [s.rows for s in self.segments if s.output in outputs]

    def rows_by_band(self) -> Iterator[tuple[int, slice]]:
        """Number of a noise band and contiguous rows of it, segment by segment."""
        for segment in self.segments:
            bands = self.band_of_row[segment.rows]
            edges = np.flatnonzero(np.diff(bands, prepend=-1, append=-1))
            for low, high in pairwise(edges.tolist()):
                first = segment.rows.start
                yield int(bands[low]), slice(first + low, first + high)

    def residual(self, hypothesis: Hypothesis) -> Array:
        """Measured minus predicted, shape (n_rows,)."""
        residual = self.nominal_residual - self.change(hypothesis)
        if hypothesis.nuisances:
            residual -= self.nuisance_columns @ np.array(hypothesis.nuisances)
        return residual

    def vector(self, hypothesis: Hypothesis) -> Array:
        """Vector of unknowns of a hypothesis, shape (n_unknowns,)."""
        count = self.nuisance_columns.shape[1]
        parts = [np.array(hypothesis.nuisances or (0.0,) * count)]
        parts += [Coordinates(t.effect).vector(t.values) for t in hypothesis.terms]
        parts += [np.array(start) for start in hypothesis.starts]
        return np.concatenate([np.zeros(0), *parts])

    def hypothesis(self, vector: Array, like: Hypothesis) -> Hypothesis:
        """Hypothesis of the same effects as ``like`` at a vector of unknowns."""
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
        """Mask of the unknowns of one term, its initial states included, (n_unknowns,)."""
        owners = [np.full(self.nuisance_columns.shape[1], -1)]
        owners += [np.full(len(Coordinates(t.effect)), i) for i, t in enumerate(like.terms)]
        owners += [np.full(len(start), i) for i, start in enumerate(like.starts)]
        return np.asarray(np.concatenate(owners) == index)

    def bounds(self, like: Hypothesis) -> tuple[Array, Array]:
        """Lower and upper bounds of the vector of unknowns, each (n_unknowns,)."""
        pairs = [Coordinates(t.effect).bounds() for t in like.terms]
        count = self.nuisance_columns.shape[1]
        low = [np.full(count, -np.inf), *(pair[0] for pair in pairs)]
        high = [np.full(count, np.inf), *(pair[1] for pair in pairs)]
        if self.fits_discretization:
            low[0][-1], high[0][-1] = _CORRECTION
        for term, start in zip(like.terms, like.starts, strict=True):
            if start:
                parameter = term.effect.parameter(START)
                low.append(np.full(len(start), parameter.low))
                high.append(np.full(len(start), parameter.high))
        return np.concatenate(low), np.concatenate(high)

    def jacobian(self, vector: Array, like: Hypothesis) -> Array:
        """Derivative of the prediction with respect to the unknowns, (n_rows, n_unknowns).

        Forward differences with a step of 10⁻³ in the coordinates of the effects; backward at an
        upper bound. The columns of initial states of one term are computed together, since each run
        depends on its own state only.
        """
        here = self.change(self.hypothesis(vector, like))
        _, high = self.bounds(like)
        out = np.empty((len(vector), self.n_rows)).T  # Columns are written one by one.
        states = sum(len(start) for start in like.starts)
        count = self.nuisance_columns.shape[1]
        out[:, :count] = self.nuisance_columns
        # The discretisation correction of a weight's force also acts through the effects.
        through = [count - 1] if self.fits_discretization and like.terms else []
        for index in (*through, *range(count, len(vector) - states)):
            step = 1e-3 * max(1.0, abs(vector[index]))
            if vector[index] + step > high[index]:
                step = -step
            moved = vector.copy()
            moved[index] += step
            own = self.nuisance_columns[:, index] if index < count else 0.0
            out[:, index] = own + (self.change(self.hypothesis(moved, like)) - here) / step
        self._state_columns(out, vector, like, here, len(vector) - states)
        return out

    def _state_columns(
        self, out: Array, vector: Array, like: Hypothesis, here: Array, first: int
    ) -> None:
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


class Coarse(ABC):
    """A regression on few samples, on which fits from several starting values begin."""

    def __init__(self, regression: Regression) -> None:
        self.regression = regression

    @abstractmethod
    def reduced(self, hypothesis: Hypothesis) -> Hypothesis:
        """Hypothesis of the coarse regression for one of the whole regression."""

    @abstractmethod
    def extended(self, hypothesis: Hypothesis) -> Hypothesis:
        """Hypothesis of the whole regression for one of the coarse regression."""
