"""``winchkit check`` of instruments: device files against an EDS, units, lines of text."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from command_line import done
from winchkit import catalog

SOURCE = catalog.find("devices", "generic-cia404").parent


def check(path: Path, code: int = 0) -> str:
    return done("check", path, code=code).output


def instrument(folder: Path, device: tuple[str, str] = ("", ""), eds: str = "") -> Path:
    """The generic CANopen cell, one text of its device file replaced and one line of its EDS."""
    home = folder / "mine"
    shutil.copytree(SOURCE, home)
    text = (home / "device.toml").read_text(encoding="utf-8")
    assert device[0] in text
    (home / "device.toml").write_text(text.replace(*device), encoding="utf-8")
    if eds:
        section, old, new = eds.split("|")
        file = home / "generic-cia404.eds"
        words = file.read_text(encoding="utf-8")
        begin = words.index(f"[{section}]")
        place = words.index(old, begin)
        file.write_text(words[:place] + new + words[place + len(old) :], encoding="utf-8")
    return home / "device.toml"


BENCH = """\
schema = 1
kind = "bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "x"
[bus.line]
kind = "{kind}"
port = "/dev/ttyUSB0"
baudrate = 9600
[winch.A]
profile = "bench-spiral"
servo = {{ device = "generic-cia402", bus = "can", node = 1 }}
{role} = {{ device = "mine", bus = "{bus}", {address} }}
limits = {{ speed = "0.5 m/s" }}
"""


@pytest.mark.parametrize(
    ("device", "eds", "said"),
    [
        (('"0x6130:1"', '"0x6130:9"'), "", "0x6130:9 is not in the EDS"),
        (('"0x6130:1", "0x6150:1"]', '"0x6130:1", "0x6150:1", "0x5000"]'), "", "0x5000 is not in"),
        (("number = 1", "number = 4"), "", "tpdo 4 needs 1803h, which the EDS lacks"),
        (('"0x2104"', '"0x2777"'), "", "0x2777 is not in the EDS"),
        (("", ""), "6130sub1|DataType=0x0008|DataType=0x0004", "0x6130:1 is no REAL32 in the EDS"),
        (("", ""), "6130sub1|PDOMapping=1|PDOMapping=0", "its PDOMapping is 0 in the EDS"),
        (('unit = "N"', 'unit = "N"\ntype = "integer"'), "", "is no whole number in the EDS"),
    ],
)
def test_a_canopen_instrument_is_checked_against_its_eds(
    tmp_path: Path, device: tuple[str, str], eds: str, said: str
) -> None:
    path = instrument(tmp_path, device, eds)
    output = check(path, code=3)
    told = [row for row in output.split("\n") if said in row]
    assert told, output
    assert told[0].startswith(f"{path}:")
    bench = tmp_path / "bench.toml"
    text = BENCH.format(kind="modbus-rtu", role="cell", bus="can", address="node = 9")
    bench.write_text(text, encoding="utf-8")
    assert said in check(bench, code=3)


def test_the_value_may_be_an_integer_of_the_eds(tmp_path: Path) -> None:
    path = instrument(
        tmp_path,
        ('unit = "N"', 'unit = "N"\ntype = "integer"\nscale = 0.1'),
        "6130sub1|DataType=0x0008|DataType=0x0004",
    )
    check(path)


MODBUS = """\
schema = 1
kind = "device"
name = "mine"
maker = "us"
model = "cell"
source = "manual"
trust = "manual"
[modbus]
value = "net"
read = {{ start = 0, count = 2 }}
[[modbus.field]]
name = "net"
register = 0
type = "i32"
unit = "{unit}"
scale = 0.01
limit = 999999
"""


@pytest.mark.parametrize(
    ("role", "unit", "said"),
    [
        (
            "cell",
            "kg",
            "measures mass ('kg'); as cell it has to measure force: in its device file write unit",
        ),
        ("load", "mm", "measures length ('mm'); as load it has to measure force"),
        ("length", "N", "measures force ('N'); as length it has to measure length"),
        ("length", "1", "measures ratio ('1'); as length it has to measure length"),
        ("temperature", "m", "measures length ('m'); as temperature it has to measure temperature"),
        ("cell", "kN", ""),
        ("cell", "1", ""),
        ("length", "mm", ""),
        ("temperature", "degC", ""),
    ],
)
def test_an_instrument_measures_what_its_role_needs(
    tmp_path: Path, role: str, unit: str, said: str
) -> None:
    """A load cell in kg read as newtons is wrong by 9.81: no bench with it is accepted."""
    home = tmp_path / "mine"
    home.mkdir()
    (home / "device.toml").write_text(MODBUS.format(unit=unit), encoding="utf-8")
    check(home / "device.toml")
    bench = tmp_path / "bench.toml"
    text = BENCH.format(kind="modbus-rtu", role=role, bus="line", address="unit = 1")
    bench.write_text(text, encoding="utf-8")
    output = check(bench, code=(3 if said else 0))
    assert said in output
    if said:
        assert f"{bench}:14: winch.A.{role}.device: 'mine' {said}" in output


def test_a_frame_that_contains_its_terminator_is_refused(tmp_path: Path) -> None:
    """STX, sign and weight, status, ETX, as Rinstrum prints it: ETX ends the line."""
    path = tmp_path / "device.toml"
    body = (
        MODBUS.split("[modbus]", maxsplit=1)[0] + '[stream]\nmode = "continuous"\nunit = "N"\n'
        'terminator = "\\u0003"\nframe = ["\\u0002{{value:8}}{{state:1}}{end}"]\n'
        'example = "\\u0002-  12.34G{end}"\n[stream.letter.state]\nG = "gross"\n'
    )
    path.write_text(body.format(end="\\u0003"), encoding="utf-8")
    output = check(path, code=3)
    assert "stream.example: '\\x02-  12.34G\\x03' contains the terminator" in output
    assert "stream.frame: '\\x02{value:8}{state:1}\\x03' contains the terminator" in output
    path.write_text(body.format(end=""), encoding="utf-8")
    check(path)
