"""A simulated bench whose cell hangs on a serial line, used through the public interface."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from waiting import until
from winchkit import open_bench
from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.schema.bench import DeviceRef
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import NoiseSpec
from winchkit.sim.live.bench import LiveBench

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals"),
]


@pytest.fixture(scope="module")
def live() -> Iterator[LiveBench]:
    with LiveBench(read_simbench(find("sim", "serial-bench")), seed=1) as running:
        yield running


def test_a_serial_cell_measures_fails_and_comes_back(live: LiveBench, tmp_path: Path) -> None:
    with open_bench(live.write_bench_file(tmp_path / "bench.toml")) as bench:
        winch = bench.winch["A"]
        until(lambda: abs(winch.tension - 10 * 9.80665) < 5.0)
        winch.move_by(wind_in=0.1)
        until(lambda: abs(winch.tension - 10 * 9.80665) < 5.0)
        live.inject("A.cell", "overload")
        until(lambda: math.isnan(winch.tension))
        live.inject("A.cell", "recover")
        until(lambda: math.isfinite(winch.tension))
        live.inject("A.cell", "unplug")
        until(lambda: math.isnan(winch.tension))
        live.inject("A.cell", "replug")
        until(lambda: math.isfinite(winch.tension))


def test_a_cell_without_a_tare_of_its_own_is_tared_by_the_host(
    live: LiveBench, tmp_path: Path
) -> None:
    wiring = live.write_bench_file(tmp_path / "bench.toml")
    with open_bench(wiring) as bench:
        winch = bench.winch["A"]
        assert abs(winch.tare()) < 5.0
        reading = winch.sensors["cell"].latest
        assert reading.gross == pytest.approx(10 * 9.80665, abs=10.0)
    with open_bench(wiring) as bench:
        until(lambda: abs(bench.winch["A"].tension) < 5.0)
        assert bench.cells.sensors["A.cell"].tared is not True


def test_two_cells_share_a_line_by_their_addresses(tmp_path: Path) -> None:
    declared = read_simbench(find("sim", "serial-bench"))
    wired = declared.bench.winch["A"]
    cell = DeviceRef("mantracourt-dsc-ascii", "cell", unit=1)
    both = replace(wired, cell=cell, load=replace(cell, unit=2), load_mass=None)
    bench_spec = replace(declared.bench, winch={"A": both})
    with LiveBench(replace(declared, bench=bench_spec, noise=NoiseSpec()), seed=2) as running:
        path = running.write_bench_file(tmp_path / "bench.toml")
        with open_bench(path) as bench:
            winch = bench.winch["A"]
            until(lambda: abs(winch.tension - 10 * 9.80665) < 0.5)
            load = winch.sensors["load"]
            assert load.latest.value == pytest.approx(10 * 9.80665, abs=0.5)
            running.inject("A.cell", "silence")
            until(lambda: math.isnan(winch.snapshot.tension))
            before = load.counters.readings
            until(lambda: load.counters.readings > before)


def test_its_faults_are_its_own(live: LiveBench) -> None:
    with pytest.raises(UsageError, match="a simulated serial instrument has no fault"):
        live.inject("A.cell", "exception")
