"""Effects that join a calibration by name: elastic cables, home lengths, the payload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibration_cases import EXACT, elastic_rows, held, measured, robot, rows
from robot_poses.truth import GRAVITY, HOME, Noise, Row, Truth, csv, turn
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.robot.calibration.calibrate import Calibrated, calibrate
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.files.poses import MeasuredPoses


@pytest.fixture(scope="module")
def elastic() -> tuple[MeasuredPoses, MeasuredPoses]:
    """Poses to fit and to judge by, of cables of 20 kN (0.5 mm of steel)."""
    fit = measured(csv(elastic_rows(90, 7), tension=True))
    return fit, measured(csv(elastic_rows(30, 77, EXACT), angles=True, tension=True))


def with_effects(data: tuple[MeasuredPoses, MeasuredPoses], *effects: str) -> Calibrated:
    return calibrate(robot(), *data, Options(effects))


def test_hidden_elasticity_is_explained_by_the_effect_and_by_nothing_else(
    elastic: tuple[MeasuredPoses, MeasuredPoses],
) -> None:
    without = with_effects(elastic)
    shifted = with_effects(elastic, "home-length")
    named = with_effects(elastic, "cable-elongation-linear")
    assert rms(without.validation_after.distance) > 3e-4
    assert rms(shifted.validation_after.distance) > 3e-4
    assert rms(named.validation_after.distance) < 2e-5
    # The fit without shows it: its cables seem a hundred times noisier than the encoders are.
    assert without.weights.sigma["closure"] > 3e-4
    assert named.weights.sigma["closure"] < 1e-5
    # And says what it lacks.
    shares = {c.effect: c.share for c in without.candidates}
    assert without.candidates[0].effect == "cable-elongation-linear"
    assert shares["cable-elongation-linear"] > 0.7
    assert shares.get("home-length", 0.0) < 0.5
    assert named.candidates == ()
    stiffness = named.estimates["cable-elongation-linear.axial_stiffness"]
    assert abs(stiffness.value - 2e4) < 4 * stiffness.std
    assert stiffness.std < 100
    assert np.isinf(stiffness.nominal)


@pytest.mark.parametrize("law", ["quartic", "exponential"])
def test_laws_that_bend_fit_a_straight_cable_too(
    elastic: tuple[MeasuredPoses, MeasuredPoses], law: str
) -> None:
    found = with_effects(elastic, f"cable-elongation-{law}")
    assert rms(found.validation_after.distance) < 3e-5


def test_cables_that_do_not_stretch_are_found_not_to() -> None:
    pulled = [replace(row, tension=tuple(30.0 + i for i in range(8))) for row in rows()]
    fit = measured(csv(pulled, tension=True))
    found = calibrate(robot(), fit, options=Options(("cable-elongation-linear",)))
    stiffness = found.estimates["cable-elongation-linear.axial_stiffness"]
    assert stiffness.value > 1e5 or np.isinf(stiffness.value)


def test_an_effect_that_needs_forces_says_so() -> None:
    with pytest.raises(UsageError, match="tension"):
        calibrate(robot(), measured(csv(rows())), held(), Options(("cable-elongation-linear",)))
    both = ("cable-elongation-linear", "cable-elongation-quartic")
    with pytest.raises(UsageError, match="laws of the same cable"):
        calibrate(robot(), measured(csv(rows())), held(), Options(both))


def pulls(row: Row, mass: float, centre: tuple[float, float, float], middle: float) -> Array:
    """Tensions nearest to ``middle`` that carry a payload, by virtual work on the generator's
    own lengths, (8,)."""
    truth, turned = Truth(), np.array(turn(*row.angles))
    slope = np.empty((6, 8))
    for k in range(6):
        ends = []
        for sign in (1, -1):
            place, spin = np.array(row.position), np.zeros(3)
            (place if k < 3 else spin)[k % 3] += sign * 1e-6
            x, y, z = place.tolist()
            first, second, third = (small(spin) @ turned).tolist()
            rotation = (tuple(first), tuple(second), tuple(third))
            ends.append([truth.length(i, (x, y, z), rotation) for i in range(8)])
        slope[k] = (np.array(ends[0]) - np.array(ends[1])) / 2e-6
    down = np.array([0.0, 0.0, -mass * GRAVITY])
    weight = np.concatenate([down, np.cross(turned @ np.array(centre), down)])
    start = np.full(8, middle)
    return np.asarray(start + np.linalg.pinv(slope) @ (weight - slope @ start))


def balanced(mass: float, centre: tuple[float, float, float], sigma: float) -> list[Row]:
    """Rows with the tensions that cells would show."""
    rng = np.random.default_rng(8)
    noisy = [(row, pulls(row, mass, centre, 60.0) + rng.normal(0, sigma, 8)) for row in rows()]
    return [replace(row, tension=tuple(pull.tolist())) for row, pull in noisy]


def stretched(found: tuple[Row, ...], stiffness: float) -> list[Row]:
    """Rows of cables that stretch under the profile's platform at 40 N, no cell beside them."""
    at_home = replace(found[0], position=HOME, angles=(0.0, 0.0, 0.0))
    begin = pulls(at_home, 3.0, (0.0, 0.0, 0.0), 40.0)
    out = []
    for row in found:
        pull = pulls(row, 3.0, (0.0, 0.0, 0.0), 40.0)
        angles = [
            Truth(stiffness=stiffness, home_tension=float(begin[i])).motor_angle(
                i, row.position, turn(*row.angles), float(pull[i])
            )
            for i in range(8)
        ]
        out.append(replace(row, motor_angle=tuple(angles)))
    return out


@pytest.mark.slow
def test_elasticity_is_found_without_cells_by_computed_forces() -> None:
    fit = measured(csv(stretched(rows(), 2e4)))
    judged = measured(csv(stretched(rows(20, 99, noise=EXACT), 2e4)))
    without = calibrate(robot(), fit, judged)
    options = Options(("cable-elongation-linear",), middle_force=40.0)
    named = calibrate(robot(), fit, judged, options)
    assert rms(without.validation_after.distance) > 6e-5
    assert rms(named.validation_after.distance) < 2e-5
    stiffness = named.estimates["cable-elongation-linear.axial_stiffness"]
    assert abs(stiffness.value - 2e4) < 4 * stiffness.std
    assert stiffness.std < 1e3


def small(spin: Array) -> Array:
    x, y, z = spin
    return np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def test_the_payload_is_weighed_by_the_cables() -> None:
    mass, centre = 3.6, (0.012, -0.008, 0.02)
    fit = measured(csv(balanced(mass, centre, 0.2), tension=True))
    found = calibrate(robot(), fit, held(), Options(("payload-mass", "payload-centre")))
    for name, true in (
        ("payload-mass.mass", mass),
        *((f"payload-centre.{axis}", value) for axis, value in zip("xyz", centre, strict=True)),
    ):
        estimate = found.estimates[name]
        assert abs(estimate.value - true) < 4 * estimate.std, name
    assert found.estimates["payload-mass.mass"].std < 0.05
    assert found.weights.sigma["balance"] == pytest.approx(0.2, rel=0.2)
    # The payload says nothing of the geometry.
    assert rms(found.validation_after.distance) < 2e-5


def test_a_home_length_is_found() -> None:
    slack = [
        replace(row, motor_angle=tuple(a - 0.03 * (i == 4) for i, a in enumerate(row.motor_angle)))
        for row in rows(noise=Noise())
    ]
    fit = measured(csv(slack))
    judged = measured(csv(rows(30, 99, noise=EXACT)))
    found = calibrate(robot(), fit, judged, Options(("home-length",)))
    lengths = [found.estimates[f"{i + 1}.home_length"].value for i in range(8)]
    spread = found.estimates["5.home_length"].std
    # 0.03 rad on a drum of about 62 mm.
    assert lengths[4] - np.median(lengths) == pytest.approx(-1.85e-3, abs=3 * spread + 2e-4)
