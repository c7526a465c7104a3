"""Numbers of device files: units written as products, and registers' numbers of manuals."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import FileError, UsageError
from winchkit.schema.devices.drive_unit import DriveUnit, product_of
from winchkit.schema.devices.modbus import ReadBlock
from winchkit.schema.devices.register_numbers import address_of
from winchkit.schema.read import load


@pytest.mark.parametrize(
    ("start", "address", "function"),
    [(40_001, 0, 3), (40_008, 7, 3), (49_999, 9998, 3), (30_001, 0, 4), (30_103, 102, 4)],
)
def test_a_number_of_a_manual_is_pointed_out(start: int, address: int, function: int) -> None:
    assert f"start = {address}, function = {function}" in ReadBlock(start, 4).doubt


NUMBERED = """\
schema = 1
kind = "device"
name = "indicator"
maker = "any"
model = "any"
source = "manual"
trust = "manual"
[modbus]
value = "net"
status_register = 40012
[modbus.status]
overload = [0]
[modbus.read]
register = 40008
count = 5
[[modbus.field]]
name = "gross"
register = 40008
type = "i32"
unit = "N"
decimals = { register = 40012 }
[[modbus.field]]
name = "net"
register = 40010
type = "i32"
unit = "N"
[[modbus.identity]]
name = "serial"
register = 40100
type = "u16"
[modbus.command.tare]
register = 40006
value = 7
unlock = [{ register = 40005, value = 1 }]
"""


def by_address(text: str) -> str:
    """The same file with addresses, each five-digit number less 40001."""
    addressed = re.sub(r"4\d{4}", lambda found: str(int(found[0]) - 40_001), text)
    return addressed.replace("[modbus.read]\nregister", "[modbus.read]\nstart")


def test_a_map_with_numbers_is_that_with_addresses(tmp_path: Path) -> None:
    for name, text in (("numbers.toml", NUMBERED), ("addresses.toml", by_address(NUMBERED))):
        (tmp_path / name).write_text(text)
    numbers, addresses = (load(tmp_path / n) for n in ("numbers.toml", "addresses.toml"))
    assert numbers.value.modbus == addresses.value.modbus
    assert numbers.value.modbus.read.start == 7
    assert not numbers.warnings


@pytest.mark.parametrize(
    ("number", "start", "function"),
    [(40_001, 0, 3), (30_103, 102, 4), (400_001, 0, 3), (465_536, 65_535, 3), (310_000, 9999, 4)],
)
def test_addresses_of_numbers(number: int, start: int, function: int) -> None:
    assert address_of(number) == (start, function)


@pytest.mark.parametrize("number", [0, 7, 40_000, 50_000, 29_999, 10_001, 465_537, 400_000, -4])
def test_other_numbers_have_no_address(number: int) -> None:
    assert address_of(number) is None


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("register = 40010", "register = 9", 24, "9 is no register's number"),
        ("register = 40010", 'register = "4x10"', 24, "'4x10' is no register's number"),
        ("count = 5", "count = 5\nfunction = 4", 16, "40008 is read by function 3"),
        ("register = 40006", "register = 30006", 32, "30006 cannot be written"),
        ("register = 40008\ncount", "start = 400008\ncount", 14, "register = 400008 is a man"),
        ("count = 5", "count = 5\nstart = 7", 16, "is an address beside numbers"),
    ],
)
def test_a_map_of_both_is_refused_with_its_line(
    tmp_path: Path, old: str, new: str, line: int, said: str
) -> None:
    path = tmp_path / "device.toml"
    assert old in NUMBERED
    path.write_text(NUMBERED.replace(old, new))
    with pytest.raises(FileError, match=said) as refused:
        load(path)
    told = next(fault for fault in refused.value.faults if said in fault.message)
    assert told.line == line


@pytest.mark.parametrize("start", [0, 7, 9999, 30_000, 40_000, 50_000])
def test_an_address_is_none(start: int) -> None:
    assert ReadBlock(start, 4).doubt == ""


_ANGLES = {"rad": 1.0, "deg": pi / 180, "turn": 2 * pi}
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}


@given(
    numbers=st.lists(st.tuples(st.sampled_from("*/"), st.floats(1e-3, 1e6)), max_size=4),
    angle=st.sampled_from(list(_ANGLES)),
    time=st.sampled_from(list(_TIMES)),
    period=st.floats(0.1, 1000.0),
)
def test_a_product_is_worth_what_its_factors_are(
    numbers: list[tuple[str, float]], angle: str, time: str, period: float
) -> None:
    text, value = angle, _ANGLES[angle]
    for sign, number in numbers:
        text += f" {sign} {number!r}"
        value = value * number if sign == "*" else value / number
    found = product_of(f"{text} / {period!r} {time}", "speed")
    assert found.factor == pytest.approx(value / (period * _TIMES[time]), rel=1e-12)
    assert (found.increments, found.encoder) == (0, 0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "is empty"),
        ("m/s", "unknown unit 'm'"),
        ("rpms", "did you mean 'rpm'"),
        ("counts", "is no angle per time"),
        ("rpm/s", "is no angle per time"),
        ("1 / 512 rpm", "is no angle per time"),
        ("0 rpm", "is not above zero"),
        ("-1 rpm", "cannot be read from '-1 rpm' on"),
        ("rpm *", "ends with a sign"),
        ("/ rpm", "has nothing before '/'"),
        ("16.16 counts per slow loop", "unknown unit 'per'"),
        ("rpm 10", "has no sign before 10"),
        ("1e999 rpm", "is not above zero"),
        ("rpm / 0", "divides by zero"),
        ("2^99999 rpm", "beyond what a number holds"),
    ],
)
def test_what_is_no_speed_is_refused_with_examples(text: str, reason: str) -> None:
    with pytest.raises(UsageError) as refused:
        DriveUnit("speed").read(text)
    assert reason in str(refused.value)
    assert '"1875 rpm / 512 / encoder"' in str(refused.value)


def test_a_number_alone_is_no_unit() -> None:
    with pytest.raises(UsageError, match="expected a unit of position"):
        DriveUnit("position").read(10)
    with pytest.raises(UsageError, match="is no angle"):
        DriveUnit("position").read("0.1 deg/s")
