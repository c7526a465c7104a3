"""Shape parameters at their bounds, starting values, and initial states that explain no run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.diagnosis.selection.starting_values import (
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


RIDE = Ride(samples=1600, rate=25.0, period=64.0)  # so slow that the tension hardly changes
MASSES = (10.0, 20.0, 35.0)


def told(error: Callable[[float], Array | float]) -> Diagnosis:
    """What is said of a cell that errs by so many newtons under a load (kg), each load twice."""
    runs = []
    for number, mass in enumerate(np.repeat(MASSES, 2)):
        run = made(number, GROOVED, load_mass=float(mass), ride=RIDE)
        runs.append(with_channel(run, "tension", run["tension"] + error(float(mass))))
    return diagnose(runs, GROOVED, CATALOGUE).diagnosis


def test_an_offset_under_one_load_is_not_creep() -> None:
    """Creep far slower than the runs could have any level in each: a ramp is mostly level."""
    found = told(lambda mass: -8.0 if mass == MASSES[1] else 0.0)
    assert found.verdict == "unknown"
    assert found.steps == ()


def test_creep_from_rest_is_found_though_a_ramp_is_mostly_an_offset() -> None:
    creep = term("cell-creep", fraction=0.05, time_constant=10 * RIDE.time[-1])
    runs = [
        made(number, GROOVED, [creep], load_mass=float(mass), ride=RIDE)
        for number, mass in enumerate(np.repeat(MASSES, 2))
    ]
    found = diagnose(runs, GROOVED, CATALOGUE).diagnosis
    assert found.verdict == "explained"
    assert "cell-creep" in found.steps[0].effects
