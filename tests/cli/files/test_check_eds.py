"""``winchkit check`` of EDS files with traits of makers' files, each made from a generic one.

The traits are of files of Yiyou (device profile), Delta (6502h), Trinamic (several axes), of a DCF
with one TPDO, and of instruments.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from winchkit import catalog
from winchkit.cli.files.check import command

DRIVE = catalog.find("devices", "generic-cia402").parent / "generic-cia402.eds"
CELL = catalog.find("devices", "generic-cia404").parent / "generic-cia404.eds"


def sections(text: str) -> dict[str, str]:
    """Body of every section by its name."""
    parts = re.split(r"(?m)^\[(.*)\]\n", text)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def changed(folder: Path, source: Path, **bodies: str | None) -> Path:
    """The file with other sections; None leaves one out, with its sub-indices."""
    found = sections(source.read_text(encoding="utf-8"))
    for name, body in bodies.items():
        key = name.lstrip("_")
        if body is None:
            found = {one: text for one, text in found.items() if not one.startswith(key)}
        else:
            found[key] = body
    path = folder / "drive.eds"
    path.write_text("".join(f"[{name}]\n{body}" for name, body in found.items()), encoding="utf-8")
    return path


def variable(kind: str, access: str, value: str) -> str:
    return (
        f"ParameterName=x\nObjectType=0x7\nDataType={kind}\nAccessType={access}\n"
        f"DefaultValue={value}\nPDOMapping=1\n\n"
    )


def check(path: Path) -> str:
    result = CliRunner().invoke(command, [str(path)])
    assert result.exit_code == 0, result.output
    return result.stdout


def described(path: Path) -> dict[str, object]:
    result = CliRunner().invoke(command, ["--json", str(path)])
    (entry,) = json.loads(result.stdout)["files"]
    drive = entry["drive"]
    assert isinstance(drive, dict)
    return drive


def test_a_drive_with_another_device_profile_is_described_as_a_drive(tmp_path: Path) -> None:
    """1000h is 00220811h: the profile would be 2065, but every object of CiA 402 is there."""
    usual = check(DRIVE).split("\n", 1)[1]
    path = changed(tmp_path, DRIVE, _1000=variable("0x0007", "ro", "0x00220811"))
    out = check(path)
    note = (
        "  note: 1000h says device profile 2065, not 402; 6040h and 6041h are there, so it is "
        "described as a drive of CiA 402\n"
    )
    assert note in out
    assert out.split("\n", 1)[1].replace(note, "") == usual
    assert described(path)["obstacles"] == described(DRIVE)["obstacles"] == []


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("0x00000194", "device profile CiA 404: no servo drive"),
        ("0", "no device profile in 1000h, and 6040h and 6041h are not both there: no servo drive"),
    ],
)
def test_an_instrument_is_described_by_its_values(tmp_path: Path, value: str, said: str) -> None:
    path = changed(tmp_path, CELL, _1000=variable("0x0007", "ro", value))
    out = check(path)
    assert f"\n  {said}\n" in out
    assert "\n  values that a TPDO can carry: 6130h:1, 6150h:1" in out
    assert "docs/howto/load-cell.md" in out
    assert "not movable" not in out
    assert "modes" not in out
    obstacles = described(path)["obstacles"]
    assert isinstance(obstacles, list)
    assert len(obstacles) == 1
    assert obstacles[0].startswith("it is no servo drive: 1000h says ")


def test_a_drive_without_position_is_a_drive_with_obstacles(tmp_path: Path) -> None:
    out = check(changed(tmp_path, DRIVE, _6064=None))
    assert "not movable: the EDS lacks 6064h, which every motion needs" in out


def test_modes_without_a_value_of_6502h_are_those_of_the_objects(tmp_path: Path) -> None:
    out = check(changed(tmp_path, DRIVE, _6502=variable("0x0007", "ro", "")))
    assert "  modes: PP, PV, PT, HM, IP, CSP, CSV, CST\n" in out
    assert "note: 6502h (supported modes) has no value in the EDS: modes are those whose" in out
    assert "6502h" not in check(DRIVE)


def test_further_axes_are_reported(tmp_path: Path) -> None:
    word = variable("0x0006", "rww", "0")
    out = check(changed(tmp_path, DRIVE, _6840=word, _7840=word))
    assert (
        "note: control words of further axes at 6840h, 7840h: winchkit moves the axis of 6040h only"
    ) in out


def without(kind: int, numbers: range) -> dict[str, None]:
    return {
        f"_{base + number - 1:04X}": None for base in (kind, kind + 0x200) for number in numbers
    }


def test_one_tpdo_cannot_carry_what_motion_needs(tmp_path: Path) -> None:
    """6041h, 6064h and 606Ch are 16 + 32 + 32 bits; two TPDOs of 64 bits can."""
    one = changed(tmp_path, DRIVE, **without(0x1800, range(2, 5)))
    assert (
        "not movable: the transmit PDOs 1 to 4 have no room for 606Ch (32 bits) beside 6041h, 6064h"
    ) in check(one)
    two = changed(tmp_path, DRIVE, **without(0x1800, range(3, 5)))
    assert "not movable" not in check(two)
    receive = changed(tmp_path, DRIVE, **without(0x1400, range(2, 5)))
    assert "not movable" not in check(receive)


def test_fixed_pdos_carry_what_they_hold(tmp_path: Path) -> None:
    """All TPDOs fixed: the one that holds 606Ch decides whether the drive can be moved."""
    bodies: dict[str, str | None] = {}
    for number, entries in enumerate(("60410010", "60640020", "606C0020", "60770010")):
        bodies[f"_{0x1A00 + number:04X}sub0"] = variable("0x0005", "const", "1")
        bodies[f"_{0x1A00 + number:04X}sub1"] = variable("0x0007", "const", f"0x{entries}")
    assert "not movable" not in check(changed(tmp_path, DRIVE, **bodies))
    bodies["_1A02sub1"] = bodies["_1A03sub1"]
    assert "have no room for 606Ch (32 bits)" in check(changed(tmp_path, DRIVE, **bodies))


@pytest.mark.parametrize("name", ["drive.xml", "drive.xdc", "drive.XML", "drive.eds"])
def test_another_description_in_xml_is_refused_with_what_to_do(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text('<?xml version="1.0"?>\n<EtherCATInfo/>\n', encoding="utf-8")
    result = CliRunner().invoke(command, [str(path)])
    assert result.exit_code == 3
    assert result.output.startswith(f"{path}:2: is XML of <EtherCATInfo>")
    assert "use the maker's EDS" in result.output
    assert len(result.output.splitlines()) == 1
