"""Drum laws against sums over turns and against numerical integration."""

from dataclasses import replace
from itertools import pairwise
from math import floor, hypot, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from plant_benches import GROOVED, SPIRAL
from winchkit.errors import UsageError
from winchkit.schema.profiles.winch import CableSpec, DrumSpec
from winchkit.sim.plant.drum import CLIMB, PlantDrum, drum_of
from winchkit.sim.plant.kinematics import Kinematics

KINDS = {
    "spiral": DrumSpec("spiral", 0.06, layer_growth=0.0005),
    "archimedean": DrumSpec("archimedean", 0.06, layer_growth=0.0005),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=0.005),
    "squared": DrumSpec("squared", 0.06, build_up=2e-5),
}
angles = st.floats(0.0, 300.0)


def law(kind: str, climb: float = 0.0) -> PlantDrum:
    return drum_of(replace(SPIRAL, drum=KINDS[kind]), climb)


@given(angles)
def test_spiral_is_a_sum_over_turns(angle: float) -> None:
    turns = floor(angle / (2 * pi))
    radii = [0.06 + 0.0005 * k for k in range(turns + 1)]
    expected = 2 * pi * sum(radii[:-1]) + (angle - 2 * pi * turns) * radii[-1]
    wound, radius = law("spiral").wound(angle)
    assert wound == pytest.approx(expected, abs=1e-12)
    assert radius == radii[-1]


@given(angles)
def test_a_climb_moves_the_length_by_no_more_than_it_says(angle: float) -> None:
    exact, rounded = law("spiral").wound(angle)[0], law("spiral", CLIMB).wound(angle)[0]
    assert 0.0 <= rounded - exact <= 0.0005 * CLIMB / 8 + 1e-12


@given(angles)
def test_squared_keeps_its_law(angle: float) -> None:
    wound, radius = law("squared").wound(angle)
    assert radius**2 == pytest.approx(0.06**2 + 2e-5 * wound)


@given(angles)
def test_grooved_is_a_helix(angle: float) -> None:
    assert law("grooved").wound(angle)[0] == pytest.approx(angle * hypot(0.06, 0.005 / 2 / pi))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("angle", [0.3, 6.25, 6.31, 40.0, 99.9])
def test_length_is_the_integral_of_the_radius(kind: str, angle: float) -> None:
    drum = law(kind, CLIMB)
    corners = [2 * pi * k + d for k in range(17) for d in (-CLIMB / 2, CLIMB / 2)]
    pieces = [0.0, *[c for c in sorted(corners) if 0 < c < angle], angle]
    integral = sum(quad(lambda x: drum.wound(x)[1], a, b)[0] for a, b in pairwise(pieces))
    assert drum.wound(angle)[0] - drum.wound(0.0)[0] == pytest.approx(integral, abs=1e-10)


@pytest.mark.parametrize("kind", KINDS)
@given(angle=angles)
def test_inverse(kind: str, angle: float) -> None:
    drum = law(kind)
    assert drum.angle(drum.wound(angle)[0]) == pytest.approx(angle, abs=1e-8)


@pytest.mark.parametrize("direction", [1, -1])
@given(length=st.floats(0.5, 6.0))
def test_kinematics_go_there_and_back(direction: int, length: float) -> None:
    gearbox = replace(SPIRAL.gearbox, direction=direction)
    chain = Kinematics.of(replace(SPIRAL, gearbox=gearbox))
    angle = chain.motor_angle(length)
    assert chain.cable_length(angle) == pytest.approx(length, abs=1e-9)
    assert chain.arm(angle) * direction > 0
    assert (angle > SPIRAL.reference.motor_angle) == (length < 4.0) or direction == -1


@pytest.mark.parametrize(
    ("drum", "key"),
    [
        (DrumSpec("grooved", 0.06), "groove_pitch"),
        (DrumSpec("squared", 0.06), "build_up"),
        (DrumSpec("spiral", 0.06), "layer_growth"),
    ],
)
def test_a_missing_number_is_named(drum: DrumSpec, key: str) -> None:
    with pytest.raises(UsageError, match=key):
        drum_of(replace(SPIRAL, drum=drum, cable=CableSpec()))


def test_a_missing_reference_length_is_named() -> None:
    lacking = replace(GROOVED, reference=replace(GROOVED.reference, cable_length=None))
    with pytest.raises(UsageError, match=r"reference\.cable_length"):
        Kinematics.of(lacking)


def test_more_cable_than_the_drum_has_is_refused() -> None:
    with pytest.raises(UsageError, match="no angle winds"):
        law("squared").angle(-1e6)
