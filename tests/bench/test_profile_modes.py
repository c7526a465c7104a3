"""Limits and option codes that a bench file hands on to the drive itself."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from winchkit import catalog, open_bench
from winchkit.errors import FileError, NotPermitted
from winchkit.schema.bench import BenchSpec
from winchkit.schema.devices.servo import OptionSpec
from winchkit.schema.read import read_bench, read_simbench
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench


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
        assert limits.length is not None
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
