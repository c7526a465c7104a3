"""Effects whose changes nearly cancel: no explanation, however small the residual."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.conditioning import collinearity
from winchkit.diagnosis.search import selection_engine
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
CATALOGUE = load_catalogue()
RATE, SECONDS = 50.0, 60.0


def run_of(reach: float) -> Run:
    """A slow motion of ``reach`` to either side under gravity and a spring, 1 N m and 1 N m/rad."""
    random = np.random.default_rng(0)
    time = np.arange(0.0, SECONDS, 1 / RATE)
    angle = 0.7 + reach * np.sin(2 * np.pi * time / 12.0)
    measured = np.sin(angle) + (angle - 0.2)
    measured += 1e-3 * random.normal(size=len(time))
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(measured, "N m")}
    return Run("move", time, channels, {})


@pytest.mark.parametrize("reach", [1.0, 0.1])
def test_it_is_the_variance_inflation_factor_of_least_squares(reach: float) -> None:
    """Of m g l sin(q + p) beside a spring with an offset: 1/(1 − R²), from the samples."""
    run = run_of(reach)
    engine = selection_engine(prepare([run], JOINT), CATALOGUE)
    hypothesis = engine.initial_model
    for name in ("joint-gravity", "spring-balancer"):
        hypothesis = hypothesis.with_term(Term(CATALOGUE[name], CATALOGUE[name].null), 1)
    fit, noise = engine.fit_with_noise(hypothesis)
    values = fit.hypothesis.terms[0].values
    angle = run["motor_angle"]
    gravity = values["amplitude"] * np.sin(angle + values["phase"])
    others = np.column_stack([np.ones_like(angle), angle])
    fitted, *_ = np.linalg.lstsq(others, gravity, rcond=None)
    expected = np.sum(gravity**2) / np.sum((gravity - others @ fitted) ** 2)
    even = type(noise)(np.ones_like(noise.power), noise.dof, noise.rms, from_repeats=False)
    assert collinearity(engine.regression, fit, even, 0) == pytest.approx(expected, rel=0.02)
    assert (expected > 1e4) == (reach == 0.1)


@pytest.mark.slow
def test_effects_that_cancel_have_a_doubt() -> None:
    """Over 0.05 rad to either side every smooth curve is a sum of a few large, opposite effects."""
    found = diagnose([run_of(0.05)], JOINT)
    doubts = {doubt.code for step in found.diagnosis.steps for doubt in step.doubts}
    assert "collinear" in doubts


@pytest.mark.slow
def test_over_a_large_motion_gravity_and_a_spring_that_balances_it_are_both_named() -> None:
    found = diagnose([run_of(1.0)], JOINT).diagnosis
    assert found.verdict == "explained"
    assert {effect for step in found.steps for effect in step.effects} >= {
        "joint-gravity",
        "spring-balancer",
    }
