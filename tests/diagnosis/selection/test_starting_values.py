"""Shape parameters at their bounds, and starting values."""

from __future__ import annotations

import pytest

from diagnosis_runs import CATALOGUE, term
from winchkit.diagnosis.selection.starting_values import (
    other_grid_point,
    shape_at_bound,
    truncated_series,
)


def test_a_series_is_truncated_from_its_last_coefficient() -> None:
    fitted = []
    for law in truncated_series(CATALOGUE["cable-elongation-quartic"]):
        fitted.append([p.name for p in law.parameters if p.role != "fixed"])
        assert all(name in fitted[-1] for probe in law.probes for name in probe)
    assert fitted == [["k1", "b2"], ["k1", "b2", "b3"], ["k1", "b2", "b3", "b4"]]


def test_an_effect_without_a_series_is_not_truncated() -> None:
    for effect in CATALOGUE:
        if effect.id != "cable-elongation-quartic":
            assert truncated_series(effect) == [effect], effect.id


@pytest.mark.parametrize(("static", "disguised"), [(0.03, False), (0.01, True)])
def test_less_friction_at_low_speed_is_not_stribeck_friction(
    static: float, disguised: bool
) -> None:
    curve = term("pulley-stribeck", coulomb=0.02, static=static, stribeck_speed=0.03)
    assert shape_at_bound(curve) is disguised


def test_a_shape_at_its_bound_is_rejected() -> None:
    ends = CATALOGUE["motor-stribeck"].parameter("stribeck_speed")
    inside = term("motor-stribeck", torque=0.02, stribeck_speed=ends.typical)
    assert not shape_at_bound(inside)
    assert shape_at_bound(term("motor-stribeck", torque=0.02, stribeck_speed=ends.high))


def test_times_and_orders_have_other_minima_and_time_constants_do_not() -> None:
    slip = term("encoder-slip", step=0.01, time=33.5)
    assert other_grid_point(slip, {"time": 30.0})
    assert other_grid_point(
        term("motor-cogging", amplitude=0.01, phase=0.0, order=4.0), {"order": 6.0}
    )
    assert not other_grid_point(slip, {"time": 33.5})
    creep = term("cable-creep", creep_stiffness=1e6, time_constant=33.5)
    assert not other_grid_point(creep, {"time_constant": 60.0})
