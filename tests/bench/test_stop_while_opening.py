"""Stops without an owner: one that meets an opening, and one that goes to the drives themselves."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sim_process import start
from slave import Slave, State
from slave.on_bus import SlavesOnBus
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from waiting import until
from winchkit.bench.emergency_stop import stop_on_bus
from winchkit.bench.ownership import mark_stop
from winchkit.bench.remote import session
from winchkit.bench.remote.session import at_station
from winchkit.errors import MotionError
from winchkit.schema.read import read_bench

STOPPED = "a stop came while bench 'rig' was being opened: nothing was moved"


@pytest.mark.parametrize("after", [0.0, 0.2, 0.35])
def test_an_opening_ends_and_the_next_one_is_free(rig: Rig, after: float) -> None:
    rig.write_bench(bench_text(rig.channel))
    spec = read_bench(rig.bench_file)
    begun = rig.time
    rig.clock.call_at(begun + after + 1e-3, lambda: mark_stop(spec))
    with pytest.raises(MotionError, match=STOPPED):
        rig.open()
    rig.wait(0.5)
    assert all(sample.state is not State.ENABLED for sample in rig.samples[0])
    with rig.opened() as bench:
        bench.winch["A"].move_by(pay_out=0.01)


def test_a_client_that_a_stop_overtook_moves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stop came through the owner, between the client's start and its place at the owner."""
    rig, attach = Rig(tmp_path), session.attach_to_owner
    with rig.opened() as bench:

        def stopped(*arguments: Any, **named: Any) -> Any:
            mark_stop(bench.spec)
            return attach(*arguments, **named)

        monkeypatch.setattr(session, "attach_to_owner", stopped)
        with pytest.raises(MotionError, match=STOPPED), at_station(rig.bench_file):
            pass
        with at_station(rig.bench_file, observer=True) as looking:
            assert looking.names() == ["A"]
        monkeypatch.undo()
        with at_station(rig.bench_file) as station:
            assert station.names() == ["A"]


@pytest.fixture
def slow(tmp_path: Path) -> Iterator[tuple[Path, SlavesOnBus]]:
    """A drive in real time that takes some seconds to be set up, and its bench file."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port = probe.getsockname()[1]
    group = "239.74.163.11"
    text = bench_text(group, heartbeat="500 ms").replace('"virtual"', '"udp_multicast"')
    path = tmp_path / "bench.toml"
    path.write_text(text.replace("heartbeat =", f"port = {port}\nheartbeat ="))
    slave = Slave.from_file(GENERIC, 1)
    try:
        running = SlavesOnBus([slave], group, "udp_multicast", port=port)
    except OSError as error:
        pytest.skip(f"no multicast here: {error}")
    with running:
        running.inject("sdo delayed", 0.03)
        yield path, running


@pytest.mark.realtime
@pytest.mark.skipif(os.name != "posix", reason="multicast as on POSIX")
@pytest.mark.parametrize("moment", [0.1, 1.5])
def test_a_jog_that_a_stop_met_ends_with_5(slow: tuple[Path, SlavesOnBus], moment: float) -> None:
    """``winchkit stop`` finds no owner and goes to the bus; the jog that is opening ends."""
    path, running = slow
    slave, enabled = running.slaves[0], list[float]()

    def watch(one: Slave) -> None:
        if one.power.state is State.ENABLED:
            enabled.append(one.time)

    slave.watch = watch
    jog = start("jog", "A", "--pay-out", "0.05 m/s", "--for", "3s", "-b", path)
    until(lambda: any(f.identifier == 0x601 for _, f in running.heard), 60.0)
    time.sleep(moment)
    stop = start("stop", "-b", path)
    _, said = stop.communicate(timeout=60)
    assert stop.returncode == 0, said
    out, said = jog.communicate(timeout=60)
    assert jog.returncode == 5, (out, said)
    assert STOPPED in said
    assert enabled == []
    with running.lock:
        assert slave.power.state is not State.ENABLED


QUICK_STOP = bytes.fromhex("2B40600002000000")
"""SDO download of 6040h = 02h, expedited, two bytes (CiA 301)."""
NAMES = "ABCDEFGH"


@pytest.fixture
def eight(tmp_path: Path) -> Rig:
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
    for at, frame in rig.frames:
        if at > since and 0x600 < frame.identifier < 0x680 and frame.data == QUICK_STOP:
            found.setdefault(frame.identifier - 0x600, at)
    return found


@pytest.mark.parametrize("dead", [(0, 1, 2), (2, 4, 7), ()])
def test_dead_drives_delay_no_other(eight: Rig, dead: tuple[int, ...]) -> None:
    begun = eight.time
    for number in dead:
        eight.slaves[number].inject("off the bus")
    results = stop_on_bus(read_bench(eight.bench_file), eight.clock)
    told = commands(eight, begun)
    assert set(told) == set(range(1, 9))
    assert max(told.values()) - min(told.values()) < 0.3
    assert [one.winch for one in results] == list(NAMES)
    assert [not one.confirmed for one in results] == [n in dead for n in range(8)]
    for number in set(range(8)) - set(dead):
        left = [
            s.time for s in eight.samples[number] if s.time > begun and s.state is State.ENABLED
        ]
        assert not left or left[-1] - begun < 0.05, "each stops with the first command"


def test_a_drive_that_missed_the_first_command_gets_further_ones(eight: Rig) -> None:
    begun = eight.time
    eight.slaves[5].inject("sdo unheard")
    eight.clock.call_at(begun + 0.1, lambda: eight.slaves[5].mend("sdo unheard"))
    eight.slaves[0].inject("off the bus")
    results = stop_on_bus(read_bench(eight.bench_file), eight.clock)
    assert [one.winch for one in results if not one.confirmed] == ["A"]
    left = [s.time for s in eight.samples[5] if s.time > begun and s.state is State.ENABLED]
    assert left[-1] - begun < 0.2, "before the dead one's time-out"


def test_a_bus_that_does_not_open_is_reported_for_its_winches_alone(eight: Rig) -> None:
    text = eight.bench_file.read_text()
    text += '[bus.gone]\nkind = "can"\ninterface = "socketcan"\nchannel = "no-such-can"\n'
    path = eight.write_bench(text.replace('bus = "can", node = 1,', 'bus = "gone", node = 1,'))
    results = stop_on_bus(read_bench(path), eight.clock)
    assert [one.winch for one in results if not one.confirmed] == ["A"]
    assert "bus 'gone': cannot open" in results[0].message
