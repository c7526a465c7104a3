"""benchmarks/robot_faults.py in small: a broken cable under a moving platform."""

from __future__ import annotations

from dataclasses import replace

import pytest

import robot_faults


def test_the_same_seed_draws_the_same_cases_with_every_fault() -> None:
    cases = robot_faults.drawn(22, 3)
    assert cases == robot_faults.drawn(22, 3)
    assert cases != robot_faults.drawn(22, 4)
    assert {case.kind for case in cases} == {*robot_faults.FAULTS, robot_faults.BROKEN}


@pytest.mark.slow
def test_a_broken_cable_stops_all_winches_within_the_bounds() -> None:
    case = replace(robot_faults.drawn(11, 1)[10], share=0.3)
    assert case.kind == robot_faults.BROKEN
    outcome = robot_faults.played(case)
    assert outcome.good, outcome
    assert outcome.rest > 0.2, "slack has to hold for 0.2 s"
    assert outcome.displaced > 5e-3, "the platform goes where the other cables pull it"
