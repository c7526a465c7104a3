"""A bench whose load cell is a CANopen node beside the drive, from declaration to tension."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit import catalog
from winchkit.bench.open import open_bench
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench

pytestmark = pytest.mark.realtime


def test_a_bench_with_its_cell_on_the_can_bus(tmp_path: Path) -> None:
    text = (catalog.folder("sim") / "spiral-bench.toml").read_text()
    cell = 'cell = { device = "laumas-tlb", bus = "instruments", unit = 1, rate = "100 Hz" }'
    assert cell in text
    declared = tmp_path / "can-cell.toml"
    on_can = 'cell = { device = "generic-cia404", bus = "can", node = 9 }'
    declared.write_text(text.replace(cell, on_can))
    with (
        LiveBench(read_simbench(declared)) as live,
        open_bench(live.write_bench_file(tmp_path / "bench.toml")) as bench,
    ):
        cell_a = bench.winch["A"].sensors["cell"]
        assert cell_a.latest is not None
        assert bench.winch["A"].tension == pytest.approx(10 * 9.81, rel=0.1)
        assert bench.winch["A"].snapshot.quality is not None
        bench.winch["A"].tare()
        bench.clock.sleep(0.3)
        assert bench.winch["A"].tension == pytest.approx(0.0, abs=10)
