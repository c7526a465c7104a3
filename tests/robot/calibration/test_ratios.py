"""Which lines have another cable per motor turn: sets from known changes and covariances."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.robot.calibration import ratios

COMMON, OWN = 2.2e-3, 2e-4
"""Standard deviations of the robot's size, shared by all lines, and of each line."""


def sets(*percent: float) -> tuple[set[int], list[set[int]]]:
    change = np.array(percent) / 100
    covariance = COMMON**2 * np.ones((len(change),) * 2) + OWN**2 * np.eye(len(change))
    chosen, others = ratios._sets(change, covariance)
    return {i + 1 for i in chosen}, [{i + 1 for i in other} for other in others]


@pytest.mark.parametrize("size", [0.0, 0.3, -0.3])
def test_lines_that_differ_are_named_whatever_the_size_of_the_robot(size: float) -> None:
    assert sets(size, size, size, size) == (set(), [])
    assert sets(size + 1, size, size, size)[0] == {1}
    assert sets(size, size, size - 5, size) == ({3}, [])
    assert sets(size - 2, size, size + 1.5, size)[0] == {1, 3}


def test_two_against_two_is_decided_by_the_size_of_the_robot_or_both_are_given() -> None:
    """A step of one per cent between two pairs: either pair may be the wrong one."""
    chosen, others = sets(0.5, 0.5, -0.5, -0.5)
    assert {frozenset(chosen), *map(frozenset, others)} >= {frozenset({1, 2}), frozenset({3, 4})}
    assert sets(2.0, 2.0, 0.0, 0.0)[0] == {1, 2}


def test_tolerances_of_drums_are_not_named() -> None:
    assert sets(0.2, -0.1, 0.1, -0.2)[0] == set()
