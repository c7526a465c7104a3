"""Regression problem of a robot's trajectory: spectral coefficients of the equations over time.

The equations are those of poses, but residuals in consecutive samples are correlated: rows are
their discrete cosine transform over each run, whose variance is estimated by frequency band. The
projected equations have a continuous basis, so that they have a spectrum. Folds are contiguous
stretches of time.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import Band, band_edges, to_time
from winchkit.diagnosis.regression.base import Folds, Regression, Segment
from winchkit.robot.diagnosis.adjustment import LinearizationPoint
from winchkit.robot.diagnosis.regression import COPIES, PoseRegression, continuous
from winchkit.robot.identification.trajectory import SampledMotion

_BLOCKS = 24
"""Blocks of time for the rank test and the jackknife; as for poses."""
_GROUPS = 5
"""Stretches of time that are held out; convention: five-fold cross-validation."""


class TrajectoryRegression(PoseRegression):
    """Regression of a robot's trajectory; effects with memory start each run at zero."""

    @property
    def trajectory(self) -> SampledMotion:
        """Motion along the samples."""
        assert self.dataset.trajectory is not None
        return self.dataset.trajectory

    def _project(self) -> None:
        super()._project()
        keep = self._keep["cable_length"]
        # All samples have the same equations, and the same number of them is left.
        free = self._basis[:, :, keep.all(axis=0)]
        self._basis = free @ continuous(free)

    def _number_rows(self) -> None:
        found = self._projected(self._start)
        self._finite = {output: np.isfinite(values).any(axis=0) for output, values in found.items()}
        segments: list[Segment] = []
        at = 0
        for output in found:
            for run, rows in enumerate(self.trajectory.runs):
                count = rows.stop - rows.start
                band = Band(count, self._rate(rows))
                for _ in range(int(np.count_nonzero(self._finite[output]))):
                    segments.append(Segment(run, output, slice(at, at + count), band))
                    at += count
            if output == "cable_length":
                self._prior_start = at
                if len(self._prior):
                    prior = slice(at, at + len(self._prior))
                    segments.append(Segment(0, output, prior, Band(len(self._prior), 1.0)))
                    at = prior.stop
        Regression.__init__(self, segments, n_runs=0)
        self._n_observations = at - len(self._prior)

    def _rate(self, rows: slice) -> float:
        time = self.trajectory.time[rows]
        return (len(time) - 1) / float(time[-1] - time[0])

    @property
    def _first_prior(self) -> int:
        return self._prior_start

    def _is_prior(self, segment: Segment) -> bool:
        return len(self._prior) > 0 and segment.rows.start == self._prior_start

    def _rows_of(self, residuals: Mapping[str, Array]) -> Array:
        parts = []
        for output, values in self._projected(residuals).items():
            own = np.where(self.trajectory.valid[:, None], values[:, self._finite[output]], 0.0)
            own = np.nan_to_num(own)
            parts += [
                np.asarray(dct(own[rows], type=2, norm="ortho", axis=0)).T.ravel()
                for rows in self.trajectory.runs
            ]
        return np.concatenate(parts)

    def in_time(self, rows: Array) -> list[Array]:
        """Samples of each segment."""
        return [
            rows[s.rows] if self._is_prior(s) else to_time(rows[s.rows], s.band)
            for s in self.segments
        ]

    def n_samples(self, output: str) -> int:
        """Number of compared values of an output, at least one."""
        compared = int(np.count_nonzero(self.trajectory.valid))
        return max(1, compared * int(np.count_nonzero(self._finite[output])))

    @cached_property
    def _bands(self) -> tuple[NDArray[np.intp], list[tuple[str, float, float]]]:
        ids = np.zeros(self.n_rows, dtype=np.intp)
        bands: list[tuple[str, float, float]] = []
        for output in self.outputs:
            own = [s for s in self.segments if s.output == output and not self._is_prior(s)]
            longest = max(own, key=lambda s: s.band.count)
            edges = band_edges(longest.band.frequency, len(own))
            for segment in own:
                inside = np.searchsorted(edges, segment.band.frequency, side="right") - 1
                ids[segment.rows] = len(bands) + inside
            bands += [(output, max(0.0, float(low)), float(high)) for low, high in pairwise(edges)]
        # The band of the prior is the last one, whether or not it has rows.
        for segment in self.segments:
            if self._is_prior(segment):
                ids[segment.rows] = len(bands)
        return ids, [*bands, ("cable_length", 0.0, float("inf"))]

    @property
    def band_of_row(self) -> NDArray[np.intp]:
        """Noise band of every row, shape (n_rows,)."""
        return self._bands[0]

    @property
    def bands(self) -> list[tuple[str, float, float]]:
        """Output and frequency range in Hz of every noise band; the last one is the prior's."""
        return self._bands[1]

    @property
    def prior_band(self) -> NDArray[np.bool_]:
        """Which band is that of the prior."""
        return np.asarray(np.arange(len(self.bands)) == len(self.bands) - 1)

    @property
    def power_floor(self) -> Array:
        """Lower limit of the variance of whitened rows: the white part of the noise, (n_bands,)."""
        return np.ones(len(self.bands))

    @property
    def group_of_run(self) -> tuple[int, ...]:
        """All runs form one group."""
        return (0,) * len(self.trajectory.runs)

    @cached_property
    def blocks(self) -> Folds:
        """Up to 24 contiguous blocks of time, at least two per run."""
        share = max(2, round(_BLOCKS / len(self.trajectory.runs)))
        return self._of_time([share] * len(self.trajectory.runs))

    @cached_property
    def groups(self) -> Folds:
        """Runs where there are several, else five stretches of time."""
        count = len(self.trajectory.runs)
        return self._of_time([1] * count if count > 1 else [_GROUPS])

    def fold_of_pose(self, folds: Folds) -> NDArray[np.intp]:
        """Fold of each sample, (p,)."""
        out = np.zeros(len(self.trajectory.time), dtype=np.intp)
        for segment, own in zip(self.segments, folds.of, strict=True):
            if not self._is_prior(segment):
                out[self.trajectory.runs[segment.run]] = own
        return out

    def _of_time(self, counts: list[int]) -> Folds:
        """Folds of equal duration, some per run; copies of the prior are distributed over them."""
        first = np.cumsum([0, *counts])
        total, of = int(first[-1]), []
        for segment in self.segments:
            if self._is_prior(segment):
                copies = np.repeat(np.arange(COPIES), len(self._prior) // COPIES)
                of.append((copies * total // COPIES).astype(np.intp))
                continue
            sample = np.arange(segment.band.count)
            of.append(first[segment.run] + sample * counts[segment.run] // segment.band.count)
        return Folds(tuple(of), total)


def regression_at(point: LinearizationPoint) -> PoseRegression:
    """Regression of poses at rest, or of a trajectory."""
    return TrajectoryRegression(point) if point.dataset.moves else PoseRegression(point)
