"""A held jog at `limits.length`, in each mode of operation."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from slave import State
from slave.held_key import HeldKey, since
from slave.rig import Rig, bench_text
from slave.wire import GENERIC


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["CSV", "CSP", "PV"])
@pytest.mark.parametrize("pay_out", [0.2, -0.2])
def test_a_jog_in_every_mode_ends_at_the_length_limit(
    tmp_path: Path, mode: str, pay_out: float
) -> None:
    """It is slowed down before the limit; the way back is free."""
    device = tmp_path / mode
    shutil.copytree(GENERIC.parent, device)
    file = device / "device.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace('motion_mode = "CSV"', f'motion_mode = "{mode}"'), encoding="utf-8"
    )
    rig = Rig(tmp_path)
    bench_file = bench_text(rig.channel, device=str(file)) + 'length = ["3.8 m", "4.2 m"]\n'
    with rig.opened(bench_file) as bench:
        winch = bench.winch["A"]
        assert winch.cable_length == pytest.approx(4.0, abs=0.01)
        key = HeldKey(rig, bench, pay_out=pay_out).press()
        rig.wait(3.0)
        key.release()
        rig.wait(0.5)
        assert key.errors == []
        assert not bench.snapshot.tripped
        left = 0.2 - abs(winch.cable_length - 4.0)
        assert 0.0 <= left < 0.005, "at rest just before the limit, m"
        assert rig.slaves[0].power.state is not State.ENABLED
        again = HeldKey(rig, bench, pay_out=pay_out).press()
        rig.wait(1.0)
        again.release()
        rig.wait(0.5)
        assert abs(winch.cable_length - 4.0) <= 0.2, "held again, it goes no further"
        start = rig.time
        winch.jog(**{"wind_in" if pay_out > 0 else "pay_out": 0.1}, duration=0.5)
        assert since(rig, start).moved
        assert abs(winch.cable_length - 4.0) < 0.17
