"""Several winches on one bench, with fake drives in simulated time: moved as one, or separate."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig, StraightLine
from winchkit import catalog, open_bench
from winchkit.bench.control.motion import PlannedMove, StartGate
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0))
STOPPING = {0x00, 0x02}


def begin(rig: Rig, targets: dict[str, float], *, holds: bool = False) -> dict[str, PlannedMove]:
    """What ``Bench.move_together`` does, on a rig."""
    moves = {}
    for name, length in targets.items():
        moves[name] = PlannedMove(StraightLine(), LIMITS, length, holds=holds)
        moves[name].prepare(rig.axes[name].angle)
    longest = max(move.duration for move in moves.values())
    gate = StartGate([partial(rig.controller(n).ready_for, m) for n, m in moves.items()])
    for name, move in moves.items():
        move.stretch(longest)
        rig.controller(name).begin(move, gate)
    return moves


def speeds(rig: Rig, duration: float, held_back: str = "") -> dict[str, list[float]]:
    """Commanded motor speeds by winch, a value a cycle; one drive may refuse to switch on."""
    seen: dict[str, list[float]] = {name: [] for name in rig.axes}
    for _ in range(round(duration / CYCLE)):
        if held_back:
            rig.axes[held_back].state = DriveState.READY_TO_SWITCH_ON
        rig.step()
        for name, axis in rig.axes.items():
            seen[name].append(axis.velocity)
    return seen


def first(values: list[float]) -> int:
    return next(n for n, value in enumerate(values) if value)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    lengths=st.lists(st.one_of(st.floats(1.0, 3.9), st.floats(4.1, 7.0)), min_size=2, max_size=4),
    waits=st.floats(0.0, 1.0),
)
def test_moves_start_in_one_cycle_and_end_together(lengths: list[float], waits: float) -> None:
    names = "ABCD"[: len(lengths)]
    targets = dict(zip(names, lengths, strict=True))
    rig = Rig(LIMITS, names)
    moves = begin(rig, targets)
    duration = next(iter(moves.values())).duration
    held = speeds(rig, waits, held_back=names[-1])
    assert not any(any(values) for values in held.values()), "one is not enabled yet"
    seen = speeds(rig, duration + 1.5)
    assert len({first(values) for values in seen.values()}) == 1
    for name, target in targets.items():
        assert 4.0 - 0.005 * rig.axes[name].angle == pytest.approx(target, abs=1e-3)
        assert max(map(abs, seen[name])) * 0.005 <= LIMITS.speed * 1.02
    # Halfway in time each is halfway there: the same curve, scaled.
    middle = first(seen[names[0]]) + round(duration / 2 / CYCLE)
    for name, target in targets.items():
        travelled = 0.005 * sum(seen[name][:middle]) * CYCLE
        assert travelled == pytest.approx((4.0 - target) / 2, rel=0.05, abs=5e-3)


def test_a_common_move_starts_from_winches_that_hold() -> None:
    rig = Rig(LIMITS, "AB")
    begin(rig, {"A": 3.5, "B": 4.5}, holds=True)
    speeds(rig, 4.0)
    assert {rig.controller(name).phase for name in "AB"} == {Phase.MOVING}
    begin(rig, {"A": 4.5, "B": 4.6}, holds=True)
    seen = speeds(rig, 4.0)
    assert first(seen["A"]) == first(seen["B"])
    assert 4.0 - 0.005 * rig.axes["A"].angle == pytest.approx(4.5, abs=1e-3)


def test_a_winch_that_jogs_comes_to_rest_first() -> None:
    rig = Rig(LIMITS, "AB")
    rig.jog(0.3)
    rig.run(0.5)
    begin(rig, {"A": 3.0, "B": 5.0})
    seen = speeds(rig, 8.0)
    still = next(n for n, value in enumerate(seen["A"]) if value == 0)
    assert first(seen["B"]) >= still
    assert 4.0 - 0.005 * rig.axes["A"].angle == pytest.approx(3.0, abs=1e-3)
    assert 4.0 - 0.005 * rig.axes["B"].angle == pytest.approx(5.0, abs=1e-3)


def test_where_one_drive_does_not_enable_none_moves() -> None:
    rig = Rig(LIMITS, "AB")
    begin(rig, {"A": 3.0, "B": 5.0})
    seen = speeds(rig, 3.0, held_back="B")
    assert not any(any(values) for values in seen.values())
    assert rig.controller("B").failure == "the drive stays ready to switch on for 2 s"
    assert rig.controller("A").reason == f"winch B: {rig.controller('B').failure}"
    assert rig.controller("A").phase is Phase.DISABLED


@pytest.mark.parametrize("together", [True, False])
def test_a_drive_that_gives_up_takes_the_others_down_in_the_next_cycle(together: bool) -> None:
    rig = Rig(LIMITS, "AB")
    rig.loop._stop_together = together
    begin(rig, {"A": 1.0, "B": 8.0})
    speeds(rig, 1.0)
    rig.axes["B"].state = DriveState.READY_TO_SWITCH_ON
    before = len(rig.axes["A"].words)
    rig.step(4)
    words = set(rig.axes["A"].words[before + 2 :])
    assert words == {0x02}, "a trip stops all in any case"
    rig.run(3.0)
    assert rig.controller("B").failure
    assert [trip.kind for trip in rig.supervisor.tripped] == ["state"]
    if together:
        assert rig.controller("A").stopped
        assert rig.axes["A"].velocity == 0


def declared() -> SimBench:
    """The shipped spiral bench twice, without instruments."""
    sim = read_simbench(catalog.find("sim", "spiral-bench"))
    one = replace(sim.bench.winch["A"], cell=None, length=None, temperature=None)
    winches = {
        name: replace(one, servo=replace(one.servo, node=number))
        for number, name in enumerate("AB", start=1)
    }
    buses = {"can": sim.bench.bus["can"]}
    bench = replace(sim.bench, winch=winches, bus=buses, cycle=0.01, stop_together=False)
    return replace(sim, bench=bench, truth=dict.fromkeys(winches, sim.truth["A"]))


def test_a_stop_of_one_leaves_the_other_going() -> None:
    clock = SimulatedClock()
    with (
        LiveBench(declared(), seed=1, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        bench.move_together({"A": 3.0, "B": 3.0}, speed=0.1, wait=False)
        while abs(bench.winch["A"].snapshot.cable_speed) < 0.05:
            bench.raise_trouble()
            clock.sleep(0.02)
        bench.winch["A"].stop()
        bench.raise_trouble()
        assert bench.winch["A"].snapshot.phase is Phase.DISABLED
        assert bench.winch["B"].moving
        assert bench.winch["B"].snapshot.cable_speed == pytest.approx(-0.1, abs=0.03)
