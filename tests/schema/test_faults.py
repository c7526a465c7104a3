"""Faults of winches and benches: all at once, each with its line, its key and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from declared import BENCH, RADIUS, SIZES, WINCH, faults_of
from winchkit.catalog import find
from winchkit.errors import FileError
from winchkit.schema import read
from winchkit.schema.read import load, read_any

GROWTH = "drum.layer_growth"


def test_the_example_of_the_design(bench: Path) -> None:
    text = BENCH.replace('speed = "0.5 m/s"', 'speed = "0.5 m/sec"')
    bench.write_text(text)
    with pytest.raises(FileError) as caught:
        read_any(bench)
    assert str(caught.value) == (
        f"{bench}:15: winch.A.limits.speed: unknown speed unit 'm/sec'; "
        "use one of m/s, mm/s, cm/s, m/min; did you mean 'm/s'?"
    )


def test_every_fault_in_one_go(file: Path) -> None:
    faults = faults_of(
        file,
        """\
        schema = 1
        kind = "winch"
        colour = "red"
        [drum]
        kind = "groved"
        winding_radius = 60
        [gearbox]
        ratio = "x"
        direction = 2
        [[pulley]]
        radius = "40 mm"
        [[pulley]]
        radius = "-40 mm"
        rap = "90 deg"
        [[effect]]
        gain = 1
        """,
    )
    assert [(line, key) for line, key, _ in faults] == [
        (1, "reference"),
        (3, "colour"),
        (5, "drum.kind"),
        (6, "drum.winding_radius"),
        (8, "gearbox.ratio"),
        (9, "gearbox.direction"),
        (13, "pulley[2].radius"),
        (14, "pulley[2].rap"),
        (15, "effect[1].id"),
    ]
    said = {key: message for _, key, message in faults}
    assert said["drum.kind"].endswith("did you mean 'grooved'?")
    assert '"60 UNIT" (use one of m, mm' in said["drum.winding_radius"]
    assert said["pulley[2].rap"] == "unknown key; did you mean 'wrap'?"
    assert said["pulley[2].radius"] == "'-40 mm' must be above 0 m"


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "part"),
    [
        ('kind = "spiral"', 'kind = "grooved"\ngroove_pitch = "5 mm"', 8, GROWTH, "layered"),
        (
            f'kind = "spiral"\n{SIZES}',
            f'kind = "grooved"\n{RADIUS}',
            4,
            "drum.groove_pitch",
            "miss",
        ),
        (f'kind = "spiral"\n{SIZES}', f'kind = "squared"\n{RADIUS}', 4, "drum.build_up", "missing"),
        ('kind = "spiral"', 'kind = "spiral"\nbuild_up = "1 mm"', 6, "drum.build_up", "squared"),
        ('layer_growth = "0.5 mm"\n', "", 4, "drum.layer_growth", "cable.diameter"),
        ("ratio = 20", "ratio = 0", 9, "gearbox.ratio", "at least 0.001"),
        ("ratio = 20", "ratio = true", 9, "gearbox.ratio", "bool"),
        ("ratio = 20", "ratio = 20\nefficiency = 1.2", 10, "gearbox.efficiency", "at most 1"),
        ('"60 mm"', '"inf mm"', 6, "drum.winding_radius", "finite"),
        ('"60 mm"', '"nan mm"', 6, "drum.winding_radius", "not a number"),
        ('"60 mm"', '"60 kg"', 6, "drum.winding_radius", "unit of mass, not of length"),
        ('"60 mm"', '["60 mm"]', 6, "drum.winding_radius", "list"),
        ('name = "w"', "name = 3", 3, "name", "text in quotes"),
        ('name = "w"', "pulley = 3", 3, "pulley", "a list"),
        ('name = "w"', "pulley = [3]", 3, "pulley[1]", "a table"),
        ('name = "w"', "cable = 3", 3, "cable", "a table"),
        ('name = "w"', "effect = 3", 3, "effect", "[[effect]]"),
    ],
)
def test_a_fault_of_a_winch(file: Path, old: str, new: str, line: int, key: str, part: str) -> None:
    assert old in WINCH
    faults = faults_of(file, WINCH.replace(old, new, 1))
    assert [(where, name) for where, name, _ in faults] == [(line, key)]
    assert part in faults[0][2]


@pytest.mark.parametrize(
    ("key", "value", "effect"),
    [
        ("cable.axial_stiffness", '"200 kN"', "cable-elongation-linear"),
        ("cable.mass_per_length", '"0.1 kg/m"', "cable-weight"),
        ("gearbox.efficiency", "0.8", "gear-efficiency"),
    ],
)
def test_a_shorthand_beside_its_effect(file: Path, key: str, value: str, effect: str) -> None:
    dotted = WINCH.replace("[drum]", f"{key} = {value}\n[drum]")
    dotted = dotted.replace("[gearbox]\nratio = 20\n", "")
    dotted = dotted.replace("[drum]", "gearbox.ratio = 20\n[drum]")
    file.write_text(dotted)
    read_any(file)
    faults = faults_of(file, dotted + f'[[effect]]\nid = "{effect}"\n')
    assert [(line, name) for line, name, _ in faults] == [(4, key)]
    assert effect in faults[0][2]


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "part"),
    [
        ('bus = "cells"', 'bus = "cels"', 14, "winch.A.cell.bus", "did you mean 'cells'?"),
        ('bus = "cells"', 'bus = "can"', 14, "winch.A.cell.bus", "needs modbus-rtu or modbus-tcp"),
        ('bus = "can"', 'bus = "cells"', 13, "winch.A.servo.bus", "needs can"),
        ("unit = 1", "node = 1", 14, "winch.A.cell.node", "no node"),
        ("node = 1", "node = 0", 13, "winch.A.servo.node", "from 1 to 127"),
        ("node = 1", 'node = "1"', 13, "winch.A.servo.node", "whole number"),
        ('"laumas-tlb"', '"laumas-tbl"', 14, "winch.A.cell.device", "did you mean 'laumas-tlb'?"),
        ('"laumas-tlb"', '"generic-cia402"', 14, "winch.A.cell.device", "a servo drive"),
        ('profile = "w"', 'profile = "v"', 12, "winch.A.profile", "no profile 'v'"),
        ('channel = "x"\n', "", 3, "bus.can.channel", "a can bus needs it"),
        ('host = "127.0.0.1"\n', "", 7, "bus.cells.host", "a modbus-tcp bus needs it"),
        ("port = 502", 'port = "/dev/x"', 10, "bus.cells.port", "not a TCP port"),
        ("port = 502", "port = 1.5", 10, "bus.cells.port", "not 1.5"),
        ("limits = {", 'brake = "yes"\nlimits = {', 15, "winch.A.brake", "true or false"),
        (
            'speed = "0.5 m/s"',
            'speed = "0.5 m/s", length = ["9 m", "1 m"]',
            15,
            "winch.A.limits.length",
            "not below the upper",
        ),
        (
            'speed = "0.5 m/s"',
            'speed = "0.5 m/s", length = ["9 m"]',
            15,
            "winch.A.limits.length[2]",
            "a list of 2",
        ),
        (
            'speed = "0.5 m/s"',
            'speed = "0.5 m/s", tension_high = "9 N", tension_slack = "10 N"',
            15,
            "winch.A.limits.tension_slack",
            "not below tension_high",
        ),
        ('kind = "bench"', 'kind = "bench"\npath = "x"', 3, "path", "unknown key"),
    ],
)
def test_a_fault_of_a_bench(
    bench: Path, old: str, new: str, line: int, key: str, part: str
) -> None:
    bench.write_text(BENCH)
    read.read_bench(bench)
    assert old in BENCH
    faults = [
        (where, name, message)
        for where, name, message in faults_of(bench, BENCH.replace(old, new, 1))
        if "is reached by its" not in message
    ]
    assert [(where, name) for where, name, _ in faults] == [(line, key)]
    assert part in faults[0][2]


def test_two_devices_at_one_address(bench: Path) -> None:
    second = BENCH[BENCH.index("[winch.A]") :].replace("winch.A", "winch.B")
    faults = faults_of(bench, BENCH + second.replace("unit = 1", "unit = 2"))
    assert faults == [(18, "winch.B.servo.node", "1 on this bus is taken by winch.A.servo")]


@pytest.mark.parametrize(("node", "host"), [(1, "node = 1\n"), (127, "")])
def test_a_device_has_not_the_number_of_the_host(bench: Path, node: int, host: str) -> None:
    """Its heartbeat and the host's would have one identifier."""
    text = BENCH.replace("node = 1", f"node = {node}", 1)
    text = text.replace('kind = "can"\n', f'kind = "can"\n{host}', 1)
    (fault,) = faults_of(bench, text)
    assert fault[1:] == (
        "winch.A.servo.node",
        f"{node} on this bus is taken by the host (bus.can.node)",
    )


def test_a_bench_without_a_winch(bench: Path) -> None:
    faults = faults_of(bench, 'schema = 1\nkind = "bench"\nbus = {}\nwinch = {}\n')
    assert [(line, key) for line, key, _ in faults] == [(4, "winch")]


_PER_SECOND = "'Hz' is a unit of frequency; write a number per second without a unit"


@pytest.mark.parametrize(
    ("kind", "name", "old", "new", "sentence"),
    [
        ("devices", "laumas-tlb", "rate = 300.0", 'rate = "50 Hz"', _PER_SECOND),
        ("devices", "generic-line", "rate = 100.0", 'rate = "50 Hz"', _PER_SECOND),
        (
            "devices",
            "generic-modbus",
            "rate = 100.0",
            'rate = "50 %"',
            "'%' is a unit of ratio; write a number per second without a unit",
        ),
        (
            "devices",
            "laumas-tlb",
            "rate = 300.0",
            'rate = "50 foo"',
            "unknown unit 'foo'; write a number per second without a unit",
        ),
        (
            "devices",
            "laumas-tlb",
            "rate = 300.0",
            "rate = true",
            "expected a number per second, not bool",
        ),
        (
            "profiles",
            "bench-spiral",
            "ratio = 20.4",
            'ratio = "20.4 mm"',
            "'mm' is a unit of length; write a number without a unit",
        ),
        (
            "profiles",
            "bench-spiral",
            '"60 mm"',
            '"60 N"',
            "'N' is a unit of force, not of length; use one of m, mm, cm, um, km",
        ),
        (
            "profiles",
            "winding-device-winch",
            "efficiency = 0.68",
            'efficiency = "0.68 W"',
            "'W' is a unit of power; write a ratio without a unit, or in %, ppm",
        ),
        (
            "sim",
            "cabtive-robot",
            'rotation_speed = "20 deg/s"',
            'rotation_speed = "20 deg"',
            "'deg' is a unit of angle, not of angular speed; use one of rad/s, deg/s",
        ),
    ],
)
def test_the_sentence_fits_the_field(
    tmp_path: Path, kind: str, name: str, old: str, new: str, sentence: str
) -> None:
    text = find(kind, name).read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "declared.toml"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileError) as caught:
        load(file)
    assert any(sentence in fault.message for fault in caught.value.faults)


@pytest.mark.parametrize(
    ("text", "line", "part"),
    [
        ('schema = 1\nkind = "winch"\n[drum\n', 3, "TOML syntax"),
        ('schema = 1\nkind = "winch"\na = 1\na = 2\n', 4, "TOML syntax"),
        ('schema = 1\nkind = "winch"\na = """x', 3, "TOML syntax"),
        ('kind = "winch"\n', 1, "write schema = 1"),
        ('schema = 2\nkind = "winch"\n', 1, "2 is unknown"),
        ('schema = true\nkind = "winch"\n', 1, "True is unknown"),
        ("schema = 1\n", 1, "missing; use one of winch"),
        ('schema = 1\nkind = "whinch"\n', 2, "did you mean 'winch'?"),
        ("schema = 1\nkind = [1]\n", 2, "unknown kind [1]"),
        (" \n# nothing\n", 1, "schema"),
        ("", None, "empty"),
    ],
)
def test_text_that_is_no_declaration(file: Path, text: str, line: int | None, part: str) -> None:
    faults = faults_of(file, text)
    assert faults[0][0] == line
    assert part in faults[0][2]


def test_nested_too_deep(file: Path) -> None:
    depth = 100_000
    faults = faults_of(file, "a = " + "[" * depth + "]" * depth)
    assert "too deep" in faults[0][2]


@pytest.mark.parametrize(
    ("content", "part"),
    [(b"\x89PNG\r\n\x1a\n\x00\x01", "binary"), (b'name = "\xe9"', "E9h is not UTF-8")],
)
def test_bytes_that_are_no_text(file: Path, content: bytes, part: str) -> None:
    file.write_bytes(content)
    with pytest.raises(FileError, match=part):
        read_any(file)


def test_no_file_a_directory_and_an_odd_name(tmp_path: Path) -> None:
    for path, part in (
        (tmp_path / "nowhere.toml", "no such file"),
        (tmp_path, "directory"),
        ("a\0b.toml", "not a usable file name"),
    ):
        with pytest.raises(FileError, match=part):
            read_any(path)


def test_a_mark_of_byte_order_and_carriage_returns_do_no_harm(file: Path) -> None:
    file.write_bytes(b"\xef\xbb\xbf" + WINCH.replace("\n", "\r\n").encode())
    assert load(file).kind == "winch"


def test_another_kind_than_asked_for(file: Path) -> None:
    file.write_text(WINCH)
    with pytest.raises(FileError, match=r"file.toml:2: kind: is 'winch'; a 'bench' is needed here"):
        read.read_bench(file)


def test_a_guide_that_misses_its_groove_is_a_warning(file: Path) -> None:
    grooved = WINCH.replace('"spiral"', '"grooved"').replace(
        'layer_growth = "0.5 mm"', 'groove_pitch = "5 mm"'
    )
    guide = '[guide]\nscrew_lead = "2.5 mm"\nbelt_ratio = {}\n'
    file.write_text(grooved + guide.format(2))
    assert load(file).warnings == ()
    file.write_text(grooved + guide.format(1.9))
    (warning,) = load(file).warnings
    assert (warning.line, warning.key) == (11, "guide")
    assert "4.75 mm" in warning.message
