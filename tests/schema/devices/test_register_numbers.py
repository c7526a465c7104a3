"""Registers' numbers of manuals (40008) that stand where an address (7) is due."""

from __future__ import annotations

import pytest

from winchkit import catalog
from winchkit.schema.devices.modbus import ReadBlock
from winchkit.schema.read import load


@pytest.mark.parametrize(
    ("start", "address", "function"),
    [(40_001, 0, 3), (40_008, 7, 3), (49_999, 9998, 3), (30_001, 0, 4), (30_103, 102, 4)],
)
def test_a_number_of_a_manual_is_pointed_out(start: int, address: int, function: int) -> None:
    assert f"start = {address}, function = {function}" in ReadBlock(start, 4).doubt


@pytest.mark.parametrize("start", [0, 7, 9999, 30_000, 40_000, 50_000])
def test_an_address_is_none(start: int) -> None:
    assert ReadBlock(start, 4).doubt == ""


@pytest.mark.parametrize("name", catalog.names("devices"))
def test_no_shipped_device_has_one(name: str) -> None:
    warnings = load(catalog.find("devices", name)).warnings
    assert not [one for one in warnings if "register's number" in one.message]
