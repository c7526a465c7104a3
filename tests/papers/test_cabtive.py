"""The traps of the CABTIVE paper on its own tables: what is printed fails, what is meant holds."""

from __future__ import annotations

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.model.drum import Archimedean, Spiral

# Tables 2, 3, 5, 6 and 7, mm.
EXIT = np.array(
    [
        [861.1, -140, -141.4, 860.4, 860.7, -139.1, -139.1, 859.8],
        [1058.3, 1058.7, 56.2, 57.7, 1061.3, 1060.5, 60.3, 59.7],
        [1097.1, 1096.2, 1091.4, 1092.8, 44, 43.1, 36.8, 41.6],
    ]
)
ANCHOR = np.array(
    [
        [49.9, -49.9, -49.9, 49.9, 27.3, -27.3, -27.3, 27.3],
        [86.6, 86.6, -86.6, -86.6, 96.1, 96.1, -96.1, -96.1],
        [-73.0] * 8,
    ]
)
EXIT_OPTIMAL = np.array(
    [
        [859.4, -143.3, -131.5, 850.6, 861.2, -130.2, -139.8, 860.4],
        [1067.8, 1063.4, 55.9, 58.7, 1071.2, 1068.8, 53.3, 56.8],
        [1106.7, 1105.8, 1101.2, 1102.5, 53.8, 51, 46.8, 51.5],
    ]
)
ANCHOR_OPTIMAL = np.array(
    [
        [43.4, -40, -54.6, 55, 32.4, -21.6, -30.9, 32.6],
        [92.4, 95, -93.4, -90.5, 106, 102.4, -99.6, -106],
        [-63.3, -63.1, -71.3, -66.4, -65.6, -62.9, -62.6, -63.7],
    ]
)
SWIVEL_OPTIMAL = np.array([8, 7.9, 7.9, 7.8, 7.7, 8.4, 8, 8.5])
WINDING_OPTIMAL = np.array([59, 59, 60.2, 59, 60.4, 60.1, 60.5, 60.1])
HOME = np.array([0.360, 0.558, 0.560])
SWIVEL, WINDING, ROPE = 8.6e-3, 60e-3, 0.48e-3


def cable_length(anchor: np.ndarray, point: np.ndarray, swivel: float) -> float:
    """Arc on a swivel pulley that the cable reaches running along +z, and free cable."""
    reach = hypot(anchor[0] - point[0], anchor[1] - point[1])
    rise = anchor[2] - point[2]
    free = sqrt((reach - swivel) ** 2 + rise**2 - swivel**2)
    return swivel * (atan2(reach - swivel, rise) + atan2(swivel, free)) + free


def printed_eq_2(theta: float, radius: float, rope: float) -> float:
    """The sum over layers, term by term; wound is negative."""
    n = int(abs(theta) // (2 * pi))
    partial = (abs(theta) - 2 * pi * n) * (radius + n * rope)
    full = 2 * pi * sum(radius + k * rope for k in range(n))
    return float(np.sign(theta)) * (partial + full)


@given(st.floats(0, 400), st.floats(0.01, 0.2), st.floats(0, 0.01))
def test_eq_2_is_the_spiral_drum_wound_with_negative_angles(
    wound: float, radius: float, rope: float
) -> None:
    expected = -printed_eq_2(-wound, radius, rope)
    assert float(Spiral(radius, rope).wound(np.asarray(wound))) == pytest.approx(expected)
    assert expected >= 0


def test_eq_2_read_with_positive_angles_for_wound_turns_the_winch_round() -> None:
    """Winding in shortens the free cable; as a positive l it would lengthen it (Eq. 3)."""
    before, after = 4 * pi, 6 * pi
    shorter = printed_eq_2(-after, WINDING, ROPE) - printed_eq_2(-before, WINDING, ROPE)
    longer = printed_eq_2(after, WINDING, ROPE) - printed_eq_2(before, WINDING, ROPE)
    assert shorter < 0 < longer


def test_eq_2_steps_where_a_spiral_climbs_evenly() -> None:
    """Within a turn the two laws part by π d_c/4 from end to middle: both are offered."""
    angle = np.linspace(0, 20 * pi, 20001)
    step, even = Spiral(WINDING, ROPE).wound(angle), Archimedean(WINDING, ROPE).wound(angle)
    # The even law leads by half a layer a turn; what swings within a turn is left.
    swing = even - step - ROPE * angle / 2
    assert np.ptp(swing) == pytest.approx(pi * ROPE / 4, rel=1e-3)


@pytest.mark.parametrize("line", range(8))
def test_eq_3_leaves_out_the_home_length_and_the_arc(line: int) -> None:
    point, anchor = EXIT[:, line] / 1e3, ANCHOR[:, line] / 1e3
    if point[2] < 0.5:
        # The cable reaches the lower pulleys from above.
        point, anchor, home = (v * [1, 1, -1] for v in (point, anchor, HOME))
    else:
        home = HOME
    moved = home + np.array([0.06, -0.05, 0.07])
    there = [cable_length(pose + anchor, point, SWIVEL) for pose in (home, moved)]
    paid_out = there[1] - there[0]
    straight = float(np.linalg.norm(moved + anchor - point))
    assert abs(paid_out) < 0.2
    # As printed, ‖l_j‖ = Δl: wrong by the whole home length.
    assert abs(straight - paid_out) > 0.4
    # With the home length but no arc: wrong by how much the arc changed.
    bare = float(np.linalg.norm(home + anchor - point))
    assert abs(straight - bare - paid_out) > 1e-5
    assert there[0] + paid_out == pytest.approx(there[1], abs=1e-15)


def test_the_arc_is_that_of_a_cable_laid_around_a_circle() -> None:
    """Against a search for the shortest way around the pulley that starts along its axis."""
    swivel, point, anchor = 0.03, np.zeros(3), np.array([0.4, 0.0, -0.3])
    centre = np.array([swivel, 0.0])
    phi = np.linspace(0, 2 * pi, 400_001)
    touch = centre[:, None] + swivel * np.array([-np.cos(phi), np.sin(phi)])
    aside = np.array([np.sin(phi), np.cos(phi)])
    to_anchor = np.array([[0.4], [-0.3]]) - touch
    # Tangent: the cable leaves along the way it runs on the pulley.
    cross = to_anchor[0] * aside[1] - to_anchor[1] * aside[0]
    ahead = (to_anchor * aside).sum(axis=0) > 0
    at = np.flatnonzero((np.sign(cross[:-1]) != np.sign(cross[1:])) & ahead[:-1])[0]
    expected = swivel * phi[at] + float(np.linalg.norm(to_anchor[:, at]))
    assert cable_length(anchor, point, swivel) == pytest.approx(expected, abs=1e-6)


def test_table_4_is_broken_by_table_6_and_bounds_decide_the_optimum() -> None:
    exits, anchors = EXIT_OPTIMAL - EXIT, ANCHOR_OPTIMAL - ANCHOR
    assert np.max(np.abs(exits)) <= 10.0 + 1e-9
    beyond = np.argwhere(np.abs(anchors) > 10.0 + 1e-9)
    # b6z and b7z.
    assert beyond.tolist() == [[2, 5], [2, 6]]
    assert anchors[2, 5:7] == pytest.approx([10.1, 10.4])
    near = np.count_nonzero(np.abs(np.concatenate([exits, anchors])) >= 9.5 - 1e-9)
    assert near == 18
    assert np.count_nonzero(WINDING_OPTIMAL == 59) == 3
    # d_c = 0.422 of 0.42 to 0.58 mm.
    assert Spiral(WINDING, 0.422e-3).growth - 0.42e-3 < 0.02 * (0.58e-3 - 0.42e-3)


def test_table_4_gives_the_pulley_radius_in_millimetres() -> None:
    """7.7 to 9.3 "deg" around 8.6 mm; Table 7's values lie within it as millimetres."""
    assert 7.7 < SWIVEL * 1e3 < 9.3
    assert np.all((SWIVEL_OPTIMAL >= 7.7) & (SWIVEL_OPTIMAL <= 9.3))


def test_eq_6_sums_norms_where_the_solver_sums_squares() -> None:
    """The point that lsqnonlin finds is the mean; the printed cost is least at the median."""
    measured = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [3.0, 0, 0]])

    def printed(x: float) -> float:
        return float(np.linalg.norm(measured - [x, 0, 0], axis=1).sum())

    def solved(x: float) -> float:
        return float((np.linalg.norm(measured - [x, 0, 0], axis=1) ** 2).sum())

    grid = np.linspace(0, 3, 3001)
    assert grid[np.argmin([solved(x) for x in grid])] == pytest.approx(0.825, abs=1e-3)
    assert 0.1 - 1e-3 <= grid[np.argmin([printed(x) for x in grid])] <= 0.2 + 1e-3
