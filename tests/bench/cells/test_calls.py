"""Load cells as Python calls: information, rate, examination, tare, zero, EEPROM."""

from __future__ import annotations

from pathlib import Path

import pytest

import winchkit
from served import Served
from winchkit.errors import NotPermitted, UsageError


def test_information_and_rate(cell: Served, tmp_path: Path) -> None:
    bench = cell.bench(tmp_path, ', rate = "40 Hz"')
    facts = winchkit.cell_info(bench)
    assert facts.identity["serial number"] == 4711
    assert facts.reading.value == pytest.approx(100.0, abs=3)
    report = winchkit.cell_rate(bench, "A", duration=0.5)
    assert report.limits["`rate` in the wiring"] == 40.0
    assert report.rate < 50.0
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
    done = winchkit.cell_tare(bench, duration=0.2, device=True)
    assert done.before == pytest.approx(160.0, abs=0.2)
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
