"""Eight winches on one bus: what is spoken on it shows that they start and stop in one SYNC."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import pytest

from bare_winches import bare_winches
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import Phase
from winchkit.errors import DriveFault, MotionError, NotPermitted, UsageError
from winchkit.sim.live.buses import BusWire, Carried
from winchkit.testing.opened import OpenedBench

NAMES = "ABCDEFGH"
SYNC, RPDO = 0x080, 0x200


class Witness:
    """Writes down what is spoken on a bus; a context manager."""

    def __init__(self, wire: BusWire) -> None:
        self._wire = wire
        self.frames: list[tuple[int, bytes]] = []

    def __enter__(self) -> Witness:
        self._wire.taps.append(self._take)
        return self

    def __exit__(self, *_: object) -> None:
        self._wire.taps.remove(self._take)

    def _take(self, carried: Carried) -> None:
        self.frames.append((carried.identifier, carried.data))

    def commands(self) -> list[dict[int, tuple[int, int]]]:
        """Control word and target velocity by node, between each two SYNCs."""
        cycles: list[dict[int, tuple[int, int]]] = [{}]
        for identifier, data in self.frames:
            if identifier == SYNC:
                cycles.append({})
            elif RPDO < identifier <= RPDO + len(NAMES):
                cycles[-1][identifier - RPDO] = struct.unpack("<Hi", data)
        return cycles


@pytest.fixture(scope="module")
def sim() -> Iterator[OpenedBench]:
    with OpenedBench(bare_winches(NAMES, cycle=0.02, heartbeat=0.2), seed=1) as opened:
        yield opened


@pytest.fixture
def bench(sim: OpenedBench) -> Bench:
    return sim.bench


def nodes_at_first(cycles: list[dict[int, tuple[int, int]]], word: int) -> set[int]:
    """Nodes that first get this word, in the cycle in which the first of them gets it."""
    for cycle in cycles:
        told = {node for node, (control, _) in cycle.items() if control == word}
        if told:
            return told
    return set()


@pytest.mark.slow
def test_they_are_enabled_start_and_stop_within_one_sync(sim: OpenedBench, bench: Bench) -> None:
    everybody = set(range(1, len(NAMES) + 1))
    targets = {name: 3.9 + 0.02 * n for n, name in enumerate(NAMES)}
    with Witness(sim.live.wire["can"]) as witness:
        bench.move_together(targets, speed=0.2, wait=False, hold=True)
        while any(bench.winch[name].moving for name in NAMES):
            bench.raise_trouble()
            bench.clock.sleep(0.02)
        begun = len(witness.frames)
        bench.stop_now()
    cycles = witness.commands()
    for word in (0x06, 0x07, 0x0F):
        assert nodes_at_first(cycles, word) == everybody
    moved = next(cycle for cycle in cycles if any(target for _, target in cycle.values()))
    still = {node for node, (_, target) in moved.items() if target == 0}
    assert still <= {6}, "only F, who is there already, may have nothing to do"
    assert set(moved) == everybody
    witness.frames = witness.frames[begun:]
    assert nodes_at_first(witness.commands(), 0x02) == everybody
    for name, target in targets.items():
        assert bench.winch[name].cable_length == pytest.approx(target, abs=5e-3)


def test_one_that_may_not_move_keeps_all_from_beginning(bench: Bench) -> None:
    with pytest.raises(NotPermitted, match="beyond the limits"):
        bench.move_together({"A": 3.0, "B": 99.0})
    with pytest.raises(UsageError, match="no winch 'Z'"):
        bench.move_together({"A": 3.0, "Z": 3.0})
    with pytest.raises(UsageError, match="at least one winch"):
        bench.move_together({})
    assert {bench.winch[name].snapshot.phase for name in NAMES} == {Phase.DISABLED}


def test_a_stop_of_one_stops_all(bench: Bench) -> None:
    bench.move_together(dict.fromkeys(NAMES, 3.0), speed=0.1, wait=False)
    until_moving(bench)
    bench.winch["C"].stop()
    assert bench.snapshot.at_rest
    with pytest.raises(MotionError, match=r"was stopped by .* before its motion was finished"):
        bench.winch["A"].wait()


def test_a_fault_of_one_is_reported_to_every_waiting_client(sim: OpenedBench, bench: Bench) -> None:
    bench.move_together(dict.fromkeys(NAMES, 3.0), speed=0.1, wait=False)
    until_moving(bench)
    sim.live.inject("D.servo", "over-current")
    with pytest.raises(DriveFault, match="winch D"):
        bench.winch["A"].wait()
    bench.wait_at_rest(NAMES)
    with pytest.raises(DriveFault, match="latched"):
        bench.winch["D"].jog(wind_in=0.1)
    bench.reset()


def until_moving(bench: Bench) -> None:
    for _ in range(300):
        if all(abs(bench.winch[name].snapshot.cable_speed) > 0.01 for name in NAMES):
            return
        bench.raise_trouble()
        bench.clock.sleep(0.02)
    pytest.fail("they did not move")
