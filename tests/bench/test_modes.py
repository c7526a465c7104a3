"""Modes of operation on a bench: how each moves, and limits and option codes that a drive gets."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from winchkit import catalog, open_bench
from winchkit.cli.bench.keyboard_jog import HeldKey, Press, split_keys
from winchkit.errors import FileError, NotPermitted
from winchkit.runs import read_run
from winchkit.schema.bench import BenchSpec
from winchkit.schema.devices.servo import OptionSpec
from winchkit.schema.read import read_bench, read_simbench
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.testing.opened import OpenedBench


def declared(**changes: object) -> SimBench:
    """The shipped spiral bench without instruments, its winch changed."""
    sim = read_simbench(catalog.find("sim", "spiral-bench"))
    bare = replace(sim.bench.winch["A"], cell=None, length=None, temperature=None)
    winch = replace(bare, **changes)  # type: ignore[arg-type]
    buses = {"can": sim.bench.bus["can"]}
    return replace(sim, bench=replace(sim.bench, winch={"A": winch}, bus=buses))


def test_the_drive_keeps_the_limits_that_it_is_given() -> None:
    limits = declared().bench.winch["A"].limits
    limits = replace(limits, in_drive=True, following_error=0.05, torque=1.5)
    sim = declared(limits=limits, options=OptionSpec(quick_stop=6))
    clock = SimulatedClock()
    with LiveBench(sim, simulated_time=clock) as live, open_bench(live.bench_spec, clock) as bench:
        objects, winch = live.winches["A"].drive.objects, bench.winch["A"]
        turn = objects.number(0x608F, 1) / objects.number(0x608F, 2)
        low, high = (objects.number(0x607D, sub) / turn * 2 * math.pi for sub in (1, 2))
        # Winding in shortens the cable: the lowest angle goes with the longest one.
        assert winch.length_at(low) == pytest.approx(limits.length[1] + 0.02, abs=1e-4)
        assert winch.length_at(high) == pytest.approx(limits.length[0] - 0.02, abs=1e-4)
        error = objects.number(0x6065) / turn * 2 * math.pi
        assert error * winch.cable.arm(0.0) == pytest.approx(0.05, rel=1e-3)
        rated = objects.number(0x6076) * 1e-3
        assert objects.number(0x6072) * 1e-3 * rated == pytest.approx(1.5, rel=1e-3)
        assert objects.number(0x605A) == 6


def test_a_bench_without_them_leaves_the_drive_alone() -> None:
    clock = SimulatedClock()
    with LiveBench(declared(), simulated_time=clock) as live:
        objects = live.winches["A"].drive.objects
        keys = [(0x607D, 1), (0x607D, 2), (0x6065, 0), (0x6072, 0), (0x605A, 0)]
        before = [objects.number(*key) for key in keys]
        with open_bench(live.bench_spec, clock):
            assert [objects.number(*key) for key in keys] == before


def test_a_coasting_code_is_refused_without_a_brake() -> None:
    sim = declared(options=OptionSpec(quick_stop=0), brake=False)
    clock = SimulatedClock()
    with (
        LiveBench(sim, simulated_time=clock) as live,
        pytest.raises(NotPermitted, match="hanging load falls"),
    ):
        open_bench(live.bench_spec, clock)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("in_drive = true", "needs `length`, the limits that the drive"),
        ('torque = "1"', "has no unit"),
        ('following_error = "-1 mm"', "above 0"),
    ],
)
def test_wiring_that_cannot_be_meant(tmp_path: Path, line: str, words: str) -> None:
    file = tmp_path / "bench.toml"
    text = BENCH + line + "\n"
    file.write_text(text)
    with pytest.raises(FileError, match=words):
        read_bench(file)


def test_a_bench_file_with_all_of_it(tmp_path: Path) -> None:
    file = tmp_path / "bench.toml"
    file.write_text(
        BENCH + 'length = ["1 m", "2 m"]\nin_drive = true\ntorque = "1 N m"\n'
        "[winch.A.options]\nquick_stop = 6\n"
    )
    spec: BenchSpec = read_bench(file)
    assert spec.stop_together is False
    assert spec.winch["A"].options.quick_stop == 6
    assert spec.winch["A"].limits.torque == 1.0


BENCH = """\
schema = 1
kind = "bench"
stop_together = false
[bus.c]
kind = "can"
interface = "virtual"
channel = "c"
[winch.A]
profile = "bench-spiral"
servo = { device = "generic-cia402", bus = "c", node = 1, encoder = "absolute" }
[winch.A.limits]
speed = "0.5 m/s"
"""


def declared_in(tmp_path: Path, mode: str = "CSV", winches: str = "A") -> SimBench:
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
    with OpenedBench(declared_in(tmp_path, mode)) as sim:
        winch = sim.bench.winch["A"]
        winch.move_to(3.7, 0.3)
        with sim.live.up_to_date():
            assert sim.live.winches["A"].plant.cable_length == pytest.approx(3.7, abs=5e-3)
        winch.jog(pay_out=0.2, duration=0.5)
        assert 3.73 < winch.cable_length < 3.81
        assert not sim.bench.snapshot.tripped


def test_two_winches_move_together_and_share_a_log(tmp_path: Path) -> None:
    with OpenedBench(declared_in(tmp_path, winches="AB")) as sim:
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
    with LiveBench(declared_in(tmp_path)) as live:
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
