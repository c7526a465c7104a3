"""Constraint equations, variance components and pose design shared by calibration and diagnosis."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from robot_poses.truth import Truth, csv, poses
from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.effects import Term, load_catalogue
from winchkit.robot import (
    Pose,
    Robot,
    gravity_wrench,
    robot_of,
    robot_with_terms,
    rotation_of,
    structure_matrix,
)
from winchkit.robot.calibration.calibrate import equations_of
from winchkit.robot.calibration.options import Options
from winchkit.robot.diagnosis.dataset import RobotDataset, prepare_poses
from winchkit.robot.forces.balance import force_basis
from winchkit.robot.geometry.constraints import mean_offset
from winchkit.robot.geometry.pose_estimation import Iteration, estimated_pose, moved_pose
from winchkit.robot.geometry.pose_estimation import start_pose as completed
from winchkit.robot.identification.bundle_adjustment import BundleState
from winchkit.robot.identification.equations import KINDS, RobotEquations
from winchkit.robot.identification.pose_design import (
    chosen_in_turn,
    determinant_gain,
    noncentrality,
    pose_information,
)
from winchkit.robot.identification.variance_components import re_estimated
from winchkit.runs import read_run
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.schema.read import read_robot


@lru_cache(maxsize=1)
def robot() -> Robot:
    return robot_of(read_robot(find("profiles", "cabtive")))


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> RobotDataset:
    """Twelve poses with every kind of measurement; two rotations measured in part."""
    rows = poses(Truth(), 12, 3, tension=lambda rng: rng.uniform(20.0, 60.0))
    path = tmp_path_factory.mktemp("poses") / "poses.csv"
    path.write_text(csv(rows, angles=True, swivel=True, length=True, tension=True))
    found = prepare_poses([read_run(path)], robot().profile)
    angles = found.measured.angles.copy()
    angles[0, 2], angles[1, 0] = np.nan, np.nan
    return replace(found, measured=replace(found.measured, angles=angles))


def equations(dataset: RobotDataset) -> tuple[RobotEquations, BundleState]:
    """Every kind of equation at poses a little off."""
    made = replace(equations_of(robot(), dataset.measured, Options()), balanced=True)
    rng = np.random.default_rng(4)
    pose = made.start(made.parameters.nominal)
    pose = moved_pose(pose, rng.normal(0, 1e-3, (len(dataset.measured), 6)))
    return made, BundleState(made.parameters.nominal, pose)


def test_lines_with_effects_have_the_lengths_of_the_winding_laws(dataset: RobotDataset) -> None:
    """Line by line by the model of a winch, against all lines at once."""
    made, state = equations(dataset)
    found = {kind: constraint.residual for kind, constraint in made.constraints(state)}
    assert tuple(found) == KINDS
    bare = made.residuals(state, made.robot_at(state.values), KINDS)
    terms = tuple(
        Term(e, e.null) for e in (load_catalogue()[n] for n in ("gear-ratio", "exit-point"))
    )
    effects = robot_with_terms(made.profile_at(state.values), terms)
    assert all(effects.modifiers)
    for kind, residual in made.residuals(state, effects, KINDS).items():
        np.testing.assert_allclose(bare[kind], found[kind], rtol=0, atol=1e-12)
        np.testing.assert_allclose(residual, found[kind], rtol=0, atol=1e-12)


def test_the_whitening_of_the_balance_is_that_of_cholesky_but_for_an_orthogonal_matrix(
    dataset: RobotDataset,
) -> None:
    made, state = equations(dataset)
    pose, geometry = state.pose, robot().geometry
    platform, tension = PlatformSpec(3.0, (0.01, 0.0, -0.02)), dataset.measured.tension
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    left = (structure @ tension[..., None])[..., 0] + gravity_wrench(platform, pose.rotation)
    factor = np.linalg.cholesky(structure @ np.swapaxes(structure, 1, 2))
    rows = np.linalg.solve(factor, left[..., None])[..., 0]
    changed = replace(robot(), platform=platform)
    np.testing.assert_allclose(
        np.sum(rows**2, axis=1),
        np.sum(made.residuals(state, changed, ["balance"])["balance"] ** 2, axis=1),
    )
    whiten, to_cables = force_basis(structure)
    whitened = whiten @ structure
    np.testing.assert_allclose(
        whitened @ np.swapaxes(whitened, 1, 2), np.tile(np.eye(6), (12, 1, 1)), atol=1e-10
    )
    np.testing.assert_allclose(whitened @ to_cables, np.tile(np.eye(6), (12, 1, 1)), atol=1e-10)


@pytest.mark.parametrize("share", [0.0, 1e-4])
def test_four_cables_keep_the_rows_that_they_carry(share: float) -> None:
    structure = np.zeros((1, 6, 4))
    structure[0, :4] = np.eye(4)
    # A platform near the middle of its frame: an error of its geometry would be kilonewtons.
    structure[0, 3, 3] = share
    whiten, to_cables = force_basis(structure)
    assert whiten.shape == (1, 4, 6)
    assert to_cables.shape == (1, 4, 4)
    assert np.isfinite(whiten[0]).all(axis=1).tolist() == [True, True, True, False]


@pytest.mark.parametrize("angles", [True, False])
def test_the_mean_offset_of_an_instrument_leaves_a_mean_of_zero(angles: bool) -> None:
    rng = np.random.default_rng(4)
    residual = 3.0 + rng.normal(0, 0.1, (50, 3))
    residual[::4, 1], residual[:, 2] = np.nan, np.nan
    offset = mean_offset(residual, angles=angles)
    assert abs(np.nanmean(residual[:, 0] + offset[0])) < 0.01
    assert abs(np.nanmean(residual[:, 1] + offset[1])) < 0.01
    assert offset[2] == 0.0
    if angles:
        turned = np.remainder(residual + 2 * np.pi - 1.0, 2 * np.pi) - np.pi
        shift = mean_offset(turned, angles=True)
        assert abs(np.nanmean(np.sin(turned[:, 0] + shift[0]))) < 0.01


def test_variance_components_of_two_kinds_converge_to_the_true_standard_deviations() -> None:
    """A linear model with a common part: the leverages decide how the squares are shared."""
    rng = np.random.default_rng(4)
    first, second = 400, 100
    columns = rng.normal(size=(first + second, 20))
    true = np.concatenate([np.full(first, 2.0), np.full(second, 0.1)])
    values = columns @ rng.normal(size=20) + true * rng.normal(size=first + second)
    sigma = {"a": 1.0, "b": 1.0}
    parts = {"a": slice(0, first), "b": slice(first, None)}
    for _ in range(30):
        weight = np.concatenate([np.full(first, 1 / sigma["a"]), np.full(second, 1 / sigma["b"])])
        basis, _ = np.linalg.qr(columns * weight[:, None])
        left = values * weight - basis @ (basis.T @ (values * weight))
        leverage = np.sum(basis**2, axis=1)
        found = {
            kind: re_estimated(
                sigma[kind], left[part], leverage[part], least_redundancy=8.0, least=1e-9
            )
            for kind, part in parts.items()
        }
        sigma = {kind: component.sigma for kind, component in found.items()}
    assert sigma["a"] == pytest.approx(2.0, rel=0.12)
    assert sigma["b"] == pytest.approx(0.1, rel=0.25)
    redundancy = found["a"].redundancy + found["b"].redundancy
    assert redundancy == pytest.approx(first + second - 20)


def test_a_kind_without_redundancy_keeps_its_standard_deviation() -> None:
    kept = re_estimated(0.3, np.ones(100), np.full(100, 0.99), least_redundancy=8.0, least=1e-9)
    assert kept.sigma == 0.3
    assert kept.redundancy == pytest.approx(1.0)


def test_a_start_is_completed_by_the_home_pose() -> None:
    home = Pose(np.array([[1.0, 2.0, 3.0]]), rotation_of(0.1, 0.2, 0.3)[None])
    position = np.array([[np.nan, 5.0, np.nan], [7.0, 8.0, 9.0]])
    angles = np.array([[np.nan, np.nan, np.nan], [np.nan, np.nan, 0.5]])
    found = completed(position, angles, home, np.ones(6))
    assert found.position.tolist() == [[1.0, 5.0, 3.0], [7.0, 8.0, 9.0]]
    np.testing.assert_array_equal(found.rotation[0], home.rotation[0])
    np.testing.assert_allclose(found.rotation[1], rotation_of(0.1, 0.2, 0.5), atol=1e-15)


def test_damping_slows_the_estimate_of_poses_and_does_not_bias_it() -> None:
    goal = np.array([[0.3, -0.2, 0.1, 0.0, 0.0, 0.0]])

    def whitened(pose: Pose) -> tuple[Array, Array]:
        residual = np.concatenate([pose.position, np.zeros((1, 3))], axis=1) - goal
        return residual, np.eye(6)[None]

    start = Pose(np.zeros((1, 3)), np.eye(3)[None])
    for damping in (0.0, 1.0):
        found = estimated_pose(whitened, start, Iteration(damping, 0.0, 1e-10, 100))
        np.testing.assert_allclose(found.position, goal[:, :3], atol=1e-9)


def test_the_determinant_gain_is_that_of_the_information_matrices() -> None:
    rng = np.random.default_rng(4)
    parts, information = rng.normal(size=(5, 3, 4)), np.diag([1.0, 2.0, 3.0, 4.0])
    gains = determinant_gain(parts, information)
    for gain, part in zip(gains, parts, strict=True):
        wider = np.linalg.slogdet(information + part.T @ part)[1]
        assert gain == pytest.approx(wider - np.linalg.slogdet(information)[1])


def test_the_noncentrality_is_what_a_least_squares_fit_leaves_of_the_column() -> None:
    rng = np.random.default_rng(4)
    rows = rng.normal(size=(30, 4))
    pose = rng.integers(0, 6, 30)
    information = pose_information(rows, pose, 6)
    left = rows[:, 0] - rows[:, 1:] @ np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)[0]
    assert float(noncentrality(information.sum(axis=0))) == pytest.approx(left @ left, rel=1e-6)


def test_candidates_are_chosen_by_gain_and_refused_ones_are_left_out() -> None:
    value = np.array([1.0, 5.0, 3.0, 4.0])
    chosen: list[tuple[int, float]] = []

    def add(index: int, gain: float) -> bool:
        if index == 3:
            return False
        chosen.append((index, gain))
        return True

    chosen_in_turn(4, 2, lambda: value, add)
    assert chosen == [(1, 5.0), (2, 3.0)]
    chosen_in_turn(4, 9, lambda: value, add)
    assert len(chosen) == 5
