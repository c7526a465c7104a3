"""Values that a machine cannot have are no explanation."""

from __future__ import annotations

from math import inf, isnan, nan

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, Ride, made, term, with_channel
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.verdict.plausibility import implausible
from winchkit.effects.effect import Effect
from winchkit.report.text import report_text


def reason(effect: str, name: str, value: float, std: float = 1e-9) -> str | None:
    parameter = CATALOGUE[effect].parameter(name)
    ends = None if isnan(std) else (value - 1.96 * std, value + 1.96 * std)
    values = {name: Estimate(value, std, parameter.unit, ends)}
    return implausible(term(effect, **{name: value}), values, GROOVED)


def test_a_range_is_relative_to_the_profile() -> None:
    """A fifth of 60 mm."""
    assert reason("drum-radius", "radius_error", 0.0119) is None
    found = reason("drum-radius", "radius_error", -0.0184)
    assert found is not None
    assert found.startswith("radius error = −18.4 mm is beyond the plausible range")
    assert "−12 mm to 12 mm" in found
    assert found.endswith(
        "check the sign and unit of each channel, the torque constant, and gravity"
    )


def test_a_value_whose_interval_reaches_into_the_range_is_kept() -> None:
    assert reason("torque-constant", "gain_error", 0.6, std=0.06) is None
    assert reason("torque-constant", "gain_error", 0.6, std=0.04) is not None
    assert reason("rotor-inertia", "inertia", 121.0, std=0.1) is not None


def test_without_a_range_a_bound_is_implausible_and_the_null_is_not() -> None:
    assert CATALOGUE["drum-winding-tension"].parameters[0].plausible is None
    assert reason("drum-winding-tension", "fraction", 0.05) is not None
    assert reason("drum-winding-tension", "fraction", 0.049) is None
    assert reason("motor-coulomb", "torque", 0.0) is None


def test_a_value_at_a_bound_of_the_fit_is_implausible_however_wide_its_interval() -> None:
    """A cell that reads a tenth, ± 60 %: another quantity is in its column."""
    found = str(reason("cell-gain", "gain_error", -0.9, std=0.3))
    assert found.startswith("gain error = −90 % is at a bound of the fit")
    assert reason("cell-gain", "gain_error", -0.6, std=0.3) is None


def test_an_undetermined_value_is_not_judged() -> None:
    assert reason("drum-winding-tension", "fraction", 0.05, std=nan) is None
    assert reason("cell-clipping", "share", 1.0, std=nan) is None


def test_a_shape_that_the_fit_held_at_an_end_of_its_range_is_implausible() -> None:
    """Dahl friction over a whole turn is a spring, and Coulomb friction near zero."""
    found = str(reason("motor-dahl", "distance", 6.3, std=nan))
    assert "within a motor turn" in found
    assert "the law is probably another one" in found, "a wrong sign or unit changes no distance"
    assert reason("motor-dahl", "distance", 1e-6, std=nan) is None


@pytest.mark.parametrize("effect", list(CATALOGUE), ids=lambda effect: effect.id)
def test_ranges_hold_the_null_and_the_typical_value_and_have_a_reason(effect: Effect) -> None:
    for p in effect.parameters:
        if p.plausible is not None:
            assert p.plausible.reason
            assert p.plausible.low < p.plausible.high
            if not p.plausible.of:
                assert p.plausible.low <= p.typical <= p.plausible.high
                assert p.null == inf or p.plausible.low <= p.null <= p.plausible.high


@pytest.mark.slow
def test_a_torque_in_another_unit_is_a_torque_constant_with_a_doubt() -> None:
    """The drive reports a torque that is 2.6 times too large."""
    runs = []
    for i, (stroke, mass) in enumerate((s, m) for s in (400.0, 150.0) for m in (10.0, 20.0)):
        for repeat in range(2):
            ride = Ride(samples=600, stroke=stroke)
            run = made(10 * i + repeat, GROOVED, load_mass=mass, ride=ride)
            torque = 2.6 * run["motor_torque"]
            runs.append(with_channel(run, "motor_torque", np.asarray(torque), "N m"))
    # The check of units refuses such runs before, unless they are taken as recorded.
    answer = diagnose(runs, GROOVED, as_recorded=True)
    result = answer.diagnosis
    step = next(step for step in result.steps if "torque-constant" in step.effects)
    assert step.parameters["torque-constant"]["gain_error"].value == pytest.approx(1.6, abs=0.05)
    assert not step.certain
    (doubt,) = (one for one in step.doubts if one.code == "implausible")
    assert "beyond the plausible range" in doubt.text
    assert "beyond the plausible range" in " ".join(report_text(answer).split())
