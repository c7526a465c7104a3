"""``winchkit check`` of a drive's device file: the file against its EDS."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from command_line import done
from winchkit import catalog

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


def check(path: Path, code: int = 0) -> str:
    return done("check", path, code=code).output


def line_of(path: Path, part: str) -> int:
    rows = path.read_text(encoding="utf-8").split("\n")
    return next(number for number, row in enumerate(rows, 1) if part in row)


@pytest.mark.parametrize("name", catalog.names("devices"))
def test_every_device_that_we_ship_is_in_order(name: str) -> None:
    result = done("check", "--json", catalog.find("devices", name))
    (entry,) = json.loads(result.stdout)["files"]
    assert entry["ok"]
    assert entry["faults"] == []
    assert entry["warnings"] == []


@pytest.mark.parametrize(
    ("unit", "example"),
    [
        ("increments/s", "100 rpm are 109226.667 of 606Ch"),
        ("0.1 counts/s", "100 rpm are 1092266.67 of 606Ch"),
        ("counts / 65536 / 250 us", "100 rpm are 1789569.71 of 606Ch"),
        ("1875 rpm / 512 / encoder", "100 rpm are 1789569.71 of 606Ch"),
    ],
)
def test_the_units_of_a_device_file_are_shown_by_an_example(
    tmp_path: Path, unit: str, example: str
) -> None:
    """Of 65 536 increments a turn."""
    path = drive(tmp_path, device=('speed_unit = "increments/s"', f'speed_unit = "{unit}"'))
    assert f"a motor turn is 65536 of 6064h, {example} ({unit})" in check(path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('speed_unit = "0.1 knots"', "unknown unit 'knots'"),
        ('speed_unit = "deg"', "is no angle per time"),
        ('position_unit = "0.1 deg"', 'needs units = "file"'),
        ('units = "file"\nposition_unit = "turn"', "has 1 position units, too few to move by"),
    ],
)
def test_a_unit_that_cannot_be_is_a_fault_of_the_device_file(
    tmp_path: Path, line: str, said: str
) -> None:
    path = drive(tmp_path, device=('speed_unit = "increments/s"', line))
    assert said in check(path, code=3)


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
def test_what_does_not_fit_is_reported_with_its_line(
    tmp_path: Path, device: tuple[str, str], eds: tuple[str, str], place: str, said: str
) -> None:
    if eds[0]:
        eds = (_between(*eds), "")
    path = drive(tmp_path, device=device, eds=eds)
    output = check(path, code=3)
    told = [row for row in output.split("\n") if said in row]
    assert told, output
    assert told[0].startswith(f"{path}:{line_of(path, place)}: ")


def fixed(record: str, sub: int, value: str) -> tuple[str, str]:
    """A communication parameter that cannot be written, with this value."""
    eds = (SOURCE / "generic-cia402.eds").read_text(encoding="utf-8")
    begin = eds.index(f"[{record}sub{sub}]")
    text = eds[begin : eds.index("\n[", begin)]
    value = f"AccessType=ro\nDefaultValue={value}\n;"
    return text, re.sub(r"AccessType=.*\nDefaultValue=", value, text)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("1400", 2, "255"), "rpdo 1 has the transmission type 255, which cannot be written"),
        (("1800", 2, "254"), "tpdo 1 has the transmission type 254, which cannot be written"),
        (("1400", 1, "0x321"), "rpdo 1 has the identifier 321h at node 1, which cannot be written"),
        (("1800", 1, "0x80000181"), "tpdo 1 is not in use: 1800h:1 cannot be written"),
        (("1400", 1, "$NODEID+0x200"), ""),
        (("1800", 1, "$NODEID+0x40000180"), ""),
        (("1800", 2, "1"), ""),
    ],
)
def test_pdo_parameters_that_cannot_be_written_have_to_fit(
    tmp_path: Path, change: tuple[str, int, str], said: str
) -> None:
    """Trinamic's TMCM-6214 has RPDOs of the type 255 that cannot be changed."""
    path = drive(tmp_path, eds=fixed(*change))
    assert said in check(path, code=(3 if said else 0))


def test_more_objects_than_mapping_entries_are_reported(tmp_path: Path) -> None:
    """An EDS of a CANopenNode drive has one entry in 1600h; the drive refuses the second."""
    eds = (SOURCE / "generic-cia402.eds").read_text(encoding="utf-8")
    begin = eds.index("[1600sub2]")
    path = drive(tmp_path, eds=(eds[begin : eds.index("[1601]", begin)], ""))
    assert "rpdo 1 has 2 objects; 1600h has 1 mapping entries in the EDS" in check(path, code=3)


def test_a_transmission_type_as_the_drive_has_it_is_in_order(tmp_path: Path) -> None:
    written = ('"0x60FF"]', '"0x60FF"]\ntransmission = 255')
    check(drive(tmp_path, device=written, eds=fixed("1400", 2, "255")))


def test_modes_are_those_within_the_range_of_6060h(tmp_path: Path) -> None:
    """Faulhaber's EDS have no 6502h, but limit 6060h to -1 to 6."""
    name = "ParameterName=Modes of operation\n"
    path = drive(tmp_path, eds=(name, f"{name}LowLimit=-1\nHighLimit=6\n"))
    output = check(path, code=3)
    assert f"{path}:{line_of(path, 'modes = ')}: " in output
    assert "CSV is 9 in 6060h, which the EDS limits to -1 to 6" in output
    assert "HM is 6" not in output
    output = check(path.parent / "generic-cia402.eds")
    assert "\n  modes: PP, PV, PT, HM\n" in output


def _between(first: str, after: str) -> str:
    """All that the generic EDS says of an object and its sub-indices."""
    text = (SOURCE / "generic-cia402.eds").read_text(encoding="utf-8")
    begin = text.index(f"{first}\n")
    return text[begin : text.index(f"{after}\n", begin)]


def test_warnings_of_the_eds_are_shown_and_do_not_fail(tmp_path: Path) -> None:
    path = drive(tmp_path, eds=("VendorNumber=0x0", "VendorNumber="))
    output = check(path)
    eds = path.parent / "generic-cia402.eds"
    line = line_of(eds, "VendorNumber=")
    assert f"{eds}:{line}: [DeviceInfo] VendorNumber is empty; taken as 0 (warning)" in output


def test_faults_of_the_eds_are_the_device_s(tmp_path: Path) -> None:
    path = drive(tmp_path, eds=("DataType=0x0007", "DataType=U32"))
    output = check(path, code=3)
    assert "generic-cia402.eds:" in output
    assert "DataType 'U32' is not a number" in output


BENCH = """\
schema = 1
kind = "bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "x"
[winch.A]
profile = "bench-spiral"
servo = { device = "mine", bus = "can", node = 1 }
limits = { speed = "0.5 m/s" }
[winch.B]
profile = "bench-spiral"
servo = { device = "mine", bus = "can", node = 2 }
limits = { speed = "0.5 m/s" }
"""


def bench_of(folder: Path) -> Path:
    path = folder / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    return path


def test_check_of_a_bench_reports_the_faults_of_its_device_files(tmp_path: Path) -> None:
    device = drive(tmp_path, device=('"0x6041", ', '"0x605A", '))
    output = check(bench_of(tmp_path), code=3)
    told = [row for row in output.split("\n") if "its PDOMapping is 0 in the EDS" in row]
    assert len(told) == 1, "the file is wired twice and told once"
    assert told[0].startswith(f"{device}:{line_of(device, '0x605A')}: ")


def test_check_of_a_bench_reports_how_each_drive_notices_a_dead_host(tmp_path: Path) -> None:
    drive(tmp_path)
    output = check(bench_of(tmp_path))
    for winch in "AB":
        silent = "if the computer falls silent, the drive notices it by heartbeat"
        assert f"winch {winch}: {silent}: it reacts as set in 6007h" in output


def test_a_bench_is_refused_where_a_drive_notices_no_dead_host(tmp_path: Path) -> None:
    eds = _between("[1016]", "[1017]")
    path = drive(tmp_path, eds=(eds, ""))
    text = (path.parent / "generic-cia402.eds").read_text(encoding="utf-8")
    for section in ("[100C]", "[1006]"):
        begin = text.index(f"{section}\n")
        text = text[:begin] + text[text.index("[", begin + 1) :]
    (path.parent / "generic-cia402.eds").write_text(text, encoding="utf-8")
    bench = bench_of(tmp_path)
    output = check(bench, code=3)
    for winch in "AB":
        assert f"{bench}: winch {winch}, device 'generic-cia402': the EDS has no way" in output
    check(path)  # hardware may stop it: that is the bench file's to say


def test_an_option_code_that_the_eds_lacks_is_reported(tmp_path: Path) -> None:
    path = drive(tmp_path, eds=(_between("[605D]", "[605E]"), ""))
    path.write_text(path.read_text(encoding="utf-8") + "[servo.options]\nhalt = 1\n")
    output = check(path, code=3)
    assert f"{path}:{line_of(path, 'halt = 1')}: " in output
    assert "the EDS lacks 605Dh; the drive has no such option code" in output


def test_a_fixed_mapping_is_taken_as_it_is(tmp_path: Path) -> None:
    count = _between("[1A01sub0]", "[1A01sub1]")
    path = drive(tmp_path, eds=(count, count.replace("AccessType=rw", "AccessType=const")))
    check(path)  # the device file has the mapping of the EDS
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"0x606C", "0x6077"', '"0x6077", "0x606C"'), encoding="utf-8")
    output = check(path, code=3)
    assert 'fixed mapping in the EDS: objects = ["0x606C", "0x6077", "0x603F"]' in output


def test_a_device_file_may_rest_on_its_eds_alone(tmp_path: Path) -> None:
    path = drive(tmp_path, device=('trust = "generic"', 'trust = "eds"'))
    check(path)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ('host_loss = "rpdo-timeout"', "which lacks a writable event timer of an RPDO"),
        ('host_loss = "sync-loss"\nmotion_mode = "PV"', "needs a cyclic mode"),
    ],
)
def test_a_way_to_notice_a_dead_host_has_to_fit_the_file(
    tmp_path: Path, lines: str, said: str
) -> None:
    path = drive(tmp_path)
    text = path.read_text(encoding="utf-8")
    text = text.replace('motion_mode = "CSV"\n', "", 1)
    path.write_text(text.replace("[servo]\n", f"[servo]\n{lines}\n", 1), encoding="utf-8")
    assert said in check(path, code=3)


def test_guarding_is_refused_where_the_adapter_sends_no_remote_frames(tmp_path: Path) -> None:
    path = drive(tmp_path, device=("[servo]\n", '[servo]\nhost_loss = "guarding"\n'))
    bench = bench_of(tmp_path)
    check(path)
    check(bench)
    text = bench.read_text(encoding="utf-8").replace(
        '"virtual"', '"socketcand"\nhost = "127.0.0.1"\nport = 29536'
    )
    bench.write_text(text, encoding="utf-8")
    output = check(bench, code=3)
    assert "winch A: guarding needs remote frames, which 'socketcand' does not send" in output


def test_a_mode_whose_target_no_pdo_can_carry_is_left_out(tmp_path: Path) -> None:
    """As in the EDS of a gripper of Schunk, which has CSP, and 607Ah with PDOMapping 0."""
    target = _between("[607A]", "[607C]")
    path = drive(tmp_path, eds=(target, target.replace("PDOMapping=1", "PDOMapping=0")))
    output = check(path.parent / "generic-cia402.eds")
    assert "modes that winchkit can move it in: CSV, PV, IP\n" in output
    assert "note: winchkit does not move it in CSP: no RPDO can carry 607Ah" in output


def test_a_control_word_that_no_pdo_can_carry_is_an_obstacle(tmp_path: Path) -> None:
    word = _between("[6040]", "[6041]")
    path = drive(tmp_path, eds=(word, word.replace("PDOMapping=1", "PDOMapping=0")))
    output = check(path.parent / "generic-cia402.eds")
    assert "not movable: no RPDO can carry 6040h: its PDOMapping is 0 in the EDS" in output
