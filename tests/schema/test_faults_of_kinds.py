"""Faults of programmes, robots, simulated benches and devices."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from declared import BENCH, faults_of

CASES: dict[str, tuple[str, list[tuple[int, str]]]] = {
    "programme": (
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
        [
            (3, "repeat"),
            (4, "step[1].speed"),
            (6, "step[2]"),
            (11, "step[3].speed"),
            (14, "step[4].load_mass"),
            (15, "step[5]"),
            (16, "step[5].wait"),
        ],
    ),
    "programme without steps": (
        'schema = 1\nkind = "programme"\nstep = []\n',
        [(3, "step")],
    ),
    "robot": (
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
        [
            (4, "home.position[3]"),
            (7, "prior.winding_radius.bounds"),
            (8, "prior.bend"),
            (13, "line[1].swivel_axis"),
            (14, "line[1].winch.drum.groove_pitch"),
            (24, "line[2].winch"),
        ],
    ),
    "simulated bench": (
        BENCH.replace('"bench"', '"sim-bench"')
        + textwrap.dedent(
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
        ),
        [
            (17, "winch.A.truth.drum.winding_radius"),
            (18, "winch.A.truth.drum.winding_radios"),
            (19, "winch.A.truth.load_mass"),
            (20, "winch.A.hidden[1].physics"),
            (23, "noise.tension"),
            (24, "noise.colour"),
            (25, "fault[1].target"),
        ],
    ),
    "device": (
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
        [
            (7, "trust"),
            (8, "modbus.status_register"),
            (9, "modbus.value"),
            (13, "modbus.field"),
        ],
    ),
}


@pytest.mark.parametrize("kind", CASES)
def test_every_fault_has_its_line_and_its_key(bench: Path, kind: str) -> None:
    text, places = CASES[kind]
    assert [(line, key) for line, key, _ in faults_of(bench, text)] == places


def test_two_lines_of_one_name(file: Path) -> None:
    winch = 'winch = { drum = { kind = "squared", winding_radius = "60 mm", build_up = "0 mm" }, '
    winch += "gearbox = { ratio = 1 }, reference = {} }\n"
    line = '[[line]]\nname = "1"\nexit_point = ["0 m", "0 m", "0 m"]\n'
    line += 'anchor_point = ["0 m", "0 m", "0 m"]\n' + winch
    head = 'schema = 1\nkind = "robot"\nhome.position = ["0 m", "0 m", "0 m"]\n'
    faults = faults_of(file, head + line + line)
    assert faults == [(4, "line", "2 lines are named '1'")]


def test_a_device_is_of_one_kind(file: Path) -> None:
    head = 'schema = 1\nkind = "device"\nname = "d"\nmaker = "m"\nmodel = "x"\nsource = "s"\n'
    faults = faults_of(file, head + 'trust = "manual"\n')
    assert [message for *_, message in faults] == [
        "a device has exactly one of the tables [servo], [modbus], [stream] and [process]"
    ]
