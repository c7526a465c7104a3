"""Load cells that fail or read too much, and eight winches that stop in one SYNC."""

from __future__ import annotations

from pathlib import Path

import pytest

from slave import Slave
from slave.cell import Cell
from slave.held_key import HeldKey, jogging, observe
from slave.rig import CYCLE, Rig, bench_text
from slave.wire import GENERIC
from winchkit.drivers.reading import Quality


def rig_of(folder: Path, winches: int = 1) -> Rig:
    return Rig(folder, [Slave.from_file(GENERIC, number + 1) for number in range(winches)])


@pytest.mark.parametrize(
    ("change", "within", "cause"),
    [
        ("silent", 0.36, "no load cell reading"),
        ("fault", 0.06, "reads no number"),
        ("overload", 0.06, "reads no number"),
    ],
)
def test_a_cell_that_says_nothing_stops_it(
    tmp_path: Path, change: str, within: float, cause: str
) -> None:
    rig = rig_of(tmp_path)
    with rig.opened() as bench:
        cell = Cell(rig).fit(bench)
        key = jogging(rig, bench)
        start = rig.time
        if change == "silent":
            cell.silent = True
        else:
            cell.quality = Quality[change.upper()]
        rig.wait(1.0)
        seen = observe(rig, key, start)
        assert seen.left <= within
        assert cause in seen.cause
        key.release()


def test_an_over_tension_stops_winding_in_and_lets_it_out(tmp_path: Path) -> None:
    rig = rig_of(tmp_path)
    limits = {"tension_high": "200 N"}
    with rig.opened(bench_text(rig.channel, limits=limits)) as bench:
        tension = [100.0]
        Cell(rig, lambda: tension[0]).fit(bench)
        key = jogging(rig, bench, pay_out=-0.1)
        start = rig.time
        tension[0] = 250.0
        rig.wait(1.0)
        seen = observe(rig, key, start)
        assert seen.left <= 0.04
        assert "above tension_high" in seen.cause
        key.release()
        rig.wait(1.0)
        bench.reset()
        rig.wait(1.0)
        out = HeldKey(rig, bench, pay_out=0.1).press()
        rig.wait(1.0)
        assert rig.slaves[0].motor.velocity < -10 or rig.slaves[0].motor.velocity > 10
        out.release()
        rig.wait(1.0)


@pytest.mark.slow
def test_eight_winches_stop_in_one_sync(tmp_path: Path) -> None:
    rig = rig_of(tmp_path, 8)
    with rig.opened() as bench:
        keys = [jogging(rig, bench, winch=name) for name in "ABCDEFGH"]
        start = rig.time
        rig.slaves[3].inject("drive fault")
        rig.wait(1.0)
        left = [observe(rig, key, start, n).left for n, key in enumerate(keys)]
        others = [time for n, time in enumerate(left) if n != 3]
        assert max(others) - min(others) <= 1e-3
        assert max(others) <= 3 * CYCLE + 2e-3
        for key in keys:
            key.release()
