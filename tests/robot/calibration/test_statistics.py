"""Statistics of a calibration against dense least squares of all poses and parameters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from calibration_cases import held, measured, robot, rows
from robot_poses.truth import csv
from winchkit.arrays import Array
from winchkit.fit_statistics import FitStatistics
from winchkit.robot.calibration.calibrate import Calibrated, calibrate


@pytest.fixture(scope="module")
def found() -> Calibrated:
    return calibrate(robot(), measured(csv(rows())), held())


@pytest.fixture(scope="module")
def statistics(found: Calibrated) -> FitStatistics:
    return found.statistics


def dense(found: Calibrated) -> tuple[Array, Array]:
    """Derivatives by the parameters and by all poses at once, with the priors, and residuals."""
    stack, free = found.solution.linear.stack, found.equations.parameters.free
    by_values, prior = stack.by_values[:, :, free], found.solution.linear.prior[free]
    poses, equations, count = by_values.shape
    by_pose = np.zeros((poses, equations, poses, 6))
    for pose in range(poses):
        by_pose[pose, :, pose] = stack.by_pose[pose]
    matrix = np.hstack(
        [by_values.reshape(poses * equations, count), by_pose.reshape(poses * equations, 6 * poses)]
    )
    known = stack.known.ravel()
    priors = np.hstack([np.eye(count), np.zeros((count, 6 * poses))])
    return (
        np.vstack([matrix[known], priors]),
        np.concatenate([stack.residual.ravel()[known], prior]),
    )


def test_degrees_of_freedom_and_chi_square_are_those_of_the_dense_problem(
    found: Calibrated, statistics: FitStatistics
) -> None:
    matrix, residual = dense(found)
    rank = int(np.linalg.matrix_rank(matrix))
    assert (statistics.n_observations, statistics.n_unknowns) == (len(residual), rank)
    assert statistics.dof == len(residual) - rank
    assert statistics.chi_square == pytest.approx(float(residual @ residual), rel=1e-9)
    assert statistics.aic == pytest.approx(statistics.chi_square + 2 * rank)
    low, high = chi2(statistics.dof).interval(1 - 1e-6)
    assert low < statistics.chi_square < high


def test_deviations_and_correlations_are_those_of_the_dense_problem(
    found: Calibrated, statistics: FitStatistics
) -> None:
    matrix, _ = dense(found)
    free = [p for p in found.equations.parameters if p.std > 0]
    names, count = [p.name for p in free], len(free)
    covariance = np.linalg.inv(matrix.T @ matrix)[:count, :count]
    by_name = {parameter.name: parameter for parameter in statistics.parameters}
    for index, name in enumerate(names):
        expected = float(np.sqrt(covariance[index, index]) * free[index].std)
        assert by_name[name].std == pytest.approx(expected, rel=1e-3)
    pair = statistics.correlations[0]
    a, b = names.index(pair.a), names.index(pair.b)
    expected = covariance[a, b] / np.sqrt(covariance[a, a] * covariance[b, b])
    assert pair.value == pytest.approx(expected, abs=1e-3)
    sizes = [abs(each.value) for each in statistics.correlations]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] > 0.5


def test_a_value_has_its_nominal_its_interval_and_the_range_of_its_prior(
    found: Calibrated, statistics: FitStatistics
) -> None:
    name = "1.exit_point.x"
    parameter = next(p for p in statistics.parameters if p.name == name)
    prior = next(p for p in found.equations.parameters if p.name == name)
    assert parameter.initial == prior.nominal
    assert parameter.interval == pytest.approx(
        (parameter.value - 1.96 * parameter.std, parameter.value + 1.96 * parameter.std), abs=1e-7
    )
    assert parameter.plausible == pytest.approx(
        (prior.nominal - 1.96 * prior.std, prior.nominal + 1.96 * prior.std), abs=1e-6
    )
    assert "1.exit_point.x:" in found.fit_report()
    table = pytest.importorskip("pandas") and found.to_pandas()
    assert table.loc[name, "value"] == parameter.value
