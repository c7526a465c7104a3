"""Torque follows length by virtual work; the line and its inverse agree."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model_lines import DRUMS, KINEMATIC, line_with, profile_with, swing
from winchkit.model.line import Line
from winchkit.model.stages import Signals


@pytest.mark.parametrize("drum", DRUMS)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("effect", [None, *KINEMATIC, "all"])
def test_work_at_the_motor_is_work_on_the_cable(
    effect: str | None, direction: int, drum: str
) -> None:
    """∫ τ dθ = −F Δℓ, with τ by the line and ℓ by the line: one cannot lie without the other."""
    chosen = {None: {}, "all": KINEMATIC}.get(effect, {effect: KINEMATIC.get(effect or "", {})})
    line = line_with(profile_with(drum, direction), chosen)
    angle = direction * np.linspace(-40, 240, 14001)
    time = np.linspace(0, 100, 14001)
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
def test_arm_is_cable_wound_in_per_motor_angle(drum: str, direction: int, angle: float) -> None:
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
