"""Stops that a drive does not obey: each way as soon as the one before is not heard, then SDO."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit import catalog, open_bench
from winchkit.bench.control.stop_escalation import (
    STOP_TABLE,
    StopEscalation,
    StopEvidence,
    StopMethod,
)
from winchkit.errors import LimitTripped
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.testing.plugin import SimBenchFixture

CYCLE = 0.004
HEARD = StopEvidence(left=False, hears_pdos=True, hears_sdos=True)
LEFT = StopEvidence(left=True, hears_pdos=True, hears_sdos=True)


def when(seen: StopEvidence, *, nmt: bool = False, cycle: float = CYCLE) -> dict[StopMethod, float]:
    """The time of the first use of each method, with the same evidence in every cycle."""
    escalation, now, found = StopEscalation(), 0.0, {}
    escalation.begin(now, nmt=nmt)
    while now < 1.0:
        method = escalation.step(now, seen)
        if method is not None:
            found.setdefault(method, now)
        now += cycle
    return found


def test_a_drive_that_leaves_ends_the_escalation() -> None:
    escalation = StopEscalation()
    escalation.begin(0.0)
    assert escalation.step(0.0, HEARD) is StopMethod.PDO
    assert escalation.step(CYCLE, LEFT) is None
    assert escalation.method is None


def test_a_drive_that_answers_and_stays_enabled_gets_sdo_after_four_answers() -> None:
    found = when(HEARD)
    assert found[StopMethod.PDO] == 0.0
    assert 4 * CYCLE <= found[StopMethod.SDO] <= 6 * CYCLE
    assert found[StopMethod.SILENCE] - found[StopMethod.SDO] <= 0.03
    assert StopMethod.NMT not in found


def test_a_drive_out_of_operational_gets_sdo_at_once() -> None:
    assert when(StopEvidence(False, hears_pdos=False, hears_sdos=True))[StopMethod.SDO] == 0.0


def test_a_stopped_drive_is_left_to_silence_at_once() -> None:
    seen = StopEvidence(False, hears_pdos=False, hears_sdos=False)
    assert when(seen)[StopMethod.SILENCE] == 0.0
    assert when(seen, nmt=True)[StopMethod.NMT] == 0.0


def test_nmt_stop_is_only_for_drives_that_were_seen_to_stop_on_it() -> None:
    assert StopMethod.NMT in when(HEARD, nmt=True)
    assert StopMethod.NMT not in when(HEARD, nmt=False)


@given(cycle=st.sampled_from([0.001, 0.002, 0.004, 0.01, 0.02]), nmt=st.booleans())
def test_silence_comes_within_a_time_that_leaves_room_for_the_watchdog(
    cycle: float, nmt: bool
) -> None:
    found = when(HEARD, nmt=nmt, cycle=cycle)
    order = sorted(found, key=lambda method: found[method])
    assert order == sorted(order)
    longest = sum(row.timeout + (row.syncs + 2) * cycle for row in STOP_TABLE)
    assert found[StopMethod.SILENCE] <= longest


def test_a_lost_map_leaves_no_winch_running(sim_bench: SimBenchFixture) -> None:
    sim = sim_bench("spiral-bench")
    bench, clock = sim.bench, sim.clock
    winch, truth = bench.winch["A"], sim.live.winches["A"].plant
    bench.on_cycle(lambda _snapshot: {"A": -0.1})
    deadline = clock.now() + 15
    while abs(truth.motor_velocity) < 1.0:
        assert clock.now() < deadline, "it did not move"
        clock.sleep(0.01)
    sim.fault("A.servo", "map lost")
    lost = clock.now()
    while abs(truth.motor_velocity) > 0.05:
        assert clock.now() < deadline, "it runs on"
        clock.sleep(0.01)
    # Stale after 0.1 s, a stop by RPDO that is not heard, one by SDO, its ramp.
    assert clock.now() - lost < 0.5
    assert [trip.kind for trip in bench.snapshot.tripped] == ["feedback"]
    bench.loop.callbacks.clear()
    with pytest.raises(LimitTripped, match="no complete feedback"):
        winch.move_by(pay_out=0.1, speed=0.1)
    bench.reset()
    before = truth.cable_length
    winch.move_by(pay_out=0.1, speed=0.1)
    assert truth.cable_length - before == pytest.approx(0.1, abs=5e-3)


def test_a_bench_of_a_long_cycle_closes_beside_a_dead_drive() -> None:
    """Closing lets 50 cycles pass for the quick stop, 2 s of these: that is no loop that hangs."""
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    declared = replace(declared, bench=replace(declared.bench, cycle=0.04))
    clock = SimulatedClock()
    with LiveBench(declared, simulated_time=clock) as live:
        with open_bench(live.bench_spec, clock) as bench:
            bench.winch["A"].move_by(pay_out=0.01, speed=0.1, hold=True)
            live.inject("A.servo", "silence")
            clock.sleep(1.0)
            assert bench.snapshot.tripped
            closing = clock.now()
        # A stop that is not obeyed within 5 s, then the quick stop.
        assert clock.now() - closing == pytest.approx(7.0, abs=1.5)
