"""What the data determine of an equivalence set, and of correlated parameters."""

from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Array, Ride, engine_for, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.conditioning import ValueCovariance, value_covariance
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.verdict.combination import combination_of_set, combination_of_term
from winchkit.fit_statistics import correlations_of

DATASET = prepare([made(0, GROOVED, ride=Ride(samples=200))], GROOVED)


def test_radius_and_ratio_have_one_cable_per_motor_turn() -> None:
    """On a grooved drum a turn of the helix, by Pythagoras, whichever of the two is first."""
    radius = term("drum-radius", radius_error=3e-4)
    turn = hypot(2 * pi * 0.0603, 0.005) / 20.4
    ratio = term("gear-ratio", ratio_error=hypot(2 * pi * 0.06, 0.005) / 20.4 / turn - 1)
    values = {
        "drum-radius": {"radius_error": Estimate(3e-4, 3e-6, "m")},
        "gear-ratio": {"ratio_error": Estimate(ratio.values["ratio_error"], 5e-5, "1")},
    }
    for terms in ((radius, ratio), (ratio, radius)):
        found = combination_of_set(terms, values, DATASET)
        assert found is not None
        assert (found.name, found.unit) == ("cable per motor turn", "m")
        assert found.value == pytest.approx(turn, rel=1e-6)
        assert found.std == pytest.approx(turn * 5e-5, rel=0.02)


def test_parameters_of_unlike_units_have_no_combination() -> None:
    terms = (term("cell-gain", gain_error=0.02), term("cell-offset", offset=4.0))
    values = {
        "cell-gain": {"gain_error": Estimate(0.02, 0.001, "1")},
        "cell-offset": {"offset": Estimate(4.0, 0.3, "N")},
    }
    assert combination_of_set(terms, values, DATASET) is None
    radius = term("drum-radius", radius_error=3e-4)
    alone = {"drum-radius": {"radius_error": Estimate(3e-4, 3e-6, "m")}}
    assert combination_of_set((radius,), alone, DATASET) is None


def test_correlated_parameters_have_the_direction_of_least_variance() -> None:
    """Of u = (a/s + b/t)/√2 the variance is 1 + ρ, the other direction has 1 − ρ."""
    guide = term("guide-offset", offset=0.01, mismatch=0.002)
    s, t, rho = 1e-3, 1e-4, -0.98
    matrix = np.array([[s * s, rho * s * t], [rho * s * t, t * t]])
    names = ("guide-offset.offset", "guide-offset.mismatch")
    found = combination_of_term(guide, ValueCovariance(names, matrix, 10.0))
    assert found is not None
    assert found.name == "offset + 10 · mismatch"
    assert found.value == pytest.approx(0.03)
    assert found.std == pytest.approx(s * np.sqrt(2 * (1 + rho)))
    weak = np.diag([s * s, t * t])
    assert combination_of_term(guide, ValueCovariance(names, weak, 1.0)) is None


def test_covariance_and_condition_are_those_of_the_whitened_derivatives() -> None:
    engine = engine_for((term("cell-gain", gain_error=0.01),), Ride())
    hypothesis = engine.initial_model
    for added in (term("cell-gain", gain_error=0.01), term("cell-offset", offset=1.0)):
        hypothesis = hypothesis.with_term(added, engine.regression.n_runs)
    fitted, noise = engine.fit_with_noise(hypothesis)
    covariance = value_covariance(engine.regression, fitted, noise)
    assert covariance.names[-2:] == ("cell-gain.gain_error", "cell-offset.offset")
    whitened = fitted.jacobian * noise.inverse_sigma(engine.regression)[:, None]
    # Coordinates are values over typical sizes.
    sizes: Array = np.ones(len(fitted.vector))
    sizes[-2:] = 0.01, 5.0
    expected = np.linalg.inv(whitened.T @ whitened) * np.outer(sizes, sizes)
    assert covariance.matrix == pytest.approx(expected, rel=1e-6)
    scaled = whitened / np.linalg.norm(whitened, axis=0)
    assert covariance.condition == pytest.approx(np.linalg.cond(scaled), rel=1e-6)
    pair = correlations_of(covariance.names, covariance.matrix)[0]
    assert {pair.a, pair.b} == {"cell-gain.gain_error", "cell-offset.offset"}
    assert pair.value == pytest.approx(
        expected[-1, -2] / np.sqrt(expected[-1, -1] * expected[-2, -2]), rel=1e-6
    )
