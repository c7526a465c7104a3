"""Faults of declarations: all of them at once, each with its line, its key and what to do."""

from __future__ import annotations

import shutil
import textwrap
from pathlib import Path

import pytest

from winchkit.errors import FileError
from winchkit.schema import read
from winchkit.schema.read import load, read_any

WINCH = """\
schema = 1
kind = "winch"
name = "w"
[drum]
kind = "spiral"
winding_radius = "60 mm"
layer_growth = "0.5 mm"
[gearbox]
ratio = 20
[reference]
"""
RADIUS = 'winding_radius = "60 mm"\n'
SIZES = RADIUS + 'layer_growth = "0.5 mm"\n'
GROWTH = "drum.layer_growth"
DEVICES = Path(__file__).parents[2] / "devices"


def faults_of(path: Path, text: str) -> list[tuple[int | None, str, str]]:
    """Line, key and message of every fault of a text, in order."""
    path.write_text(textwrap.dedent(text))
    with pytest.raises(FileError) as caught:
        read_any(path)
    assert caught.value.exit_code == 3
    return [(fault.line, fault.key, fault.message) for fault in caught.value.faults]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "file.toml"


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Where a bench may stand: beside a profile, and devices of its own."""
    (tmp_path / "w.toml").write_text(WINCH)
    for name in ("generic-cia402", "laumas-tlb"):
        shutil.copytree(DEVICES / name, tmp_path / name)
    return tmp_path / "bench.toml"


BENCH = """\
schema = 1
kind = "bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "x"
[bus.cells]
kind = "modbus-tcp"
host = "127.0.0.1"
port = 502
[winch.A]
profile = "w"
servo = { device = "generic-cia402", bus = "can", node = 1 }
cell = { device = "laumas-tlb", bus = "cells", unit = 1 }
limits = { speed = "0.5 m/s" }
"""


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
    assert '"60 m"' in said["drum.winding_radius"]
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
        ("ratio = 20", "ratio = 0", 9, "gearbox.ratio", "above 0"),
        ("ratio = 20", "ratio = true", 9, "gearbox.ratio", "bool"),
        ("ratio = 20", "ratio = 20\nefficiency = 1.2", 10, "gearbox.efficiency", "at most 1"),
        ('"60 mm"', '"inf mm"', 6, "drum.winding_radius", "finite"),
        ('"60 mm"', '"nan mm"', 6, "drum.winding_radius", "not a number"),
        ('"60 mm"', '"60 kg"', 6, "drum.winding_radius", "length unit 'kg'"),
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
        ("port = 502", 'port = "/dev/x"', 10, "bus.cells.port", "no TCP port"),
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


def test_a_bench_without_a_winch(bench: Path) -> None:
    faults = faults_of(bench, 'schema = 1\nkind = "bench"\nbus = {}\nwinch = {}\n')
    assert [(line, key) for line, key, _ in faults] == [(4, "winch")]


def test_faults_of_a_programme(file: Path) -> None:
    faults = faults_of(
        file,
        """\
        schema = 1
        kind = "programme"
        repeat = 0
        [[step]]
        to = "2 m"
        [[step]]
        hold = "5 s"
        by = "1 m"
        [[step]]
        hold = "5 s"
        speed = "1 m/s"
        [[step]]
        hold = "5 s"
        load_mass = "3 kg"
        [[step]]
        wait = "5 s"
        """,
    )
    assert [(line, key) for line, key, _ in faults] == [
        (3, "repeat"),
        (4, "step[1].speed"),
        (6, "step[2]"),
        (11, "step[3].speed"),
        (14, "step[4].load_mass"),
        (15, "step[5]"),
        (16, "step[5].wait"),
    ]


def test_a_programme_without_steps(file: Path) -> None:
    faults = faults_of(file, 'schema = 1\nkind = "programme"\nstep = []\n')
    assert [(line, key) for line, key, _ in faults] == [(3, "step")]


def test_faults_of_a_robot(file: Path) -> None:
    faults = faults_of(
        file,
        """\
        schema = 1
        kind = "robot"
        [home]
        position = ["1 m", "2 m"]
        [prior]
        exit_point = "5 mm"
        winding_radius = { std = "0.5 mm", bounds = ["61 mm", "60 mm"] }
        bend = "1 mm"
        [[line]]
        name = "1"
        exit_point = ["1 m", "1 m", "1 m"]
        anchor_point = ["0 m", "0 m", "0 m"]
        swivel_axis = [0, 0, 0]
        [line.winch.drum]
        kind = "grooved"
        winding_radius = "60 mm"
        [line.winch.gearbox]
        ratio = 20
        [line.winch.reference]
        [[line]]
        name = "2"
        exit_point = ["1 m", "1 m", "1 m"]
        anchor_point = ["0 m", "0 m", "0 m"]
        winch = "nowhere"
        """,
    )
    assert [(line, key) for line, key, _ in faults] == [
        (4, "home.position[3]"),
        (7, "prior.winding_radius.bounds"),
        (8, "prior.bend"),
        (13, "line[1].swivel_axis"),
        (14, "line[1].winch.drum.groove_pitch"),
        (24, "line[2].winch"),
    ]


def test_two_lines_of_one_name(file: Path) -> None:
    winch = 'winch = { drum = { kind = "squared", winding_radius = "60 mm", build_up = "0 mm" }, '
    winch += "gearbox = { ratio = 1 }, reference = {} }\n"
    line = '[[line]]\nname = "1"\nexit_point = ["0 m", "0 m", "0 m"]\n'
    line += 'anchor_point = ["0 m", "0 m", "0 m"]\n' + winch
    head = 'schema = 1\nkind = "robot"\nhome.position = ["0 m", "0 m", "0 m"]\n'
    faults = faults_of(file, head + line + line)
    assert faults == [(4, "line", "2 lines are named '1'")]


def test_faults_of_a_simulated_bench(bench: Path) -> None:
    text = BENCH.replace('"bench"', '"sim-bench"') + textwrap.dedent(
        """\
        [winch.A.truth]
        drum.winding_radius = "60.4 kg"
        drum.winding_radios = "60.4 mm"
        load_mass = "20 N"
        [[winch.A.hidden]]
        pull = "3 N"
        [noise]
        tension = 0.1
        colour = 2
        [[fault]]
        time = "1 s"
        kind = "silence"
        """
    )
    faults = faults_of(bench, text)
    assert [(line, key) for line, key, _ in faults] == [
        (17, "winch.A.truth.drum.winding_radius"),
        (18, "winch.A.truth.drum.winding_radios"),
        (19, "winch.A.truth.load_mass"),
        (20, "winch.A.hidden[1].physics"),
        (23, "noise.tension"),
        (24, "noise.colour"),
        (25, "fault[1].target"),
    ]


def test_faults_of_a_device(file: Path) -> None:
    faults = faults_of(
        file,
        """\
        schema = 1
        kind = "device"
        name = "d"
        maker = "m"
        model = "x"
        source = "s"
        trust = "guess"
        [modbus]
        value = "nett"
        [modbus.read]
        start = 6
        count = 2
        [[modbus.field]]
        name = "net"
        register = 7
        type = "u32"
        sign_bit = 3
        """,
    )
    assert [(line, key) for line, key, _ in faults] == [
        (7, "trust"),
        (8, "modbus.status_register"),
        (9, "modbus.value"),
        (13, "modbus.field"),
    ]


def test_a_device_is_of_one_kind(file: Path) -> None:
    head = 'schema = 1\nkind = "device"\nname = "d"\nmaker = "m"\nmodel = "x"\nsource = "s"\n'
    faults = faults_of(file, head + 'trust = "manual"\n')
    assert [message for *_, message in faults] == [
        "a device has exactly one of the tables [servo] and [modbus]"
    ]


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
        ("a\0b.toml", "no usable file name"),
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
