"""Declarations by name: shipped ones, and those beside a file."""

from __future__ import annotations

from pathlib import Path

from winchkit import catalog


def test_a_file_in_the_folder_is_found_before_a_shipped_one(tmp_path: Path) -> None:
    bench, own = tmp_path / "bench.toml", tmp_path / "generic-cia402.toml"
    bench.touch()
    own.touch()
    assert catalog.find("devices", "generic-cia402", bench) == own


def test_a_file_that_has_the_name_of_its_own_device_means_the_shipped_one(tmp_path: Path) -> None:
    bench = tmp_path / "generic-cia402.toml"
    bench.touch()
    shipped = catalog.folder("devices") / "generic-cia402" / "device.toml"
    assert catalog.find("devices", "generic-cia402", bench) == shipped
    assert catalog.find("devices", "generic-cia402", str(bench)) == shipped
