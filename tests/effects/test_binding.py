"""Effects as profiles have them: tables and shorthands bound to terms with values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from winchkit.effects import check_profile, line_of, terms_of
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.errors import FileError
from winchkit.schema.profiles.winch import CableSpec, EffectTable, GearboxSpec, WinchProfile


def with_effects(*tables: EffectTable) -> WinchProfile:
    return replace(STANDARD_PROFILE, effect=tables)


def table(effect_id: str, **values: object) -> EffectTable:
    return EffectTable(effect_id, values, "winch.toml", 7)


def test_tables_become_terms_in_si_with_nulls_for_what_is_missing() -> None:
    profile = with_effects(
        table("frame-compliance", stiffness="50 kN/m"),
        table("guide-offset", offset="5 mm", fitted={"runs": ["a.csv"]}),
    )
    first, second = terms_of(profile)
    assert first.values == {"stiffness": 5e4}
    assert second.values == {"offset": 0.005, "mismatch": 0.0}


def test_shorthands_are_effects_too() -> None:
    profile = replace(
        STANDARD_PROFILE,
        cable=CableSpec(diameter=0.006, axial_stiffness=2e5, mass_per_length=0.14),
        gearbox=GearboxSpec(ratio=20.4, efficiency=0.8),
    )
    found = {term.effect.id: dict(term.values) for term in terms_of(profile)}
    assert found == {
        "cable-elongation-linear": {"axial_stiffness": 2e5},
        "cable-weight": {"mass_per_length": 0.14},
        "gear-efficiency": {"efficiency": 0.8, "transition": 0.0},
    }


def test_an_effect_with_an_order_may_stand_several_times() -> None:
    profile = with_effects(
        table("motor-cogging", amplitude="20 mN m", order=6),
        table("motor-cogging", amplitude="5 mN m", phase="90 deg", order=12),
    )
    assert [term.label for term in terms_of(profile)] == ["motor-cogging[6]", "motor-cogging[12]"]
    motion = standard_motion()
    bare = line_of(STANDARD_PROFILE).predict(motion)["motor_torque"]
    added = line_of(profile).predict(motion)["motor_torque"] - bare
    theta = motion.at.motor_angle
    assert np.allclose(added, 0.02 * np.sin(6 * theta) + 0.005 * np.cos(12 * theta), atol=1e-12)


def test_every_fault_is_reported_with_its_line() -> None:
    profile = with_effects(
        table("drum-raduis", radius_error="1 mm"),
        table("cell-gain", gain="2 %"),
        table("cell-offset", offset="2 mm"),
        table("pulley-coulomb", friction=0.9),
        table("cell-offset", offset="1 N"),
        table("motor-cogging", amplitude="20 mN m", order=2.5),
        table("pulley-eccentricity", amplitude="1 mm", pulley=7),
    )
    faults = [str(fault) for fault in check_profile(profile)]
    assert len(faults) == 7
    assert all(fault.startswith("winch.toml:7: ") for fault in faults)
    for fault, said in zip(
        faults,
        (
            "did you mean 'drum-radius'",
            "gain_error",
            "'mm' is a unit of length",
            "outside 0 to 0.5",
            "twice",
            "'2.5' must be a whole number",
            "is number 7 of 2 [[pulley]] of the profile",
        ),
        strict=True,
    ):
        assert said in fault
    with pytest.raises(FileError) as caught:
        terms_of(profile)
    assert len(caught.value.faults) == 7


def test_stages_act_in_the_order_of_the_physics_whatever_the_order_in_the_file() -> None:
    """Gain before offset before non-linearity before drift; ratio before backlash before slip."""
    chain = [
        table("cell-gain", gain_error=0.1),
        table("cell-offset", offset="20 N"),
        table("cell-nonlinearity", quadratic="50 N"),
        table("cell-drift", drift="0.1 N/s"),
    ]
    motion = standard_motion()
    load = motion.load
    assert load is not None
    shifted = 1.1 * load + 20
    wanted = shifted + 50 * (shifted / 500) ** 2 + 0.1 * motion.at.time
    for tables in (chain, chain[::-1]):
        found = line_of(with_effects(*tables)).predict(motion)["tension"]
        assert np.allclose(found, wanted, rtol=1e-12)
