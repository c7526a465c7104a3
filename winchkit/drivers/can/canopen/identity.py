"""Which shipped device file fits a drive, by the numbers of its identity object."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from winchkit import catalog

_NUMBER = re.compile(r"^\s*(VendorNumber|ProductNumber)\s*=\s*(\w+)\s*$", re.MULTILINE)
SERVO_PROFILE = 402
"""Device profile number in the lower 16 bits of 1000h: CiA 402, drives."""
_GENERIC = "generic-cia402"


@dataclass(frozen=True)
class Identity:
    """Object 1018h; 0 for a part that the device does not have."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0

    def __str__(self) -> str:
        parts = f"vendor {self.vendor:04X}h product {self.product:08X}h"
        return f"{parts} revision {self.revision:08X}h serial {self.serial}"


def fitting_device(identity: Identity, device_type: int | None) -> str:
    """Name of the shipped device file for a drive; empty where none fits.

    The same vendor and product, else the only file of that vendor, else the generic drive for
    whatever says in 1000h that it keeps to CiA 402.
    """
    shipped = {name: _numbers(name) for name in catalog.names("devices")}
    exact = [
        name for name, numbers in shipped.items() if numbers == (identity.vendor, identity.product)
    ]
    if exact:
        return exact[0]
    same = [name for name, (vendor, _) in shipped.items() if vendor and vendor == identity.vendor]
    if len(same) == 1:
        return same[0]
    servo = device_type is not None and device_type & 0xFFFF == SERVO_PROFILE
    return _GENERIC if servo and _GENERIC in shipped else ""


def _numbers(name: str) -> tuple[int | None, int | None]:
    """Vendor and product of a device file's EDS; None where it has none."""
    eds = next(iter(sorted(catalog.find("devices", name).parent.glob("*.eds"))), None)
    found = _declared(eds) if eds is not None else {}
    return found.get("VendorNumber"), found.get("ProductNumber")


def _declared(eds: Path) -> dict[str, int]:
    text = eds.read_text(encoding="latin-1")
    return {key: int(value, 0) for key, value in _NUMBER.findall(text) if value[:1].isdecimal()}
