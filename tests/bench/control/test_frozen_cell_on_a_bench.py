"""A cell that freezes at an open bench: through Modbus, the loop and the supervisor."""

from __future__ import annotations

import pytest

from winchkit.errors import LimitTripped, NotPermitted
from winchkit.testing.opened import OpenedBench
from winchkit.testing.plugin import SimBenchFixture


@pytest.fixture
def sim(sim_bench: SimBenchFixture) -> OpenedBench:
    return sim_bench("spiral-bench")


@pytest.mark.slow
def test_a_cell_that_freezes_at_rest_forbids_motion(sim: OpenedBench) -> None:
    """Seen by its noise of 0.3 N, 30 counts, while the count stands still."""
    sim.bench.winch["A"].move_by(wind_in=0.05, speed=0.3)
    sim.clock.sleep(6.0)
    assert not sim.bench.snapshot.tripped
    sim.freeze_cell("A")
    sim.clock.sleep(1.0)
    with pytest.raises((LimitTripped, NotPermitted), match=r"frozen"):
        sim.bench.winch["A"].move_by(wind_in=0.1, speed=0.3)


def test_a_cell_that_freezes_in_motion_stops_it(sim: OpenedBench) -> None:
    winch = sim.bench.winch["A"]
    sim.clock.sleep(4.0)
    sim.freeze_cell("A")
    with pytest.raises(LimitTripped, match=r"frozen"):
        winch.move_by(pay_out=0.5, speed=0.2)
