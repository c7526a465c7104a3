"""Other motion modes, several winches, and parts of the keyboard by themselves."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from winchkit import catalog, open_bench
from winchkit.cli.bench.keyboard_jog import HeldKey, Press, split_keys
from winchkit.errors import NotPermitted
from winchkit.runs import read_run
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import SimBench
from winchkit.sim.live.bench import LiveBench
from winchkit.testing.opened import OpenedBench


def declared(tmp_path: Path, mode: str = "CSV", winches: str = "A") -> SimBench:
    """The spiral bench with drives in another mode, or with more winches."""
    folder = tmp_path / f"drive-{mode}"
    shutil.copytree(catalog.find("devices", "generic-cia402").parent, folder)
    path = folder / "device.toml"
    path.write_text(path.read_text().replace('motion_mode = "CSV"', f'motion_mode = "{mode}"'))
    spiral = read_simbench(catalog.find("sim", "spiral-bench"))
    one, truth = spiral.bench.winch["A"], spiral.truth["A"]
    wiring = {}
    for number, name in enumerate(winches):
        units = {
            role: replace(getattr(one, role), unit=getattr(one, role).unit + 10 * number)
            for role in ("cell", "length", "temperature")
        }
        servo = replace(one.servo, device=str(path), node=number + 1)
        wiring[name] = replace(one, servo=servo, **units)
    return replace(
        spiral, bench=replace(spiral.bench, winch=wiring), truth=dict.fromkeys(winches, truth)
    )


@pytest.mark.parametrize("mode", ["CSP", "PV"])
def test_the_same_motion_in_another_mode(mode: str, tmp_path: Path) -> None:
    with OpenedBench(declared(tmp_path, mode)) as sim:
        winch = sim.bench.winch["A"]
        winch.move_to(3.7, 0.3)
        with sim.live.up_to_date():
            assert sim.live.winches["A"].plant.cable_length == pytest.approx(3.7, abs=5e-3)
        winch.jog(pay_out=0.2, duration=0.5)
        assert 3.73 < winch.cable_length < 3.81
        assert not sim.bench.snapshot.tripped


def test_two_winches_move_together_and_share_a_log(tmp_path: Path) -> None:
    with OpenedBench(declared(tmp_path, winches="AB")) as sim:
        bench, path = sim.bench, tmp_path / "two.csv"
        with bench.log(path):
            bench.winch["A"].move_to(3.7, 0.3, wait=False)
            bench.winch["B"].move_to(4.2, 0.3, wait=False)
            for winch in bench.winch.values():
                winch.wait()
        run = read_run(path)
        assert run.winches() == ["A", "B"]
        for name, length in (("A", 3.7), ("B", 4.2)):
            own = run.of_winch(name)
            assert own["cable_length"][-1] == pytest.approx(length, abs=5e-3)
            assert np.isfinite(own["tension"]).mean() > 0.95
        bench.winch["A"].move_to(3.0, 0.3, wait=False)
        sim.live.inject("B.servo", "silence")
        with pytest.raises(Exception, match="winch B"):
            bench.winch["A"].wait()
        assert bench.winch["A"].cable_length > 3.1


def test_a_drive_without_the_mode_is_not_opened(tmp_path: Path) -> None:
    with LiveBench(declared(tmp_path)) as live:
        with live.up_to_date():
            live.winches["A"].drive.objects.put(0x6502, 0, 0x01)
        with pytest.raises(NotPermitted, match="no mode CSV"):
            open_bench(live.bench_spec)


def test_a_held_key_refreshes_shortly_and_a_single_press_lasts() -> None:
    held = HeldKey()
    assert held.press("up", 0.0) is Press.NEW
    assert held.press("up", 0.5) is Press.REPEAT
    assert held.press("up", 0.53) is Press.REPEAT
    assert held.press("up", 0.9) is Press.NEW, "released in between"
    assert held.press("down", 1.0) is Press.NEW, "another key"
    held.ignore({"up", "down"}, 2.0)
    assert held.press("down", 2.6) is Press.IGNORED
    assert held.press("up", 3.2) is Press.IGNORED
    assert held.press("up", 3.8) is Press.IGNORED, "it was held all the time"
    assert held.press("up", 4.6) is Press.NEW


def test_keys_of_a_terminal() -> None:
    assert split_keys("\x1b[A\x1b[A \x1bOBq") == ["up", "up", " ", "down", "q"]
