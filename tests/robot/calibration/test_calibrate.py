"""The CABTIVE robot calibrated on poses that another geometry made (the paper's Tables 2 to 7)."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from calibration_cases import EXACT, held, measured, robot, rows, true_values, with_turns
from robot_poses.truth import Noise, Truth, csv
from winchkit.robot import robot_of, rotation_of, structure_matrix
from winchkit.robot.calibration.calibrate import Calibrated, calibrate, split
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.pose_design import next_poses
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.files.poses import MeasuredPoses, joined
from winchkit.schema.profiles.robot import PriorSpec

NO_BOUNDS = {
    "exit_point": PriorSpec(5e-3),
    "anchor_point": PriorSpec(5e-3),
    "winding_radius": PriorSpec(5e-4),
    "swivel_radius": PriorSpec(4e-4),
    "layer_growth": PriorSpec(4e-5),
}


@pytest.fixture(scope="module")
def paper() -> Calibrated:
    """Ninety poses, positions alone."""
    return calibrate(robot(), measured(csv(rows())), held())


def improved(found: Calibrated) -> float:
    """Held-out position error after over before."""
    return rms(found.validation_after.distance) / rms(found.validation_before.distance)


def test_poses_not_fitted_are_predicted_within_the_tracker_noise(paper: Calibrated) -> None:
    assert paper.solution.converged
    # The paper's 1.6 mm before calibration, at a box of about that size.
    assert 1.3e-3 < rms(paper.validation_before.distance) < 2.2e-3
    assert rms(paper.validation_after.distance) < 2e-5
    assert rms(paper.validation_after.angle) < np.radians(0.05)
    assert paper.observed.rank == 65
    assert paper.observed.unobservable == ()
    assert paper.candidates == ()


def test_the_truth_lies_within_its_uncertainty() -> None:
    unbound = robot_of(replace(robot().profile, prior=NO_BOUNDS))
    found = calibrate(unbound, measured(csv(rows())), held())
    truth = true_values()
    assert set(found.estimates) == set(truth)
    off = [(e.value - truth[name]) / e.std for name, e in found.estimates.items()]
    assert np.max(np.abs(off)) < 5.0
    # Truth was drawn by no prior of five millimetres, but it is not to be taken for certain.
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 2.0


def test_noise_of_the_instruments_is_found_from_the_poses_alone(paper: Calibrated) -> None:
    assert paper.weights.sigma["position"] == pytest.approx(2e-5, rel=0.25)
    assert paper.weights.sigma["closure"] == pytest.approx(6e-6, rel=0.25)


def test_a_bound_is_kept_and_reported(paper: Calibrated) -> None:
    # Three true winding radii are 59 mm, which is the bound in the robot's file.
    held_at = {name for name, e in paper.estimates.items() if e.bound}
    assert held_at <= {f"{i}.winding_radius" for i in (1, 2, 4)} | {"layer_growth"}
    for name in held_at:
        estimate = paper.estimates[name]
        assert estimate.value == (estimate.parameter.low if estimate.bound == "low" else np.nan)
        assert any(name in warning for warning in paper.warnings)
    assert held_at


@pytest.mark.parametrize("seed", range(3))
def test_starts_ten_millimetres_off_all_converge(seed: int) -> None:
    rng, truth = random.Random(seed), Truth()
    lines = []
    for i, line in enumerate(robot().profile.line):
        x, y, z = (value + rng.uniform(-0.01, 0.01) for value in truth.exit[i])
        a, b, c = (value + rng.uniform(-0.01, 0.01) for value in truth.anchor[i])
        lines.append(replace(line, exit_point=(x, y, z), anchor_point=(a, b, c)))
    off = robot_of(replace(robot().profile, line=tuple(lines)))
    found = calibrate(off, measured(csv(rows())), held())
    assert rms(found.validation_before.distance) > 1e-3
    assert rms(found.validation_after.distance) < 3e-5


def test_without_rotation_exit_and_anchor_points_are_reported_as_one() -> None:
    found = calibrate(robot(), measured(csv(rows(90, 3, tilt=0.0))), held())
    assert found.observed.rank == 41
    (words,) = found.observed.unobservable
    assert "no rotation in the data" in words
    assert "24 directions" in words
    spread = found.estimates["1.exit_point.x"].std
    assert spread > 2e-3


def test_within_one_layer_growth_and_radii_are_reported_as_one() -> None:
    turns = replace(Truth(), turns=4.5)
    fit = measured(csv(rows(90, 1, box=0.03, truth=turns)))
    judged = measured(csv(rows(20, 2, box=0.03, truth=turns, noise=EXACT)))
    found = calibrate(with_turns(4.5), fit, judged)
    assert found.observed.rank == 64
    (words,) = found.observed.unobservable
    assert "one layer" in words
    assert rms(found.validation_after.distance) < 3e-5


def test_a_robot_without_a_tracker_calibrates_itself() -> None:
    found = calibrate(robot(), measured(csv(rows(), position=False)), held())
    assert found.observed.rank == 62
    assert any("measure positions" in words for words in found.observed.unobservable)
    assert np.isnan(rms(found.fit_after.distance))
    assert improved(found) < 0.7
    assert rms(found.validation_after.angle) < rms(found.validation_before.angle) / 5


@pytest.mark.parametrize("what", ["angles", "swivel", "length"])
def test_whatever_is_measured_beside_motor_angles_is_used(what: str) -> None:
    plain = calibrate(robot(), measured(csv(rows(), position=False)), held())
    text = csv(rows(), position=False, **{what: True})
    found = calibrate(robot(), measured(text), held())
    both = [
        np.sum(np.log([e.std for name, e in c.estimates.items() if name in plain.estimates]))
        for c in (found, plain)
    ]
    assert both[0] < both[1]
    assert improved(found) < 0.7


def test_swivel_angles_and_lengths_need_no_zero_of_their_instruments() -> None:
    found = calibrate(robot(), measured(csv(rows(), swivel=True, length=True)), held())
    assert rms(found.validation_after.distance) < 2e-5
    for i in range(8):
        zero = found.estimates[f"{i + 1}.swivel_zero"]
        # The generator's axis of zero is x; 0.3 rad a line less 1 is its instruments' own.
        assert abs(np.remainder(zero.value - (0.3 * i - 1) + np.pi, 2 * np.pi) - np.pi) < 0.05
        offset = found.estimates[f"{i + 1}.length_offset"]
        assert offset.value == pytest.approx(0.01 * i, abs=3e-3)
    assert found.observed.free == 65


def test_any_mix_of_missing_values_is_no_obstacle() -> None:
    full = measured(csv(rows(), angles=True, swivel=True))
    rng = np.random.default_rng(4)

    def holed(values: np.ndarray, share: float) -> np.ndarray:
        return np.where(rng.uniform(size=values.shape) < share, np.nan, values)

    seen = np.where(rng.uniform(size=(90, 1)) < 0.5, np.nan, full.position)
    fit = replace(
        full,
        position=seen,
        angles=holed(full.angles, 0.5),
        swivel=holed(full.swivel, 0.5),
        motor_angle=holed(full.motor_angle, 0.02),
    )
    found = calibrate(robot(), fit, held())
    assert found.solution.converged
    assert rms(found.validation_after.distance) < 3e-5


def test_a_hanging_platform_of_four_cables_is_calibrated_too() -> None:
    """Four cables leave two degrees of freedom; with measured poses the fit is overdetermined."""
    profile = replace(robot().profile, line=robot().profile.line[:4], prior=NO_BOUNDS)
    full = measured(csv(rows(), angles=True))
    cut = {
        name: getattr(full, name)[:, :4]
        for name in ("motor_angle", "swivel", "cable_length", "tension")
    }
    fit = replace(full, **cut)
    found = calibrate(robot_of(profile), fit)
    truth = true_values()
    off = [(e.value - truth[name]) / e.std for name, e in found.estimates.items()]
    assert len(off) == 33
    assert np.max(np.abs(off)) < 4.5
    # A quarter of what the prior leaves open.
    assert found.estimates["1.exit_point.x"].std < 5e-3 / 3


def test_unmodelled_cable_noise_gets_less_weight() -> None:
    fit = measured(csv(rows(90, 7, noise=Noise(rope=4e-4))))
    found = calibrate(robot(), fit, held())
    assert found.weights.sigma["closure"] == pytest.approx(4e-4, rel=0.3)
    assert improved(found) < 0.3


def test_a_given_noise_is_not_estimated() -> None:
    found = calibrate(robot(), measured(csv(rows())), held(), Options(sigma={"position": 1e-3}))
    assert found.weights.sigma["position"] == 1e-3


def test_every_tenth_pose_is_held_out() -> None:
    fit, out = split(measured(csv(rows())))
    assert (len(fit), len(out)) == (81, 9)
    assert out.position[0].tolist() == list(rows()[9].seen_position)


def test_instruments_said_to_be_perfect_break_nothing() -> None:
    sigma = {"position": 1e-10, "closure": 1e-9}
    found = calibrate(robot(), measured(csv(rows())), held(), Options(sigma=sigma))
    assert rms(found.validation_after.distance) < 1e-4


def test_proposed_poses_say_more_than_poses_at_random() -> None:
    fit, out = split(measured(csv(rows(30, 1))))
    found = calibrate(robot(), fit, out)
    chosen = next_poses(found, 5)
    gains = [pose.gain for pose in chosen]
    assert gains == sorted(gains, reverse=True)
    assert gains[-1] > 0

    geometry = found.equations.geometry(found.values)
    for pose in chosen:
        place, turned = np.array([pose.position]), rotation_of(*np.array([pose.angles]).T)
        structure = structure_matrix(geometry, place, turned)[0]
        weight = np.array([0, 0, -3 * 9.80665, 0, 0, 0])
        assert nnls(structure, -weight)[1] < 1e-9, "cables that pull hold the platform"

    def volume(extra: MeasuredPoses) -> float:
        both = joined([fit, extra])
        again = calibrate(robot(), both, out, Options(sigma=found.weights.sigma))
        return float(np.sum(np.log2(1 + again.observed.information))) / 2

    proposed = [pose_row(tuple(p.position), tuple(p.angles)) for p in chosen]
    best = volume(measured(csv(proposed)))
    by_chance = [volume(measured(csv(rows(5, seed)))) for seed in (11, 12, 13)]
    assert best > max(by_chance)
    assert best - volume(fit[np.zeros(len(fit), dtype=bool)]) == pytest.approx(sum(gains), rel=0.25)


def pose_row(place: tuple[float, ...], angles: tuple[float, ...]):  # type: ignore[no-untyped-def]  # noqa: ANN201
    """What the true robot's instruments say at a pose."""
    from robot_poses.truth import Row, turn

    truth = Truth()
    roll, pitch, yaw = angles
    x, y, z = place
    motor = tuple(truth.motor_angle(i, (x, y, z), turn(roll, pitch, yaw), 0.0) for i in range(8))
    none = (0.0,) * 8
    return Row(
        (x, y, z), (roll, pitch, yaw), motor, (x, y, z), (roll, pitch, yaw), none, none, none
    )
