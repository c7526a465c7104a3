"""Selection engines of a robot: poses with the noise of the instruments, and trajectories."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import smoothed
from winchkit.diagnosis.regression.base import Folds
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import BAND_LEVEL, LackOfFitTest
from winchkit.diagnosis.regression.noise import BandNoise, noise_saturated
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.effects.effect import Effect
from winchkit.effects.placement import base_of
from winchkit.robot.diagnosis.candidates import BALANCING
from winchkit.robot.diagnosis.errors import FittedModel, held_out_rms
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.diagnosis.trajectory_regression import TrajectoryRegression
from winchkit.robot.identification.variance_components import PoseNoise


class PoseSelection(SelectionEngine):
    """Selection among hypotheses on a robot's poses."""

    regression: PoseRegression

    def __init__(
        self,
        regression: PoseRegression,
        initial_model: Hypothesis,
        candidates: Iterable[Effect],
        noise: PoseNoise,
    ) -> None:
        self.pose_noise = noise
        super().__init__(regression, initial_model, candidates)

    def noise(self, residual: Array, jacobian: Array, states: int = 0) -> BandNoise:
        """Unit variance: rows are whitened with the variance components."""
        bands = self.regression.bands
        dof = np.array([self.pose_noise.dof.get(output, 1.0) for output, _, _ in bands])
        return BandNoise(
            power=np.ones(len(bands)),
            dof=np.maximum(dof, 1.0),
            rms=dict.fromkeys(self.regression.outputs, 1.0),
            from_repeats=self.pose_noise.from_repeats,
        )

    def held_out_errors(self, fitted: Fit, noise: BandNoise, folds: Folds) -> dict[str, float]:
        """Held-out rms error of cable lengths, platform position and tensions, SI."""
        return held_out_rms(FittedModel(self.regression, fitted, noise))

    def _choose_folds(self, fitted: Fit, noise: BandNoise) -> Folds:
        """Groups of poses: every unknown is common to all of them."""
        return self.regression.groups

    def _test_lack_of_fit(self, present: Fit, noise: BandNoise) -> LackOfFitTest:
        """F test of the residual sum of squares against the variance from repeated poses."""
        regression = self.regression
        count = len(regression.bands)
        if not noise.from_repeats:
            return LackOfFitTest(float("nan"), np.zeros(count, bool))
        bands, real = regression.band_of_row, regression.pose_of_row >= 0
        left, _ = np.linalg.qr(_independent(present.jacobian))
        taken = np.bincount(bands[real], np.sum(left**2, axis=1)[real], count)
        total = np.bincount(bands[real], present.residual[real] ** 2, count)
        dof = np.maximum(np.bincount(bands[real], minlength=count) - taken, 1.0)
        p = np.asarray(fdtrc(dof, noise.dof, total / dof))
        worst = float(min(1.0, p.min() * count))
        return LackOfFitTest(worst, p * count < BAND_LEVEL)


class TrajectorySelection(PoseSelection):
    """Selection among hypotheses on a robot's trajectory, whose noise has a spectrum."""

    regression: TrajectoryRegression

    def noise(self, residual: Array, jacobian: Array, states: int = 0) -> BandNoise:
        """Variance by frequency band beside all candidates; that of the prior's rows is one."""
        columns = np.array(self.signatures.columns)
        tension = self.regression.rows_of({"tension"})
        for candidate in self.signatures.candidates:
            if base_of(candidate.effect) not in BALANCING:
                for rows in tension:
                    columns[rows, candidate.columns] = 0.0
        found = noise_saturated(self.regression, residual, jacobian, columns)
        power, dof = found.power.copy(), found.dof.copy()
        prior = self.regression.prior_band
        for output in self.regression.outputs:
            own = np.array([band[0] == output for band in self.regression.bands]) & ~prior
            power[own], dof[own] = smoothed(power[own], dof[own], order=1)
        power[prior] = 1.0
        return replace(found, power=power, dof=dof)


def _independent(columns: Array) -> Array:
    """Columns without those that are zero."""
    return columns[:, np.any(columns != 0, axis=0)]
