"""How a search of a drive is watched, cycle by cycle, without any drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from fake_axis import CYCLE, StraightLine
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.homing_motion import HomingMotion
from winchkit.drivers.can.cia402.modes import HomingState

ARM = 0.005


@dataclass
class Searching:
    """A drive's word on its homing."""

    homing: HomingState = HomingState.RUNNING


def search(
    axis: Searching, farthest: float = math.inf, speed: float = 10.0, cycles: int = 400
) -> tuple[HomingMotion, int]:
    """Turn at a speed (rad/s) until it is over; the motion and the cycles that it took."""
    motion = HomingMotion(axis, CableMap(StraightLine()), farthest)
    motion.start(0.0, 0.0, 0.0)
    for cycle in range(1, cycles):
        target = motion.target(cycle * CYCLE, speed * cycle * CYCLE, 0.0)
        assert target.start, "bit 4 stays set"
        assert target.winding_speed == pytest.approx(speed * ARM)
        if target.done:
            return motion, cycle
    return motion, cycles


def test_a_homing_of_before_counts_only_after_a_while() -> None:
    motion, cycles = search(Searching(HomingState.DONE))
    assert not motion.failure
    assert 0.05 < cycles * CYCLE < 0.1


def test_a_drive_that_fails_is_accepted() -> None:
    motion, _ = search(Searching(HomingState.FAILED))
    assert "failed" in motion.failure


def test_a_search_that_finds_nothing_ends() -> None:
    motion, cycles = search(Searching(), farthest=0.03)
    assert "no zero was found" in motion.failure
    assert cycles * CYCLE * 10.0 * ARM == pytest.approx(0.03, abs=3e-4)


def test_a_search_without_limits_goes_on() -> None:
    motion, cycles = search(Searching())
    assert cycles == 400
    assert not motion.failure


@pytest.mark.parametrize("jump", [50.0, -1000.0])
def test_the_new_zero_is_no_motion(jump: float) -> None:
    axis = Searching()
    motion = HomingMotion(axis, CableMap(StraightLine()), 0.5)
    motion.start(0.0, 0.0, 0.0)
    motion.target(CYCLE, 0.01, 0.0)
    assert motion.target(2 * CYCLE, jump, 0.0).winding_speed == 0.0
    assert not motion.failure
