"""Time of motion where control cycles are missed: ramps and braking take no longer by the clock."""

from __future__ import annotations

import pytest

from fake_axis import CYCLE, Rig
from winchkit.schema.bench import LimitSpec

_LIMITS = LimitSpec(speed=0.5, acceleration=1.0, length=(3.0, 4.2), response_time=0.06)


def step(rig: Rig, missed: int = 0) -> None:
    """A cycle after ``missed`` ones that did not begin; the drive kept its speed meanwhile."""
    rig.now += missed * CYCLE
    rig.now += CYCLE
    rig.cells["A"].read(100.0, rig.now)
    rig.loop.step(rig.now, missed)


@pytest.mark.parametrize("every", [0, 2, 3, 5])
def test_braking_before_a_limit_is_not_later_where_cycles_are_missed(every: int) -> None:
    """Four cycles of five missed, as often as ``every`` says: it rests before the limit of 3 m."""
    rig = Rig(_LIMITS, cell=True)
    rig.jog(0.5)
    shortest = 4.0
    for number in range(1500):
        step(rig, 4 if every and number % every == 0 else 0)
        shortest = min(shortest, 4.0 - 0.005 * rig.axes["A"].angle)
    assert not rig.supervisor.tripped
    assert 3.0 - 1e-3 < shortest < 3.03
    assert rig.axes["A"].velocity == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize(("position_mode", "changes"), [(False, 5), (True, 1)])
def test_a_ramp_goes_on_in_missed_cycles_unless_the_drive_waited(
    position_mode: bool, changes: int
) -> None:
    """A drive that follows positions stands at its last one until the next comes."""
    rig = Rig(_LIMITS, cell=True)
    rig.jog(0.5)
    rig.axes["A"].position_mode = position_mode
    for _ in range(40):
        step(rig)
    before = rig.controller().commanded
    assert 0.05 < before < 0.3
    step(rig, 4)
    grown = rig.controller().commanded - before
    assert grown == pytest.approx(changes * CYCLE * _LIMITS.acceleration, rel=1e-6)
