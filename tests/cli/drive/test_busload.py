"""``winchkit busload`` against the table of worst cases of a CAN bus, counted by hand."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from command_line import done, invoke
from winchkit.drivers.can.bus.load import FrameKind, frame_bits, load_of
from winchkit.errors import NotPermitted

MEGABIT = 1_000_000
BENCH = """\
schema = 1
kind = "bench"
cycle = "{cycle}"
[bus.can]
kind = "can"
interface = "virtual"
channel = "none"
heartbeat = "1 s"
"""
WINCH = """\
[winch.{name}]
profile = "bench-spiral"
servo = {{ device = "generic-cia402", bus = "can", node = {node}, encoder = "absolute" }}
[winch.{name}.limits]
speed = "0.5 m/s"
"""


def axes(count: int) -> tuple[FrameKind, ...]:
    """One TPDO and one RPDO of 8 bytes for each axis."""
    return tuple(FrameKind(f"{n} {way}", 8, every=1) for n in range(count) for way in "tr")


@pytest.mark.parametrize(("size", "bits"), [(0, 55), (1, 65), (4, 95), (7, 125), (8, 135)])
def test_bits_of_a_frame(size: int, bits: int) -> None:
    assert frame_bits(size) == bits


@pytest.mark.parametrize(("rate", "most"), [(1000, 2), (500, 4), (250, 10), (200, 12), (100, 25)])
def test_how_many_axes_fit_into_seventy_percent(rate: int, most: int) -> None:
    assert load_of(MEGABIT, 1 / rate, axes(most)).share <= 0.7
    assert load_of(MEGABIT, 1 / rate, axes(most + 1)).share > 0.7


def test_eight_winches_at_250_hz() -> None:
    assert load_of(MEGABIT, 1 / 250, axes(8)).share == pytest.approx(0.55, abs=5e-3)


@given(
    count=st.integers(1, 40),
    every=st.integers(1, 10),
    heartbeat=st.floats(0.01, 1.0),
    bitrate=st.sampled_from([125_000, 500_000, 1_000_000]),
)
def test_the_fastest_cycle_fits_and_the_next_does_not(
    count: int, every: int, heartbeat: float, bitrate: int
) -> None:
    frames = (*axes(count), FrameKind("slow", 8, every=every))
    load = load_of(bitrate, 0.1, frames, {"host": heartbeat})
    fastest = load.fastest()
    assert load_of(bitrate, fastest, frames, {"host": heartbeat}).share <= 0.7 + 1e-9
    faster = fastest - 1e-4
    assert faster <= 0 or load_of(bitrate, faster, frames, {"host": heartbeat}).share > 0.7


def test_a_bus_that_heartbeats_fill_has_no_cycle() -> None:
    with pytest.raises(NotPermitted, match="heartbeats and timed frames alone"):
        load_of(10_000, 0.1, axes(1), {"host": 0.005}).fastest()


def bench(folder: Path, winches: int, cycle: str) -> Path:
    file = folder / "bench.toml"
    wired = (WINCH.format(name=f"W{n}", node=n) for n in range(1, winches + 1))
    file.write_text(BENCH.format(cycle=cycle) + "".join(wired))
    return file


def test_the_command_counts_the_pdos_of_the_device_file(tmp_path: Path) -> None:
    result = done("busload", bench(tmp_path, 2, "4 ms"), "--json")
    load = json.loads(result.stdout)["bus"]["can"]
    sizes = {frame["name"]: frame["size"] for frame in load["frames"]}
    # Status word, position, mode; velocity, torque, error; control word and target velocity. The
    # RPDO with the target position is sent in CSP only.
    assert sizes["W1 TPDO 1"] == 7
    assert sizes["W1 TPDO 2"] == 8
    assert sizes["W1 RPDO 1"] == 6
    assert "W1 RPDO 2" not in sizes
    per_cycle = 55 + 2 * (125 + 135 + 115)
    expected = per_cycle * 250 / 1e6 + 3 * 65 / 1e6
    assert load["share"] == pytest.approx(expected)
    assert load["fastest_cycle"] == pytest.approx(1.2e-3)


def test_the_bench_may_be_an_option_as_in_other_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = bench(tmp_path, 1, "4 ms")
    expected = invoke("busload", file).stdout
    assert expected
    assert invoke("busload", "-b", file).stdout == expected
    assert invoke("busload", "--bench", file, file).stdout == expected
    two = done("busload", file, "-b", "other.toml", code=2)
    assert "two bench files" in two.stderr
    monkeypatch.chdir(tmp_path)
    assert invoke("busload").stdout == expected
    monkeypatch.setenv("WINCHKIT_BENCH", "other.toml")
    assert invoke("busload", file).stdout == expected
    assert "other.toml" in invoke("busload").stderr


def test_a_bus_that_is_too_full_fails_the_check(tmp_path: Path) -> None:
    result = done("busload", bench(tmp_path, 8, "2 ms"), code=1)
    assert "152" in result.stdout.split("%")[0]
    assert "fastest that fits: 4.4 ms" in result.stdout
    assert invoke("busload", bench(tmp_path, 8, "5 ms")).exit_code == 0
