"""An inquiry into a robot's poses: folds of poses, and a noise that is known beforehand."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from winchkit.arrays import Array
from winchkit.diagnosis.regression.cross_validation import Folds
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import Noise, Presence
from winchkit.diagnosis.robot.candidates import lacking, lacking_parts
from winchkit.diagnosis.robot.errors import Shown, held_out_rms
from winchkit.diagnosis.robot.regression import RobotProblem
from winchkit.diagnosis.robot.variance_components import PoseNoise
from winchkit.diagnosis.selection.engine import Inquiry
from winchkit.effects.effect import Effect

__all__ = ["RobotInquiry"]

_GROUPS = 5
_BLOCKS = 24
_RUN_LEAST = 10


class RobotInquiry(Inquiry):
    """What stays the same through a search on poses."""

    loads_are_chosen = False  # Tensions are what the balance makes them, whatever the pose.

    def __init__(
        self,
        problem: RobotProblem,
        begin: Hypothesis,
        candidates: Iterable[Effect],
        noise: PoseNoise,
    ) -> None:
        self.robot_problem = problem
        self.pose_noise = noise
        super().__init__(problem, begin, candidates)

    @property
    def price(self) -> float:
        """Whitened squares that one degree of freedom must save."""
        return float(np.log(self.robot_problem.rows_of_poses))

    @cached_property
    def blocks(self) -> Folds:
        """Stretches of distinct poses, one after another."""
        pose = self.robot_problem.dataset.pose
        count = min(_BLOCKS, int(pose.max()) + 1)
        return self._folded((pose * count) // (int(pose.max()) + 1), count)

    @cached_property
    def groups(self) -> Folds:
        """Whole runs where there are several long ones, else every fifth distinct pose."""
        dataset = self.robot_problem.dataset
        sizes = np.bincount(dataset.measured.run)
        together = [set(dataset.pose[dataset.measured.run == n]) for n in range(len(sizes))]
        apart = sum(map(len, together)) == len(set().union(*together))
        if len(sizes) > 1 and sizes.min() >= _RUN_LEAST and apart:
            return self._folded(dataset.measured.run, len(sizes))
        return self._folded(dataset.pose % _GROUPS, _GROUPS)

    def held_out_errors(self, fitted: Fit, noise: Noise, folds: Folds) -> dict[str, float]:
        """Held-out error of rope lengths, the platform's position and tensions, rms in SI."""
        return held_out_rms(Shown(self.robot_problem, fitted, noise, folds))

    def lacking(self, effect: Effect) -> list[str]:
        """What poses would have to bring to show an effect, in words."""
        if not effect.on_robot:
            return ["a motion: poses stand still"]
        dataset = self.robot_problem.dataset
        return lacking(effect, dataset) or lacking_parts(effect, dataset)

    def folds(self, fitted: Fit, noise: Noise) -> Folds:
        """Poses say enough of everything that is common to all."""
        return self.groups

    def noise(self, residual: Array, jacobian: Array, states: int = 0) -> Noise:
        """Rows are whitened by what is known of the instruments."""
        bands = self.robot_problem.bands
        freedom = np.array([self.pose_noise.freedom.get(output, 1.0) for output, _, _ in bands])
        return Noise(
            power=np.ones(len(bands)),
            freedom=np.maximum(freedom, 1.0),
            rms=dict.fromkeys(self.robot_problem.dataset.outputs, 1.0),
            from_repeats=self.pose_noise.from_repeats,
        )

    def presence(self, present: Fit, noise: Noise) -> Presence:
        """F test of everything that is left against the noise of repeated poses."""
        problem = self.robot_problem
        count = len(problem.bands)
        if not noise.from_repeats:
            nothing = np.zeros(count)
            return Presence(float("nan"), nothing, nothing.astype(bool))
        bands, real = problem.band_of_row, problem.pose_of_row >= 0
        left, _ = np.linalg.qr(_independent(present.jacobian))
        taken = np.bincount(bands[real], np.sum(left**2, axis=1)[real], count)
        total = np.bincount(bands[real], present.residual[real] ** 2, count)
        freedom = np.maximum(np.bincount(bands[real], minlength=count) - taken, 1.0)
        p = np.asarray(f_distribution.sf(total / freedom, freedom, noise.freedom))
        worst = float(min(1.0, p.min() * count))
        return Presence(worst, total - freedom, p * count < 0.05)

    def _folded(self, fold_of_pose: NDArray[np.intp], count: int) -> Folds:
        """Folds of rows; copies of the prior are dealt out among them."""
        row = self.robot_problem.pose_of_row
        fold = np.where(row >= 0, fold_of_pose[np.maximum(row, 0)], (-1 - row) % count)
        return Folds(tuple(fold[s.rows] for s in self.problem.segments), count)


def _independent(columns: Array) -> Array:
    """Columns without those that are zero."""
    return columns[:, np.any(columns != 0, axis=0)]
