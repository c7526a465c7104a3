"""Faults of programmes, robots, simulated benches and devices."""

from __future__ import annotations

import textwrap
from math import radians
from pathlib import Path

import pytest

from declared import BENCH, faults_of
from winchkit.errors import FileError, UsageError
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import load, read_bench, read_programme
from winchkit.schema.write import write_programme
from winchkit.sim.live.bench_file import write_bench

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


def move(to: float | None = None, by: float | None = None, winch: str = "all") -> ProgrammeStep:
    return ProgrammeStep(to=to, by=by, speed=0.2, winch=winch)


@pytest.mark.parametrize(
    ("steps", "way"),
    [
        ([move(1.0), move(3.0)], (2.9, 3.0)),
        ([move(3.0), move(2.95)], (3.0, 2.95)),
        ([move(2.0), move(by=-0.5), ProgrammeStep(hold=1.0)], (1.6, 1.5)),
        ([move(2.0), move(2.0)], (2.0,)),
        ([move(by=-0.5), move(by=0.5)], ()),
        ([move(by=-0.5), move(3.0)], (3.0,)),
        ([move(1.0), move(4.0, winch="B")], (1.0,)),
        ([ProgrammeStep(hold=1.0)], ()),
    ],
)
def test_it_begins_where_it_ends_and_comes_from_the_same_side(
    steps: list[ProgrammeStep], way: tuple[float, ...]
) -> None:
    assert Programme("p", tuple(steps)).approach("A") == pytest.approx(way)


def test_a_question_is_asked_once_while_it_stays_true() -> None:
    load = ProgrammeStep(ask="hang it", load_mass=10.0)
    warm = ProgrammeStep(ask="warm it", temperature=35.0)
    both = ProgrammeStep(ask="both", load_mass=10.0, temperature=35.0)
    other = ProgrammeStep(ask="grease the drum")
    assert load.asks_beyond(None, None)
    assert not load.asks_beyond(10.0, None)
    assert warm.asks_beyond(10.0, 20.0)
    assert not warm.asks_beyond(None, 35.0)
    assert both.asks_beyond(10.0, 20.0)
    assert not both.asks_beyond(10.0, 35.0)
    assert other.asks_beyond(10.0, 35.0)
    assert not move(1.0).asks_beyond(None, None)


def test_a_temperature_is_written_and_read_and_belongs_to_a_question(tmp_path: Path) -> None:
    path = tmp_path / "warm.toml"
    programme = Programme("warm", (ProgrammeStep(ask="warm it", temperature=35.0), move(1.0)))
    write_programme(programme, path)
    with pytest.raises(UsageError, match="exists already"):
        write_programme(programme, str(path))
    assert 'temperature = "35 degC"' in path.read_text(encoding="utf-8")
    assert read_programme(path).step[0].temperature == 35.0
    path.write_text(path.read_text(encoding="utf-8").replace("ask =", "hold = '1 s' #"))
    with pytest.raises(FileError, match="belongs to a step with 'ask', not to 'hold'"):
        read_programme(path)


ROBOT = """\
schema = 1
kind = "bench"
[robot]
profile = "winding-device-8"
speed = "0.2 m/s"
rotation_speed = "20 deg/s"
tension = ["60 N", "800 N"]
tension_trim = "end"
tracker = { listen = "udp://127.0.0.1:5100" }
[bus.can]
kind = "can"
interface = "virtual"
channel = "robot"
"""
WINCH = """\
[winch.{name}]
profile = "winding-device-winch"
servo = {{ device = "generic-cia402", bus = "can", node = {name}, encoder = "absolute" }}
limits = {{ speed = "0.5 m/s", tension_high = "900 N", tension_slack = "20 N" }}
"""


def write(path: Path, names: str = "12345678", **replaced: str) -> Path:
    text = ROBOT + "".join(WINCH.format(name=name) for name in names)
    for old, new in replaced.items():
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_a_robot_is_read_in_si(tmp_path: Path) -> None:
    spec = read_bench(write(tmp_path / "bench.toml"))
    assert spec.robot.tracker is not None
    assert spec.robot.tension == (60.0, 800.0)
    assert spec.robot.rotation_speed == pytest.approx(radians(20))
    assert spec.robot.lost_winch == "stop-together"
    assert spec.robot.tension_trim == "end"
    assert spec.robot.tracker.frame == "tracker"
    again = load(write_bench(spec, tmp_path / "again.toml")).value
    assert again == spec


@pytest.mark.parametrize(
    ("names", "replaced", "words"),
    [
        ("1234567", {}, "line 8 of robot 'winding-device-8' is no winch of this bench"),
        ("12345678", {"800": "1000"}, "1000 N is above tension_high of winch 1, 900 N"),
        ("12345678", {'"60 N"': '"10 N"'}, "10 N is below tension_slack of winch 1, 20 N"),
        ("12345678", {'"60 N"': '"800 N"'}, "the lower limit 800 N is not below"),
        ("12345678", {"udp:": "tcp:"}, "is no address such as"),
        ("12345678", {":5100": ":x"}, "is no address such as"),
        ("12345678", {"winding-device-8": "bench-spiral"}, "is 'winch'"),
    ],
)
def test_what_does_not_fit_is_refused(
    tmp_path: Path, names: str, replaced: dict[str, str], words: str
) -> None:
    with pytest.raises(FileError, match=words):
        read_bench(write(tmp_path / "bench.toml", names, **replaced))
