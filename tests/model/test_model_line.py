"""The line: virtual work, symmetry, its inverse, and what it does without a channel."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.effects import Term, load_catalogue
from winchkit.model.line import GRAVITY, Line, Modifier, Signals, Stage
from winchkit.schema.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)

CATALOGUE = load_catalogue()
DRUMS = {
    "spiral": DrumSpec("spiral", 0.06),
    "archimedean": DrumSpec("archimedean", 0.06, layer_growth=0.005),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=0.007),
    "squared": DrumSpec("squared", 0.06, build_up=2e-5),
}
KINEMATIC: dict[str, dict[str, float]] = {
    "drum-radius": {"radius_error": 1.5e-3},
    "gear-ratio": {"ratio_error": -0.03},
    "layer-thickness": {"thickness_error": 4e-4},
    "drum-eccentricity": {"eccentricity": 2e-3, "phase": 0.8},
    "gear-transmission-error": {"amplitude": 1e-3, "phase": 0.5, "order": 3.0},
    "guide-offset": {"offset": 0.05, "mismatch": 4e-3},
}


def profile_with(drum: str, direction: int = 1) -> WinchProfile:
    return WinchProfile(
        name="w",
        drum=DRUMS[drum],
        gearbox=GearboxSpec(ratio=17.3, direction=direction),  # type: ignore[arg-type]
        reference=ReferenceSpec(motor_angle=0.0, cable_length=8.0, wound_turns=3.2),
        cable=CableSpec(diameter=0.006, dead_length=1.0),
        guide=GuideSpec(screw_lead=0.006),
        pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.05, pi), PulleySpec(0.04, 0.3)),
    )


def line_with(profile: WinchProfile, effects: dict[str, dict[str, float]]) -> Line:
    terms = [Term(CATALOGUE[name], CATALOGUE[name].null | v) for name, v in effects.items()]
    return Line(profile, tuple(term.modifier() for term in terms))


def swing(amplitude: float = 60.0, rate: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    time = np.linspace(0, 20, 2001)
    return time, amplitude * np.sin(rate * time) ** 3


@pytest.mark.parametrize("drum", DRUMS)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("effect", [None, *KINEMATIC, "all"])
def test_work_at_the_motor_is_work_on_the_rope(
    effect: str | None, direction: int, drum: str
) -> None:
    """∫ τ dθ = −F Δℓ, with τ by the line and ℓ by the line: one cannot lie without the other."""
    chosen = {None: {}, "all": KINEMATIC}.get(effect, {effect: KINEMATIC.get(effect or "", {})})
    line = line_with(profile_with(drum, direction), chosen)
    angle = direction * np.linspace(-40, 240, 70001)
    time = np.linspace(0, 100, 70001)
    force = 150.0
    predicted = line.predict(line.motion(Signals(time, angle, load=np.full_like(time, force))))
    torque, length = predicted["motor_torque"], predicted["cable_length"]
    work = np.concatenate([[0.0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(angle))])
    given_up = -force * (length - length[0])
    # Where a layer begins the arm steps inside one sample, whose work is uncertain by half.
    layers_begun = 4 if drum == "spiral" else 0
    uncertain = layers_begun * force * 0.0064 / 17.3 * abs(angle[1] - angle[0])
    assert np.allclose(work, given_up, rtol=0, atol=1e-6 * np.ptp(given_up) + uncertain)
    assert np.ptp(given_up) > 100


@pytest.mark.parametrize("drum", DRUMS)
def test_a_gearbox_the_other_way_round_turns_both_angle_and_torque(drum: str) -> None:
    effects = KINEMATIC | {
        "gear-efficiency": {"efficiency": 0.8},
        "pulley-coulomb": {"friction": 0.05},
        "motor-coulomb": {"torque": 0.1},
        "motor-viscous": {"viscosity": 0.01},
        "rotor-inertia": {"inertia": 1e-3},
        "gear-backlash": {"gap": 0.01},
    }
    del effects["gear-transmission-error"]
    time, angle = swing()
    load = 100 + 20 * np.sin(time)
    both = []
    for direction in (1, -1):
        line = line_with(profile_with(drum, direction), effects)
        both.append(line.predict(line.motion(Signals(time, direction * angle, load=load))))
    assert np.allclose(both[0]["cable_length"], both[1]["cable_length"], rtol=1e-12)
    assert np.allclose(both[0]["tension"], both[1]["tension"], rtol=1e-12)
    assert np.allclose(both[0]["motor_torque"], -both[1]["motor_torque"], rtol=1e-12)
    assert np.ptp(both[0]["cable_length"]) > 0.1


def test_positive_motor_angle_winds_in_and_positive_torque_holds_the_load() -> None:
    line = Line(profile_with("grooved"))
    time = np.linspace(0, 1, 50)
    predicted = line.predict(line.motion(Signals(time, 10 * time, load=np.full_like(time, 80.0))))
    assert np.all(np.diff(predicted["cable_length"]) < 0)
    arm = np.hypot(0.06, 0.007 / (2 * pi)) / 17.3
    assert np.allclose(predicted["motor_torque"], 80.0 * arm)
    assert np.allclose(predicted["cable_length"], 8.0 - 10 * time * arm)


def test_the_reference_is_where_the_angle_and_the_length_say() -> None:
    profile = replace(
        profile_with("spiral"), reference=ReferenceSpec(12.5, cable_length=3.25, wound_turns=6.0)
    )
    assert Line(profile).cable_length(12.5) == 3.25
    assert Line(profile).motor_angle(3.25) == pytest.approx(12.5, abs=1e-9)


def test_a_hanging_mass_pulls_with_its_weight_and_its_inertia() -> None:
    line = Line(profile_with("grooved"))
    time = np.linspace(0, 10, 1001)
    arm = line.arm(0.0)
    length = 8.0 - 0.5 * np.sin(1.3 * time)
    motion = line.motion(Signals(time, 0.5 * np.sin(1.3 * time) / arm, load_mass=20.0))
    expected = 20.0 * (GRAVITY - 0.5 * 1.3**2 * np.sin(1.3 * time))
    assert motion.load is not None
    assert np.allclose(motion.load[5:-5], expected[5:-5], atol=0.01)
    assert np.allclose(line.predict(motion)["tension"], motion.load)
    assert np.allclose(motion.at.free_length, length)


def test_a_hanging_mass_at_uneven_sampling_keeps_a_constant_acceleration() -> None:
    line = Line(profile_with("grooved"))
    time = np.sort(np.random.default_rng(5).uniform(0, 4, 400))
    motion = line.motion(Signals(time, 3.0 * time**2, load_mass=10.0))
    assert motion.load is not None
    # Acceleration of the length: −6 rad/s² times the arm.
    inner = motion.load[5:-5]
    assert np.allclose(inner, 10.0 * (GRAVITY + 6.0 * line.arm(0.0)), rtol=1e-6)


def test_a_measured_load_comes_before_a_known_mass() -> None:
    line = Line(profile_with("grooved"))
    time, angle = swing()
    motion = line.motion(Signals(time, angle, load=np.full_like(time, 55.0), load_mass=20.0))
    assert np.all(line.predict(motion)["tension"] == 55.0)


def test_without_a_load_the_cell_stands_in_and_its_own_errors_cannot_be_seen() -> None:
    time, angle = swing()
    tension = 90 + 10 * np.cos(time)
    signals = Signals(time, angle, tension=tension)
    bare = Line(profile_with("archimedean"))
    plain = bare.predict(bare.motion(signals))
    assert "tension" not in plain
    arm = np.array([bare.arm(x) for x in angle[::200]])
    assert np.allclose(plain["motor_torque"][::200], tension[::200] * arm)
    blind = line_with(
        bare.profile,
        {
            "pulley-coulomb": {"friction": 0.1},
            "cell-gain": {"gain_error": 0.1},
            "cable-weight": {"mass_per_length": 0.2},
        },
    )
    assert np.array_equal(
        blind.predict(blind.motion(signals))["motor_torque"], plain["motor_torque"]
    )
    elastic = line_with(bare.profile, {"frame-compliance": {"stiffness": 1e4}})
    longer = elastic.predict(elastic.motion(signals))["cable_length"] - plain["cable_length"]
    assert np.allclose(longer, tension / 1e4)


def test_with_a_load_the_cell_reading_is_not_looked_at() -> None:
    time, angle = swing()
    load = np.full_like(time, 70.0)
    line = Line(profile_with("spiral"))
    with_cell = Signals(time, angle, load=load, tension=load + 30)
    alone = Signals(time, angle, load=load)
    first, second = (line.predict(line.motion(s)) for s in (with_cell, alone))
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_a_bare_drive_still_has_its_own_torque() -> None:
    time, angle = swing()
    line = line_with(profile_with("grooved"), {"rotor-inertia": {"inertia": 2.0}})
    predicted = line.predict(line.motion(Signals(time, angle)))
    assert set(predicted) == {"cable_length", "motor_torque"}
    phase = 0.4 * time
    second = 60.0 * 0.16 * (6 * np.sin(phase) * np.cos(phase) ** 2 - 3 * np.sin(phase) ** 3)
    assert np.allclose(predicted["motor_torque"][3:-3], 2.0 * second[3:-3], atol=0.02)


def test_derivatives_and_directions_are_those_of_the_motion() -> None:
    line = Line(profile_with("archimedean"))
    time, angle = swing()
    at = line.motion(Signals(time + 1e6, angle)).at
    assert at.time[0] == 0.0
    inside = slice(3, -3)
    expected = 180 * 0.4 * np.sin(0.4 * time) ** 2 * np.cos(0.4 * time)
    assert np.allclose(at.motor_rate[inside], expected[inside], atol=0.01)
    fast = np.abs(at.speed) > 0.01
    assert np.all(np.sign(at.speed[fast]) == np.sign(at.motor_rate[fast]))
    assert np.allclose(np.abs(at.direction[fast]), 1.0, atol=1e-6)
    assert np.all(np.abs(at.direction) <= 1.0)
    assert np.all(np.isnan(at.temperature))


@given(
    st.sampled_from(list(DRUMS)),
    st.sampled_from([1, -1]),
    st.floats(0.5, 9.0),
    st.floats(0.0, 500.0),
    st.booleans(),
)
def test_motor_angle_is_the_inverse_of_cable_length(
    drum: str, direction: int, length: float, tension: float, with_effects: bool
) -> None:
    effects = KINEMATIC | {
        "cable-elongation-linear": {"axial_stiffness": 1e5},
        "frame-compliance": {"stiffness": 1e5},
    }
    line = line_with(profile_with(drum, direction), effects if with_effects else {})
    angle = line.motor_angle(length, tension)
    assert line.cable_length(angle, tension) == pytest.approx(length, abs=1e-6)


@given(st.sampled_from(list(DRUMS)), st.sampled_from([1, -1]), st.floats(-50.0, 400.0))
def test_arm_is_rope_wound_in_per_motor_angle(drum: str, direction: int, angle: float) -> None:
    line = Line(profile_with(drum, direction))
    h = 1e-4
    slope = (line.cable_length(angle - h) - line.cable_length(angle + h)) / (2 * h)
    into_turn = (3.2 + direction * angle / 17.3 / (2 * pi)) % 1.0
    if drum == "spiral" and min(into_turn, 1 - into_turn) < 1e-4:
        return
    assert line.arm(angle) == pytest.approx(slope, rel=1e-6)
    assert np.sign(line.arm(angle)) == direction


def test_one_state_at_rest_agrees_with_a_run() -> None:
    line = line_with(profile_with("spiral"), {"cable-elongation-linear": {"axial_stiffness": 1e5}})
    time, angle = swing()
    predicted = line.predict(line.motion(Signals(time, angle, load=np.full_like(time, 200.0))))
    for index in (0, 400, 1999):
        at_rest = line.cable_length(float(angle[index]), tension=200.0)
        assert at_rest == pytest.approx(predicted["cable_length"][index], rel=1e-14)


def test_modifiers_act_in_the_order_of_stages_then_of_their_own() -> None:
    seen: list[tuple[Stage, int, int]] = []

    def noting(stage: Stage, order: int) -> Modifier:
        def apply(value: object, at: object) -> object:
            seen.append((stage, order, at.pulley))  # type: ignore[attr-defined]
            return value

        return Modifier(stage, apply, order)

    modifiers = [noting(stage, order) for stage in reversed(Stage) for order in (2, 0, 1)]
    line = Line(profile_with("grooved"), modifiers)
    time, angle = swing()
    line.predict(line.motion(Signals(time, angle, load=np.full_like(time, 1.0))))
    stages = [stage for stage, _, _ in seen]
    assert stages == sorted(stages)
    assert set(stages) == set(Stage)
    for before, after in pairwise(seen):
        if before[0] == after[0] and before[2] == after[2]:
            assert before[1] < after[1]
    pulleys = [pulley for stage, order, pulley in seen if stage is Stage.PULLEY and order == 0]
    assert pulleys == [2, 1, 0], "from the platform to the drum"


def test_without_modifiers_tension_is_the_load_itself() -> None:
    line = Line(profile_with("spiral"))
    time, angle = swing()
    load = 50 + 10 * np.sin(time)
    assert line.predict(line.motion(Signals(time, angle, load=load)))["tension"] is load
