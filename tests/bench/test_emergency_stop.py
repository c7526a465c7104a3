"""``stop`` without an owner: every drive gets its command first, whatever the others do."""

from __future__ import annotations

from pathlib import Path

import pytest

from slave import Slave, State
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from winchkit.bench.emergency_stop import stop_on_bus
from winchkit.schema.read import read_bench

QUICK_STOP = bytes.fromhex("2B40600002000000")
"""SDO download of 6040h = 02h, expedited, two bytes (CiA 301)."""
NAMES = "ABCDEFGH"


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """Eight enabled drives whose owner was killed just now, so that their watchdogs still wait."""
    rig = Rig(tmp_path, [Slave.from_file(GENERIC, number + 1) for number in range(8)])
    rig.write_bench(bench_text(rig.channel, 8, heartbeat="500 ms"))
    bench = rig.open()
    for name in NAMES:
        bench.winch[name].jog(pay_out=0.1, hold=1.0)
    rig.wait(0.6)
    assert all(slave.power.state is State.ENABLED for slave in rig.slaves)
    rig.kill(bench)
    return rig


def commands(rig: Rig, since: float) -> dict[int, float]:
    """When the first quick stop arrived at each node, s."""
    found: dict[int, float] = {}
    for time, frame in rig.frames:
        if time > since and 0x600 < frame.identifier < 0x680 and frame.data == QUICK_STOP:
            found.setdefault(frame.identifier - 0x600, time)
    return found


@pytest.mark.parametrize("dead", [(0, 1, 2), (2, 4, 7), ()])
def test_dead_drives_delay_no_other(rig: Rig, dead: tuple[int, ...]) -> None:
    begun = rig.time
    for number in dead:
        rig.slaves[number].inject("off the bus")
    results = stop_on_bus(read_bench(rig.bench_file), rig.clock)
    told = commands(rig, begun)
    assert set(told) == set(range(1, 9))
    assert max(told.values()) - min(told.values()) < 0.3
    assert [one.winch for one in results] == list(NAMES)
    assert [not one.confirmed for one in results] == [n in dead for n in range(8)]
    for number in set(range(8)) - set(dead):
        left = [s.time for s in rig.samples[number] if s.time > begun and s.state is State.ENABLED]
        assert not left or left[-1] - begun < 0.05, "each stops with the first command"


def test_a_drive_that_missed_the_first_command_gets_further_ones(rig: Rig) -> None:
    begun = rig.time
    rig.slaves[5].inject("sdo unheard")
    rig.clock.call_at(begun + 0.1, lambda: rig.slaves[5].mend("sdo unheard"))
    rig.slaves[0].inject("off the bus")
    results = stop_on_bus(read_bench(rig.bench_file), rig.clock)
    assert [one.winch for one in results if not one.confirmed] == ["A"]
    left = [s.time for s in rig.samples[5] if s.time > begun and s.state is State.ENABLED]
    assert left[-1] - begun < 0.2, "before the dead one's time-out"


def test_a_bus_that_does_not_open_is_reported_for_its_winches_alone(rig: Rig) -> None:
    text = rig.bench_file.read_text()
    text += '[bus.gone]\nkind = "can"\ninterface = "socketcan"\nchannel = "no-such-can"\n'
    path = rig.write_bench(text.replace('bus = "can", node = 1,', 'bus = "gone", node = 1,'))
    results = stop_on_bus(read_bench(path), rig.clock)
    assert [one.winch for one in results if not one.confirmed] == ["A"]
    assert "bus 'gone': cannot open" in results[0].message
