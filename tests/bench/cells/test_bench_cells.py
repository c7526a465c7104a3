"""Instruments of a bench that is owned: what ``winchkit cell`` does there from outside."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from waiting import until
from winchkit import catalog, open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.remote.client import attach
from winchkit.cli.cell.group import command
from winchkit.errors import NotPermitted, UsageError
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock

pytestmark = pytest.mark.realtime

WEIGHT = 10 * 9.80665


@pytest.fixture
def clock() -> PacedClock:
    """Stands still while this machine is busy elsewhere."""
    return PacedClock()


@pytest.fixture
def wiring(tmp_path: Path, clock: PacedClock) -> Iterator[Path]:
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    with LiveBench(declared, seed=3, clock=clock.simulation) as live:
        yield live.write_bench_file(tmp_path / "bench.toml")


@pytest.fixture
def bench(wiring: Path, clock: PacedClock) -> Iterator[Bench]:
    with open_bench(wiring, clock) as opened:
        opened.on_cycle(clock.control)
        yield opened


def run(*arguments: str | Path, error: type[BaseException] | None = None) -> Result:
    result = CliRunner().invoke(command, [str(word) for word in arguments])
    if error is None:
        assert isinstance(result.exception, SystemExit | None), result.exception
    else:
        assert isinstance(result.exception, error)
    return result


def test_every_cell_command_works_at_the_owner(bench: Bench, wiring: Path) -> None:
    facts = json.loads(run("info", "-b", wiring, "--json").stdout)
    assert facts["reading"]["value"] == pytest.approx(WEIGHT, abs=8)
    assert facts["device"]["name"] == "laumas-tlb"
    rate = json.loads(run("rate", "A", "-b", wiring, "--for", "0.5s", "--json").stdout)
    assert rate["rate"] > 5
    assert "noise" in run("diagnose", "-b", wiring, "--for", "0.5s").output
    tared = json.loads(run("tare", "-b", wiring, "--for", "0.3s", "--json").stdout)
    assert tared["before"] == pytest.approx(WEIGHT, abs=8)
    assert abs(bench.winch["A"].tension) < 8, "the owner counts from there"
    assert (wiring.parent / "bench.tares.toml").is_file()
    run("tare", "--clear", "-b", wiring)
    run("zero", "-b", wiring, "--for", "0.3s")
    assert abs(bench.winch["A"].tension) < 8
    run("store", "-b", wiring, "--yes")


def test_no_zero_and_no_tare_while_the_winch_moves(bench: Bench, wiring: Path) -> None:
    bench.winch["A"].move_by(wind_in=1.5, speed=0.1, wait=False)
    until(lambda: abs(bench.winch["A"].snapshot.cable_speed) >= 0.02)
    for words in (["zero"], ["tare"], ["tare", "--device"], ["store", "--yes"]):
        assert bench.winch["A"].moving
        failed = run(*words, "-b", wiring, error=NotPermitted)
        assert "stop it first" in str(failed.exception)
    run("info", "-b", wiring)
    assert bench.winch["A"].moving, "nobody was disturbed"


def test_tares_are_restored_to_what_they_were_before(bench: Bench, wiring: Path) -> None:
    station = attach(bench.spec)
    assert station is not None

    def comes(tares: object, net: float) -> None:
        end = time.monotonic() + 10
        while station.cell("tares", "A") != tares or abs(bench.winch["A"].tension - net) > 8:
            assert time.monotonic() < end, (station.cell("tares", "A"), bench.winch["A"].tension)
            time.sleep(0.01)

    try:
        none = station.cell("tares", "A")
        assert none == {"device": False, "host": None}
        station.cell("host tare", "A", 0.3)
        by_host = station.cell("tares", "A")
        assert by_host["host"]["value"] == pytest.approx(WEIGHT, abs=8)
        station.tare("A")
        assert station.status()["tare"]["A"] == pytest.approx(2 * WEIGHT, abs=16)
        station.cell("restore tares", "A", by_host)
        comes(by_host, 0.0)
        kept = (wiring.parent / "bench.tares.toml").read_text()
        assert by_host["host"]["taken"][:10] in kept
        station.cell("restore tares", "A", none)
        comes(none, WEIGHT)
        assert station.status()["tare"]["A"] == 0.0
        station.tare("A")
        by_device = station.cell("tares", "A")
        with pytest.raises(NotPermitted, match="keeps no earlier one"):
            station.cell("restore tares", "A", by_device)
    finally:
        station.close()


def test_an_unknown_task_is_refused(bench: Bench) -> None:
    station = attach(bench.spec)
    try:
        with pytest.raises(UsageError, match="no task 'melt'"):
            station.cell("melt", "A")
        with pytest.raises(UsageError, match="no instrument 'Q'"):
            station.cell("about", "Q")
    finally:
        station.close()
