"""Regression problem of a robot's poses, the pose projected out.

The closure equations of every pose are whitened with the variance components, and projected on the
complement of the derivatives by the six coordinates of the pose, which is not known exactly (a
nuisance parameter per pose). Numbers of the geometry are nuisance parameters with a Gaussian prior:
the prior adds rows, five copies of each that are distributed over the folds.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
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
from winchkit.robot.diagnosis.adjustment import LinearizationPoint
from winchkit.robot.diagnosis.candidates import lacking, lacking_parts
from winchkit.robot.diagnosis.dataset import LEAST_POSES, RobotDataset
from winchkit.robot.forces.balance import force_basis
from winchkit.robot.geometry.constraints import ZERO_STD, mean_offset
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker
from winchkit.robot.identification.bundle_adjustment import BundleState
from winchkit.robot.identification.equations import KINDS, READING_OF

COPIES = 5
"""Rows per number with a prior, distributed over the folds."""
_GROUPS = 5
"""Folds of poses; convention: five-fold cross-validation."""
_BLOCKS = 24
"""Blocks of poses for the rank test; rule of thumb."""
_LEAST_SINGULAR_VALUE = 1e-9
"""Singular values of a pose's derivatives below this share of the largest are zero; numerical."""


class PoseRegression(Regression):
    """Regression of a robot's poses on the effects of a hypothesis."""

    def __init__(self, point: LinearizationPoint) -> None:
        self.point = point
        self.dataset: RobotDataset = point.dataset
        self.robot = point.robot()
        self._at_slope = point.robot(point.instruments) if point.instruments else self.robot
        self.equations = point.equations
        self._start: dict[str, Array] = {}
        self._start = self._residuals(point.state, self.robot)
        self._zeros = self._mean_zeros()
        self.posed = [k for k in KINDS if k in self._start and np.isfinite(self._start[k]).any()]
        self._project()
        free = [number.index for number in point.geometry]
        parameters = self.equations.parameters
        prior = (parameters.nominal - point.state.values)[free] / parameters.std[free]
        self._prior = np.tile(prior / np.sqrt(COPIES), COPIES)
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
        geometry = [f"{number.effect}.{number.parameter}" for number in self.point.geometry]
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
        return self._zeroed(self._residuals(self.point.state, self.point.robot(terms)))

    def _zeroed(self, residuals: dict[str, Array]) -> dict[str, Array]:
        return residuals | {kind: residuals[kind] + zero for kind, zero in self._zeros.items()}

    def _residuals(self, state: BundleState, robot: Robot) -> dict[str, Array]:
        """Residuals by kind, with the tensions in one basis for all hypotheses."""
        kinds = KINDS if self.dataset.hangs else tuple(READING_OF)
        if self._start and robot.tracker is None and self.robot.tracker is None:
            # Poses and their readings are the same.
            kinds = tuple(kind for kind in kinds if kind not in ("position", "rotation"))
        whiten = self._force_basis[0] if self.dataset.has_balance else None
        return self._start | self.equations.residuals(state, robot, kinds, whiten)

    @cached_property
    def _force_basis(self) -> tuple[Array, Array]:
        to_forces, to_cables = force_basis(self.robot.structure(self.point.pose))
        if self.dataset.moves:
            # Guides carry the other wrenches of a planar robot at every pose.
            carried = np.isfinite(to_forces).any(axis=(0, 2))
            to_forces, to_cables = to_forces[:, carried], to_cables[..., carried]
            turn = continuous(to_cables)
            return np.swapaxes(turn, 1, 2) @ to_forces, to_cables @ turn
        return to_forces, to_cables

    @property
    def to_cables(self) -> Array:
        """From whitened forces to the least change of cable forces, (p, n, k)."""
        return self._force_basis[1]

    def at(self, hypothesis: Hypothesis) -> dict[str, Array]:
        """Residuals of a hypothesis with the geometry moved by its nuisance parameters, SI."""
        free = [number.index for number in self.point.geometry]
        first = self.nuisance_columns.shape[1] - len(free)
        values = self.point.state.values.copy()
        if hypothesis.nuisances:
            moved_by = np.array(hypothesis.nuisances[first:])
            values[free] += moved_by * self.equations.parameters.std[free]
        moved = replace(self.point, state=BundleState(values, self.point.pose))
        found = self._residuals(moved.state, moved.robot(hypothesis.terms))
        found = self._zeroed(found)
        for kind in self._zeros:
            # A zero is the mean reading beyond the model; the fit's own differs by its noise.
            found[kind] = found[kind] + mean_offset(found[kind], angles=kind == "swivel")
        return found

    def _mean_zeros(self) -> dict[str, Array]:
        """Mean readings of swivels and length instruments with an unknown zero, (n,) by kind."""
        block = self.equations.parameters.block
        unknown = {"swivel": "swivel_zero", "cable_length": "length_offset"}
        return {
            kind: mean_offset(self._start[kind], angles=kind == "swivel")
            for kind, name in unknown.items()
            if name in block
        }

    def in_time(self, rows: Array) -> list[Array]:
        """Rows of each segment: poses have no time."""
        return [rows[s.rows] for s in self.segments]

    @cached_property
    def slope(self) -> dict[str, Array]:
        """Derivatives of the residuals by the pose, (p, k, 6), by kind that was measured."""
        found = self.equations.constraints(self.point.state, self._at_slope)
        return {kind: constraint.by_pose for kind, constraint in found}

    @property
    def tracker(self) -> Tracker | None:
        """Tracker at which the derivatives by the pose are taken."""
        return self._at_slope.tracker

    def _project(self) -> None:
        """Orthonormal basis of the complement of the pose's derivatives, per pose."""
        sigma, by = self.point.sigma, self.slope
        known = np.concatenate([np.isfinite(self._start[k]) for k in self.posed], axis=1)
        slope = np.concatenate([by[k] / sigma[k] for k in self.posed], axis=1)
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
        white = np.concatenate([residuals[k] / sigma[k] for k in self.posed], axis=1)
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
        """Columns of the instruments' zero offsets, then of the geometry in standard deviations of
        its prior."""
        columns = []
        for kind in self._zeros:
            for i in range(len(self.dataset.names)):
                moved = {k: np.zeros_like(v) for k, v in self._start.items()}
                moved[kind][:, i] = ZERO_STD[kind]
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
        """Change of the residuals by one standard deviation of each number of the geometry; its
        influence on the forces is updated with the linearisation point."""
        nothing = {kind: np.zeros_like(values) for kind, values in self._start.items()}
        by_values = {
            rows.kind: rows.by_values * self.equations.parameters.std
            for rows in self.equations.rows(self.point.state)
            if rows.by_values is not None and rows.kind in nothing
        }
        return [
            nothing | {kind: part[..., number.index] for kind, part in by_values.items()}
            for number in self.point.geometry
        ]


def continuous(basis: Array) -> Array:
    """Rotations (p, k, k) that turn each basis (p, m, k) within its subspace to be nearest to that
    of the middle sample (orthogonal Procrustes problem), so that the rows of a trajectory have a
    spectrum."""
    left, _, right = np.linalg.svd(np.swapaxes(basis, 1, 2) @ basis[len(basis) // 2])
    return np.asarray(left @ right)
