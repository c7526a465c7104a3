"""Commands and stations that reach a bench through the process that owns it, in real time."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from can_commands import Served, length, served, without_trip
from command_line import done, invoke
from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.remote.client import RemoteStation, attach
from winchkit.errors import UsageError

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("attached"), "AB", paced=True) as found:
        yield found


@pytest.fixture
def bench(running: Served) -> Served:
    """The served bench, without a trip that another test has left latched."""
    return without_trip(running)


def test_who_attaches_does_the_same_through_the_owner(bench: Served) -> None:
    with open_bench(bench.file) as opened, owned(opened) as station:
        with pytest.raises(UsageError, match="either to a cable length or by a change"):
            station.move("A")
        station.move("all", pay_out=0.05, speed=0.3)
        while station.moving("all"):
            time.sleep(0.02)
        assert [item.winch for item in station.scan()] == ["A", "B"]
        assert {item.heartbeat for item in station.scan()} == {"operational"}
        told = station.upload("A", 0x6007, 0)
        assert told[0] == bench.number(0x6007)
        assert station.upload("A", 0x5FFF, 0) is None
        # The other commands of this process go through the owner as well.
        assert "mode CSV" in invoke("info", "A", "-b", bench.file).stdout
        refused = done("config", "store", "A", "-b", bench.file, "--yes", code=5)
        assert "is owned by another process" in refused.stderr
        done("lss", "list", "-b", bench.file, code=5)


def test_whoever_goes_away_during_a_homing_stops_it(bench: Served) -> None:
    with open_bench(bench.file) as opened, owned(opened) as station:
        begun = length(bench, "B")
        station.home("B", 33, None, 0.05)
        while abs(length(bench, "B") - begun) < 5e-3:
            assert station.homing()
            time.sleep(0.01)
        station.close()
        deadline = time.monotonic() + 10
        while opened.axes["B"].mode != "CSV":
            assert time.monotonic() < deadline, "it is still in HM"
            time.sleep(0.02)
        assert opened.winch["B"].snapshot.phase is Phase.DISABLED
        assert length(bench, "B") == pytest.approx(begun, abs=0.2)


@contextmanager
def owned(bench: Bench) -> Iterator[RemoteStation]:
    """A station as another process would have it."""
    station = attach(bench.spec)
    try:
        yield station
    finally:
        station.close()


def test_stop_is_done_by_the_owner(bench: Served) -> None:
    with open_bench(bench.file) as opened, owned(opened):
        through = invoke("stop", "-b", bench.file)
        assert through.stdout.count("the bench's owner confirms it at rest") == 2
