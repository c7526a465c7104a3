"""Regression problem of a robot's poses, the pose projected out.

The closure equations of every pose are whitened with the variance components, and projected on the
complement of the derivatives by the six coordinates of the pose, which is not known exactly (a
nuisance parameter per pose). Numbers of the geometry are nuisance parameters with a Gaussian prior:
the prior adds rows, five copies of each that are distributed over the folds.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.diagnosis.data.spectrum import Band
from winchkit.diagnosis.regression.base import Folds, Regression, Segment
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.effects.effect import Effect
from winchkit.effects.term import Term
from winchkit.model.stages import At, Stage
from winchkit.robot.diagnosis.adjustment import STD_OF_ZERO, instrument_zeros
from winchkit.robot.diagnosis.candidates import lacking, lacking_parts
from winchkit.robot.diagnosis.data.dataset import LEAST_POSES, RobotDataset
from winchkit.robot.diagnosis.equations import POSED, Equations
from winchkit.robot.diagnosis.prior import GeometryPrior, profile_with_geometry
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.geometry.constraints import mean_offset
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker
from winchkit.schema.profiles.robot import RobotProfile

COPIES = 5
"""Rows per number with a prior, distributed over the folds."""
_GROUPS = 5
"""Folds of poses; convention: five-fold cross-validation."""
_BLOCKS = 24
"""Blocks of poses for the rank test; rule of thumb."""
_LEAST_SINGULAR_VALUE = 1e-9
"""Singular values of a pose's derivatives below this share of the largest are zero; numerical."""


@dataclass(frozen=True)
class LinearizationPoint:
    """Values at which a pose regression is linearised.

    Attributes
    ----------
    dataset : RobotDataset
        Poses of one robot.
    pose : Pose
        Estimated pose of the platform in every row.
    sigma : mapping of str to float
        Standard deviation per type of measurement, SI.
    geometry : tuple of GeometryPrior
        Numbers of the geometry that are nuisance parameters.
    instruments : tuple of Term
        Effects of the tracker at which the derivatives by the pose are taken.
    """

    dataset: RobotDataset
    pose: Pose
    sigma: Mapping[str, float]
    geometry: tuple[GeometryPrior, ...] = ()
    instruments: tuple[Term, ...] = ()

    @cached_property
    def profile(self) -> RobotProfile:
        """Robot profile with the geometry at its present values."""
        return profile_with_geometry(self.dataset.robot, self.geometry)

    def robot(self, terms: Sequence[Term] = ()) -> Robot:
        """Robot model with effects, at the present geometry."""
        return robot_with_terms(self.profile, terms)


class PoseRegression(Regression):
    """Regression of a robot's poses on the effects of a hypothesis."""

    def __init__(self, point: LinearizationPoint) -> None:
        self.point = point
        self.dataset: RobotDataset = point.dataset
        self.robot = point.robot()
        self._at_slope = point.robot(point.instruments) if point.instruments else self.robot
        self.equations = Equations(point.dataset, point.pose, self.robot)
        self._start = self.equations.residuals(self.robot)
        self._zeros = instrument_zeros(self._start, self.dataset)
        self._posed = [k for k in POSED if np.isfinite(self._start[k]).any()]
        self._project()
        prior = [-(b.value - b.at) / b.std for b in point.geometry]
        self._prior = np.tile(np.array(prior) / np.sqrt(COPIES), COPIES)
        self._number_rows()
        self._here = self._rows_of(self._start)
        self.nominal_residual = self._beside(self._here, self._prior)
        self.nuisance_columns = self._nuisances()

    def _number_rows(self) -> None:
        """Segments of the rows."""
        counts = [int(np.count_nonzero(keep)) for keep in self._keep.values()]
        Regression.__init__(self, self._segments(counts), n_runs=1)
        self._n_observations = sum(counts)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Kinds of equations: lengths and, where they were measured, tensions."""
        return self.dataset.outputs

    @cached_property
    def band_of_row(self) -> NDArray[np.intp]:
        """One band per output, shape (n_rows,)."""
        out = np.zeros(self.n_rows, dtype=np.intp)
        for index, segment in enumerate(self.segments):
            out[segment.rows] = index
        return out

    @property
    def bands(self) -> list[tuple[str, float, float]]:
        """One band per output, since poses have no frequency."""
        return [(s.output, 0.0, float("inf")) for s in self.segments]

    @property
    def power_floor(self) -> Array:
        """Lower limit of the variance of whitened rows, shape (n_bands,)."""
        return np.full(len(self.segments), 1e-12)

    @property
    def n_observations(self) -> int:
        """Number of rows without those of the prior."""
        return self._n_observations

    @property
    def n_priors(self) -> int:
        """Number of free numbers of the geometry."""
        return len(self.point.geometry)

    @property
    def nuisance_names(self) -> tuple[str, ...]:
        """Zero offsets of instruments, then numbers of the geometry in units of their prior."""
        geometry = [f"{item.term.effect.id}.{item.parameter}" for item in self.point.geometry]
        zeros = self.nuisance_columns.shape[1] - len(geometry)
        return (*(f"instrument zero {index + 1}" for index in range(zeros)), *geometry)

    def signal_rms(self, output: str) -> float:
        """NaN: rows are whitened; SI values are computed in ``robot/errors.py``."""
        return float("nan")

    def discretization_error(self, hypothesis: Hypothesis) -> Array:
        """Zero: poses are at rest."""
        return np.zeros(self.n_rows)

    def unfiltered(self) -> PoseRegression:
        """The regression itself: poses are not filtered."""
        return self

    @property
    def motions(self) -> tuple[At, ...]:
        """None: poses are at rest."""
        return ()

    def missing_needs(self, effect: Effect) -> list[str]:
        """Measurements and parts that an effect needs and that are absent, in words."""
        if not effect.places(moving=self.dataset.moves):
            return ["a motion: poses stand still"]
        missing = lacking(effect, self.dataset) or lacking_parts(effect, self.dataset)
        if not missing and not set(effect.outputs) & set(self.dataset.shown_outputs):
            missing = ["a measured " + " or ".join(effect.outputs)]
        return missing

    def excites(self, shape: Mapping[str, float]) -> bool:
        """True: effects on poses have no orders."""
        return True

    @property
    def replicates(self) -> tuple[Repeats, ...]:
        """None: repeats of poses are used for the variance components."""
        return ()

    @property
    def group_of_run(self) -> tuple[int, ...]:
        """All poses form one group."""
        return (0,)

    @cached_property
    def blocks(self) -> Folds:
        """Up to 24 contiguous blocks of distinct poses."""
        pose = self.dataset.pose
        count = min(_BLOCKS, int(pose.max()) + 1)
        return self._folded((pose * count) // (int(pose.max()) + 1), count)

    @cached_property
    def groups(self) -> Folds:
        """Runs, where several have at least ten poses of their own; else every fifth pose."""
        dataset = self.dataset
        sizes = np.bincount(dataset.measured.run)
        together = [set(dataset.pose[dataset.measured.run == n]) for n in range(len(sizes))]
        disjoint = sum(map(len, together)) == len(set().union(*together))
        if len(sizes) > 1 and sizes.min() >= LEAST_POSES and disjoint:
            return self._folded(dataset.measured.run, len(sizes))
        return self._folded(dataset.pose % _GROUPS, _GROUPS)

    def _folded(self, fold_of_pose: NDArray[np.intp], count: int) -> Folds:
        """Folds of rows; the copies of the prior are distributed over them."""
        row = self.pose_of_row
        fold = np.where(row >= 0, fold_of_pose[np.maximum(row, 0)], (-1 - row) % count)
        return Folds(tuple(fold[s.rows] for s in self.segments), count)

    @cached_property
    def pose_of_row(self) -> NDArray[np.intp]:
        """Row of the data set behind each row; −1 − copy for those of the prior, (n_rows,)."""
        own = [np.nonzero(keep)[0] for keep in self._keep.values()]
        copies = -1 - np.repeat(np.arange(COPIES), len(self.point.geometry))
        return np.concatenate([own[0], copies, *own[1:]])

    def fold_of_pose(self, folds: Folds) -> NDArray[np.intp]:
        """Fold of each row of the data set, (p,)."""
        row, fold = self.pose_of_row, np.concatenate(folds.of)
        out = np.zeros(len(self.dataset.measured), dtype=np.intp)
        out[row[row >= 0]] = fold[row >= 0]
        return out

    def n_samples(self, output: str) -> int:
        """Number of rows of an output without those of the prior, at least one."""
        return max(1, int(np.count_nonzero(self._keep[output])))

    def outputs_of(self, stage: Stage) -> set[str]:
        """All outputs: a longer cable moves the platform and with it every force."""
        return set(self.dataset.outputs)

    def change(self, hypothesis: Hypothesis, outputs: Container[str] | None = None) -> Array:
        """Change of the prediction by the effects, shape (n_rows,); always of all outputs."""
        if not hypothesis.terms:
            return np.zeros(self.n_rows)
        moved = self._rows_of(self.residuals(hypothesis.terms))
        return self._beside(self._here - moved, np.zeros_like(self._prior))

    def residuals(self, terms: Sequence[Term]) -> dict[str, Array]:
        """Model minus measurement by type of equation, zero offsets removed, SI."""
        return self.residuals_at(self.point, terms)

    def residuals_at(self, point: LinearizationPoint, terms: Sequence[Term]) -> dict[str, Array]:
        """The same at another linearisation point."""
        found = self.equations.residuals(point.robot(terms))
        return {kind: self._zeroed(kind, values) for kind, values in found.items()}

    def at(self, hypothesis: Hypothesis) -> dict[str, Array]:
        """Residuals of a hypothesis with the geometry moved by its nuisance parameters, SI."""
        geometry = self.point.geometry
        first = self.nuisance_columns.shape[1] - len(geometry)
        by = hypothesis.nuisances[first:] or (0.0,) * len(geometry)
        moved = tuple(b.moved(x) for b, x in zip(geometry, by, strict=True))
        found = self.residuals_at(replace(self.point, geometry=moved), hypothesis.terms)
        for kind in self._zeros:
            # A zero is the mean reading beyond the model; the fit's own differs by its noise.
            found[kind] = found[kind] + mean_offset(found[kind], angles=kind == "swivel")
        return found

    def in_time(self, rows: Array) -> list[Array]:
        """Rows of each segment: poses have no time."""
        return [rows[s.rows] for s in self.segments]

    def slope(self) -> dict[str, Array]:
        """Derivatives of the residuals by the pose."""
        return self.equations.by_pose(self._at_slope)

    @property
    def tracker(self) -> Tracker | None:
        """Tracker at which the derivatives by the pose are taken."""
        return self._at_slope.tracker

    def _zeroed(self, kind: str, values: Array) -> Array:
        return values + self._zeros[kind] if kind in self._zeros else values

    def _project(self) -> None:
        """Orthonormal basis of the complement of the pose's derivatives, per pose."""
        sigma, by = self.point.sigma, self.slope()
        known = np.concatenate([np.isfinite(self._start[k]) for k in self._posed], axis=1)
        slope = np.concatenate([by[k] / sigma[k] for k in self._posed], axis=1)
        slope = np.where(known[..., None], slope, 0.0)
        # Unmeasured coordinates get directions of their own, which are left out.
        left, size, _ = np.linalg.svd(slope, full_matrices=True)
        rank = np.sum(size > _LEAST_SINGULAR_VALUE * np.maximum(size[:, :1], 1e-300), axis=1)
        index = np.arange(slope.shape[1])
        self._basis = left
        keep = index >= rank[:, None]
        self._keep = {"cable_length": keep}
        for p in np.flatnonzero(~known.all(axis=1)):
            free = left[p][known[p]][:, keep[p]]
            own, singular_values, _ = np.linalg.svd(free, full_matrices=False)
            count = int(np.sum(singular_values > 0.5))
            self._basis[p] = 0.0
            place = np.ix_(np.flatnonzero(known[p]), np.arange(count))
            self._basis[p][place] = own[:, :count]
            keep[p] = index < count
        if "tension" in self.dataset.outputs:
            self._keep["tension"] = np.isfinite(self._start["tension"])

    def _projected(self, residuals: Mapping[str, Array]) -> dict[str, Array]:
        """Measured minus predicted, whitened and projected, (p, k) by output."""
        sigma = self.point.sigma
        white = np.concatenate([residuals[k] / sigma[k] for k in self._posed], axis=1)
        white = np.where(np.isfinite(white), white, 0.0)
        out = {"cable_length": -(np.swapaxes(self._basis, 1, 2) @ white[..., None])[..., 0]}
        if "tension" in self._keep:
            out["tension"] = -residuals["tension"] / sigma["tension"]
        return out

    def _rows_of(self, residuals: Mapping[str, Array]) -> Array:
        """Measured minus predicted, whitened and projected: closures, then tensions."""
        found = self._projected(residuals)
        return np.concatenate([found[output][keep] for output, keep in self._keep.items()])

    def _beside(self, rows: Array, prior: Array) -> Array:
        first = self._first_prior
        return np.concatenate([rows[:first], prior, rows[first:]])

    @property
    def _first_prior(self) -> int:
        """Number of rows before those of the prior."""
        return int(np.count_nonzero(self._keep["cable_length"]))

    def _segments(self, counts: Sequence[int]) -> list[Segment]:
        counts = [counts[0] + len(self._prior), *counts[1:]]
        ends = np.cumsum(counts).tolist()
        return [
            Segment(0, output, slice(end - count, end), Band(count, 1.0))
            for output, count, end in zip(self._keep, counts, ends, strict=True)
        ]

    def _nuisances(self) -> Array:
        """Columns of the instruments' zero offsets, then of the geometry.

        The unit of a geometry column is one standard deviation of its prior.
        """
        columns = []
        for kind in self._zeros:
            for i in range(len(self.dataset.names)):
                moved = {k: np.zeros_like(v) for k, v in self._start.items()}
                moved[kind][:, i] = STD_OF_ZERO[kind]
                column = -self._rows_of(moved)
                if np.any(column):
                    columns.append(self._beside(column, np.zeros_like(self._prior)))
        for index, change in enumerate(self.change_by_geometry()):
            column = -self._rows_of(change)
            held = np.zeros((COPIES, len(self.point.geometry)))
            held[:, index] = 1 / np.sqrt(COPIES)
            columns.append(self._beside(column, held.ravel()))
        return np.array(columns).reshape(len(columns), self.n_rows).T

    def change_by_geometry(self) -> list[dict[str, Array]]:
        """Change of the residuals by one standard deviation of each number of the geometry.

        Linear in the number; its influence on the forces is neglected and updated with the
        linearisation point.
        """
        by = self.equations.by_geometry(self.robot, self.point.geometry)
        nothing = {kind: np.zeros_like(values) for kind, values in self._start.items()}
        return [
            nothing | {kind: part[..., index] * item.std for kind, part in by.items()}
            for index, item in enumerate(self.point.geometry)
        ]
