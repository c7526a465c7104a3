"""A stop that meets an opening: it ends without motion, whoever opens."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from slave import Slave, State
from slave.on_bus import SlavesOnBus
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from waiting import until
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


def command(path: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "winchkit", *words, "-b", str(path)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


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
    jog = command(path, "jog", "A", "--pay-out", "0.05 m/s", "--for", "3s")
    until(lambda: any(f.identifier == 0x601 for _, f in running.heard), 60.0)
    time.sleep(moment)
    stop = command(path, "stop")
    _, said = stop.communicate(timeout=60)
    assert stop.returncode == 0, said
    out, said = jog.communicate(timeout=60)
    assert jog.returncode == 5, (out, said)
    assert STOPPED in said
    assert enabled == []
    with running.lock:
        assert slave.power.state is not State.ENABLED
