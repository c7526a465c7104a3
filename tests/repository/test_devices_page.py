"""docs/devices.md and docs/howto/drive.md are what device files and schema declare."""

from __future__ import annotations

import runpy
from collections.abc import Callable, Sequence
from pathlib import Path

from winchkit.catalog import find, names
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device

ROOT = Path(__file__).parents[2]


def test_the_page_is_what_the_device_files_say() -> None:
    made = runpy.run_path(str(ROOT / "docs/make_devices.py"))
    page: Callable[[Sequence[DeviceSpec]], str] = made["page"]
    devices = [read_device(find("devices", name)) for name in names("devices")]
    there = (ROOT / "docs/devices.md").read_text(encoding="utf-8")
    assert there == page(devices), "run: python docs/make_devices.py"
    drive_page = (ROOT / "docs/howto/drive.md").read_text(encoding="utf-8")
    assert drive_page == made["drive_page"](), "run: python docs/make_devices.py"
    for device in devices:
        assert (f"## {device.name}\n" in there) == (device.servo is None)
