"""Shapes that a fit drives to their ends, and values that cannot be."""

from __future__ import annotations

import pytest
from diagnosis_runs import CATALOGUE, term

from winchkit.diagnosis.shapes import by_coefficients, elsewhere, in_disguise
from winchkit.effects.standard import standard_motion

MOTIONS = (standard_motion().at,)


def test_coefficients_are_taken_from_the_first() -> None:
    fitted = []
    for law in by_coefficients(CATALOGUE["cable-elongation-quartic"]):
        fitted.append([p.name for p in law.parameters if p.role != "fixed"])
        assert all(name in fitted[-1] for probe in law.probes for name in probe)
    assert fitted == [["k1", "b2"], ["k1", "b2", "b3"], ["k1", "b2", "b3", "b4"]]


def test_what_is_no_series_keeps_its_shapes() -> None:
    for effect in CATALOGUE:
        if effect.id != "cable-elongation-quartic":
            assert by_coefficients(effect) == [effect], effect.id


@pytest.mark.parametrize(("static", "disguised"), [(0.03, False), (0.01, True)])
def test_rubbing_less_at_creep_speed_is_no_stribeck_friction(
    static: float, disguised: bool
) -> None:
    curve = term("pulley-stribeck", coulomb=0.02, static=static, stribeck_speed=0.03)
    assert in_disguise(curve, MOTIONS) is disguised


def test_a_shape_at_its_end_is_another_effect() -> None:
    ends = CATALOGUE["motor-stribeck"].parameter("stribeck_speed")
    inside = term("motor-stribeck", torque=0.02, stribeck_speed=ends.typical)
    assert not in_disguise(inside, MOTIONS)
    assert in_disguise(term("motor-stribeck", torque=0.02, stribeck_speed=ends.high), MOTIONS)


def test_a_stribeck_speed_that_no_run_passes_is_a_dry_friction() -> None:
    fastest = max(abs(at.motor_rate).max() for at in MOTIONS)
    for share, disguised in ((0.5, False), (0.8, True)):
        curve = term("motor-stribeck", torque=0.02, stribeck_speed=share * fastest)
        assert in_disguise(curve, MOTIONS) is disguised
    fastest = max(abs(at.speed).max() for at in MOTIONS)
    for share, disguised in ((0.5, False), (0.8, True)):
        curve = term("pulley-stribeck", coulomb=0.02, static=0.03, stribeck_speed=share * fastest)
        assert in_disguise(curve, MOTIONS) is disguised


def test_a_moment_and_an_order_are_sought_elsewhere_too_and_a_time_constant_is_not() -> None:
    slip = term("encoder-slip", step=0.01, time=33.5)
    assert elsewhere(slip, {"time": 30.0})
    assert elsewhere(term("motor-cogging", amplitude=0.01, phase=0.0, order=4.0), {"order": 6.0})
    assert not elsewhere(slip, {"time": 33.5})
    creep = term("cable-creep", creep_stiffness=1e6, time_constant=33.5)
    assert not elsewhere(creep, {"time_constant": 60.0})
