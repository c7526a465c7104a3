"""Load cells without drives: a bench file of them alone, and ``winchkit cell`` as Python calls."""

from __future__ import annotations

from pathlib import Path

import pytest

import winchkit
from command_line import done
from served import Served
from winchkit.errors import FileError, NotPermitted, UsageError
from winchkit.runs import read_run
from winchkit.schema.read import read_bench, read_tares


@pytest.fixture
def bench(cell: Served, tmp_path: Path) -> Path:
    """The bench of one cell, without what a drive needs."""
    host, port = cell.line.address
    path = tmp_path / "cells.toml"
    path.write_text(
        f'schema = 1\nkind = "bench"\n[bus.cells]\nkind = "modbus-tcp"\nhost = "{host}"\n'
        f'port = {port}\n[winch.A]\ncell = {{ device = "laumas-tlb", bus = "cells", unit = 1 }}\n'
    )
    return path


def test_it_is_read_and_tared(bench: Path) -> None:
    assert "ok (bench 'cells')" in done("check", bench).output
    assert "laumas-tlb" in done("cell", "info", "-b", bench).output
    done("cell", "tare", "-b", bench)
    assert read_tares(bench.with_name("cells.tares.toml")).tare["A.cell"].value == pytest.approx(
        100, abs=2
    )
    done("cell", "tare", "--clear", "-b", bench)
    told = done("tare", "A", "-b", bench).output
    assert abs(float(told.split("reads ")[1].split(" N")[0])) < 2


@pytest.mark.parametrize("suffix", [".mcap", ".csv"])
def test_its_log_is_a_run_of_the_cell(bench: Path, suffix: str) -> None:
    file = bench.with_name(f"rest{suffix}")
    done("log", "-b", bench, "-o", file, "--for", "1s")
    found = read_run(file)
    assert set(found) == {"tension", "tension_gross"}
    assert found["tension"].mean() == pytest.approx(100, abs=2)
    assert len(found) > 20
    assert "/drive" not in done("log", "info", file).output
    assert "noise" in done("cell", "diagnose", "--run", file).output
    for command in ("compare", "diagnose"):
        assert "motor_angle" in done(command, file, "-p", "bench-spiral", code=3).output


@pytest.mark.parametrize(
    "words",
    [
        ("jog", "--pay-out", "10mm"),
        ("monitor",),
        ("stop",),
        ("reset",),
        ("commission",),
        ("log", "--jsonl", "--for", "1s"),
        ("serve", "--no-browser"),
    ],
)
def test_what_needs_a_drive_is_refused_with_what_there_is(
    bench: Path, words: tuple[str, ...]
) -> None:
    told = done(*words, "-b", bench, code=2).output
    assert "instruments" in told


@pytest.mark.parametrize(
    ("winches", "said"),
    [
        ("[winch.A]\n", "has neither an instrument"),
        ('[winch.A]\ncell = { device = "laumas-tlb", bus = "x", unit = 1 }\n', "no [bus.x]"),
        ("[winch.A]\nCELL\nbrake = true\n", "unknown key"),
        ('[winch.A]\nCELL\n[winch.B]\nprofile = "bench-spiral"\n', "missing"),
        ("[cells.A]\nCELL\n", "unknown key"),
    ],
)
def test_half_a_winch_is_a_fault_with_its_line(tmp_path: Path, winches: str, said: str) -> None:
    path = tmp_path / "bench.toml"
    cell = 'cell = { device = "laumas-tlb", bus = "c", unit = 1 }'
    head = 'schema = 1\nkind = "bench"\n[bus.c]\nkind = "modbus-tcp"\nhost = "h"\nport = 502\n'
    path.write_text(head + winches.replace("CELL", cell))
    with pytest.raises(FileError) as refused:
        read_bench(path)
    told = [fault for fault in refused.value.faults if said in fault.message]
    assert told
    assert told[0].line is not None
    assert told[0].line >= 7


def test_a_bench_of_cells_has_no_winch_to_name(bench: Path) -> None:
    with pytest.raises(UsageError, match="only the instruments of A"):
        read_bench(bench).winch_named("A")


def test_information_and_rate(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path, ', rate = "40 Hz"')
    facts = winchkit.cell_info(bench)
    assert facts.identity["serial number"] == 4711
    assert facts.reading.value == pytest.approx(100.0, abs=3)
    report = winchkit.cell_rate(bench, "A", duration=0.5)
    assert report.limits["`rate` in the wiring"] == 40.0
    assert report.rate < 50.0
    assert report.exchange is not None
    assert report.exchange.queries == 1
    assert 0.0 < report.latency.p50 <= report.latency.worst
    with pytest.raises(UsageError, match=r"the bench has A\.cell"):
        winchkit.cell_info(bench, "B")


def test_tares_of_host_and_device_are_set_and_removed(cell: Served, tmp_path: Path) -> None:
    cell.noise = 0.02
    bench = cell.bench(tmp_path)
    host = winchkit.cell_tare(bench, duration=0.2)
    assert host.tare == pytest.approx(100.0, abs=0.1)
    assert winchkit.cell_info(bench).reading.value == pytest.approx(0.0, abs=0.2)
    assert winchkit.cell_tare(bench, clear=True).removed == pytest.approx(100.0, abs=0.1)
    cell.force = 160.0
    result = winchkit.cell_tare(bench, duration=0.2, device=True)
    assert result.before == pytest.approx(160.0, abs=0.2)
    assert winchkit.cell_info(bench).tare.device is True
    winchkit.cell_tare(bench, duration=0.2, device=True, clear=True)
    assert winchkit.cell_info(bench).tare.device is False
    assert cell.cell.stored == 0, "no tare writes the EEPROM"


def test_zero_and_store(cell: Served, tmp_path: Path) -> None:
    cell.noise = 0.02
    bench = cell.bench(tmp_path)
    assert winchkit.cell_zero(bench, duration=0.2).after == pytest.approx(0.0, abs=0.5)
    with pytest.raises(NotPermitted):
        winchkit.cell_store(bench, "tare")
    assert cell.cell.stored == 0
    winchkit.cell_store(bench, "store")
    assert cell.cell.stored == 1


def test_health_measures_the_noise_that_is_there(cell: Served, tmp_path: Path) -> None:
    cell.noise = 0.5
    health = winchkit.cell_health(cell.bench(tmp_path), duration=1.0)
    assert health.noise == pytest.approx(0.5, rel=0.4)
