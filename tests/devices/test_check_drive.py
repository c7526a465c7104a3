"""``winchkit check`` of a drive's device file: the file against its EDS."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from winchkit import catalog
from winchkit.cli.check import command

SOURCE = catalog.find("devices", "generic-cia402").parent


def drive(
    folder: Path, *, device: tuple[str, str] = ("", ""), eds: tuple[str, str] = ("", "")
) -> Path:
    """The generic drive with one text replaced in its device file and in its EDS."""
    home = folder / "mine"
    shutil.copytree(SOURCE, home)
    for name, (old, new) in (("device.toml", device), ("generic-cia402.eds", eds)):
        text = (home / name).read_text(encoding="utf-8")
        assert old in text
        (home / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    return home / "device.toml"


def check(path: Path) -> tuple[int, str]:
    result = CliRunner().invoke(command, [str(path)])
    return result.exit_code, result.output


def line_of(path: Path, part: str) -> int:
    rows = path.read_text(encoding="utf-8").split("\n")
    return next(number for number, row in enumerate(rows, 1) if part in row)


@pytest.mark.parametrize("name", catalog.names("devices"))
def test_every_device_that_we_ship_is_in_order(name: str) -> None:
    result = CliRunner().invoke(command, ["--json", str(catalog.find("devices", name))])
    assert result.exit_code == 0, result.output
    (entry,) = json.loads(result.stdout)["files"]
    assert entry["ok"]
    assert entry["faults"] == []
    assert entry["warnings"] == []


@pytest.mark.parametrize(
    ("device", "eds", "place", "said"),
    [
        (('"0x6041", ', '"0x5041", '), ("", ""), "0x5041", "0x5041 is not in the EDS"),
        (('"0x6041", ', '"6x41", '), ("", ""), '"6x41"', "'6x41' is no object"),
        (('"0x6041", ', '"0x607D:3", '), ("", ""), "0x607D:3", "0x607D:3 is not in the EDS"),
        (('"0x6041", ', '"0x605A", '), ("", ""), "0x605A", "its PDOMapping is 0 in the EDS"),
        (('"0x6061"]', '"0x606C"]'), ("", ""), '"0x606C"]', "would have 80 bits; a PDO carries 64"),
        (('"0x60FF"]', '"0x6041"]'), ("", ""), '"0x6041"]', "it is ro in the EDS"),
        (("", ""), ("[1801]", "[1802]"), '"0x606C"', "tpdo 2 needs 1801h, which the EDS lacks"),
        (("", ""), ("[1A01]", "[1A02]"), '"0x606C"', "tpdo 2 needs 1A01h, which the EDS lacks"),
        (("", ""), ("[60C1]", "[60C2]"), "modes = ", "IP needs 60C1h, which the EDS lacks"),
        (("", ""), ("[606C]", "[606D]"), "modes = ", "606Ch is not in the EDS"),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(
    tmp_path: Path, device: tuple[str, str], eds: tuple[str, str], place: str, said: str
) -> None:
    if eds[0]:
        eds = (_between(*eds), "")
    path = drive(tmp_path, device=device, eds=eds)
    code, output = check(path)
    assert code == 3
    told = [row for row in output.split("\n") if said in row]
    assert told, output
    assert told[0].startswith(f"{path}:{line_of(path, place)}: ")


def _between(first: str, after: str) -> str:
    """All that the generic EDS says of an object and its sub-indices."""
    text = (SOURCE / "generic-cia402.eds").read_text(encoding="utf-8")
    begin = text.index(f"{first}\n")
    return text[begin : text.index(f"{after}\n", begin)]


def test_warnings_of_the_eds_are_shown_and_do_not_fail(tmp_path: Path) -> None:
    path = drive(tmp_path, eds=("VendorNumber=0x0", "VendorNumber="))
    code, output = check(path)
    assert code == 0
    eds = path.parent / "generic-cia402.eds"
    line = line_of(eds, "VendorNumber=")
    assert f"{eds}:{line}: [DeviceInfo] VendorNumber is empty; taken as 0 (warning)" in output


def test_faults_of_the_eds_are_the_device_s(tmp_path: Path) -> None:
    path = drive(tmp_path, eds=("DataType=0x0007", "DataType=U32"))
    code, output = check(path)
    assert code == 3
    assert "generic-cia402.eds:" in output
    assert "DataType 'U32' is no number" in output
