"""What declarations say, in SI; and that no text whatever brings the reader down."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from winchkit.catalog import find, names
from winchkit.cli.files.check import command
from winchkit.effects.bind import line_of, terms_of
from winchkit.errors import FileError, UsageError
from winchkit.schema.bench import BenchSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import (
    load,
    read_any,
    read_bench,
    read_device,
    read_profile,
    read_programme,
    read_robot,
    read_simbench,
    read_winch,
)
from winchkit.units import UNITS, format_quantity, parse

ROOT = Path(__file__).parents[2]
SHIPPED = sorted(
    path
    for folder in ("devices", "examples", "profiles", "sim")
    for path in (ROOT / folder).rglob("*.toml")
)

FULL_WINCH = """\
schema = 1
kind = "winch"
name = "bench-spiral"
[drum]
kind = "spiral"
winding_radius = "60 mm"
[cable]
diameter = "6 mm"
dead_length = "1.5 m"
[path]
inclination = "45 deg"
[gearbox]
ratio = 20.0
direction = -1
[guide]
screw_lead = "5 mm"
distance = "0.4 m"
[[pulley]]
radius = "40 mm"
[[pulley]]
radius = "50 mm"
wrap = "180 deg"
[reference]
motor_angle = "1 turn"
cable_length = "10 m"
wound_turns = 4.0
[[effect]]
id = "cable-thermal"
expansion = "1.2e-5 1/K"
fitted = { runs = ["a.csv"], date = 2026-11-21 }
"""


def test_a_winch_in_si(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    file.write_text(FULL_WINCH)
    winch = read_profile(file)
    assert winch.drum.winding_radius == 0.06
    assert winch.cable.dead_length == 1.5
    assert winch.path.inclination == pytest.approx(math.pi / 4)
    assert winch.gearbox.direction == -1
    assert [pulley.wrap for pulley in winch.pulley] == pytest.approx([math.pi / 2, math.pi])
    assert winch.reference.motor_angle == pytest.approx(2 * math.pi)
    (effect,) = winch.effect
    assert (effect.id, effect.path, effect.line) == ("cable-thermal", str(file), 27)
    assert effect.values["expansion"] == "1.2e-5 1/K"
    assert "id" not in effect.values


def test_a_name_is_the_files_where_it_is_missing(tmp_path: Path) -> None:
    programme = tmp_path / "ladder.toml"
    programme.write_text('schema = 1\nkind = "programme"\n[[step]]\nhold = "5 s"\n')
    assert read_programme(programme).name == "ladder"
    assert read_programme(programme).step[0].hold == 5.0


def test_a_robot_holds_its_winches(tmp_path: Path) -> None:
    (tmp_path / "far.toml").write_text(FULL_WINCH)
    robot = tmp_path / "robot.toml"
    robot.write_text(
        """\
schema = 1
kind = "robot"
[home]
position = ["360 mm", "558 mm", "560 mm"]
[prior]
exit_point = "5 mm"
winding_radius = { std = "0.5 mm", bounds = ["59 mm", "61 mm"] }
[[line]]
name = "1"
exit_point = ["861.1 mm", "1058.3 mm", "1097.1 mm"]
anchor_point = ["49.9 mm", "86.6 mm", "-73 mm"]
swivel_radius = "8.6 mm"
winch = "far"
[[line]]
name = "2"
exit_point = ["0 m", "0 m", "0 m"]
anchor_point = ["0 m", "0 m", "0 m"]
swivel_axis = [0, 0, -1]
[line.winch.drum]
kind = "archimedean"
winding_radius = "60 mm"
layer_growth = "0.48 mm"
[line.winch.gearbox]
ratio = 3
[line.winch.reference]
wound_turns = 2
"""
    )
    read = read_robot(robot)
    assert read.line[0].exit_point == pytest.approx((0.8611, 1.0583, 1.0971))
    assert read.prior["exit_point"].std == pytest.approx(0.005)
    assert read.prior["winding_radius"].bounds == pytest.approx((0.059, 0.061))
    first, second = (line.winch for line in read.line)
    assert isinstance(first, WinchProfile)
    assert isinstance(second, WinchProfile)
    assert (first.name, second.name) == ("bench-spiral", "2")
    assert second.drum.layer_growth == pytest.approx(0.00048)
    assert second.reference.cable_length is None


def test_a_simulated_bench(tmp_path: Path) -> None:
    file = tmp_path / "sim.toml"
    (tmp_path / "w.toml").write_text(FULL_WINCH)
    file.write_text(
        """\
schema = 1
kind = "sim-bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "c"
[winch.A]
profile = "w"
servo = { device = "generic-cia402", bus = "can", node = 1 }
limits = { speed = "0.5 m/s" }
[winch.A.truth]
drum.winding_radius = "60.4 mm"
"gearbox.ratio" = 20.1
load_mass = "32 kg"
temperature_drift = "0.1 K/min"
[[winch.A.hidden]]
physics = "elastic rope"
axial_stiffness = "80 kN"
answers = ["cable-elongation-linear"]
[noise]
tension = "0.4 N"
colour = 0.3
[[fault]]
time = "2 s"
kind = "silence"
target = "A.cell"
duration = "1 s"
"""
    )
    bench = read_simbench(file)
    truth = bench.truth["A"]
    assert dict(truth.overrides) == {"drum.winding_radius": "60.4 mm", "gearbox.ratio": 20.1}
    assert (truth.load_mass, truth.temperature) == (32.0, 20.0)
    assert truth.temperature_drift == pytest.approx(6.0)
    (hidden,) = truth.hidden
    assert dict(hidden.numbers) == {"axial_stiffness": "80 kN"}
    assert hidden.answers == ("cable-elongation-linear",)
    assert bench.noise.tension == 0.4
    assert dict(bench.fault[0].numbers) == {"duration": "1 s"}
    assert isinstance(bench.bench, BenchSpec)
    assert bench.bench.path == str(file)
    assert (bench.name, bench.bench.name) == ("sim", "sim")


def test_a_bench_says_where_it_was_read(tmp_path: Path) -> None:
    (tmp_path / "w.toml").write_text(FULL_WINCH)
    file = tmp_path / "two.toml"
    file.write_text(
        'schema = 1\nkind = "bench"\ncycle = "2 ms"\n[bus.c]\nkind = "can"\n'
        'interface = "socketcan"\nchannel = "can0"\n[winch.A]\nprofile = "w"\n'
        'servo = { device = "generic-cia402", bus = "c", node = 7 }\n'
        '[winch.A.limits]\nspeed = "30 m/min"\nlength = ["0.5 m", "9 m"]\n'
    )
    bench = read_bench(file)
    assert (bench.name, bench.path, bench.cycle) == ("two", str(file), 0.002)
    assert bench.winch["A"].limits.speed == pytest.approx(0.5)
    assert bench.winch["A"].limits.length == (0.5, 9.0)
    assert bench.bus["c"].heartbeat == 0.05


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_what_ships_is_without_fault(path: Path) -> None:
    assert load(path).warnings == ()


def test_shipped_declarations_are_read_by_their_names() -> None:
    assert read_profile("bench-spiral") == read_profile(find("profiles", "bench-spiral"))
    assert read_robot("cabtive").name == "cabtive"
    assert read_device("generic-cia402").name == "generic-cia402"
    assert read_simbench("spiral-bench").name == "spiral-bench"
    assert read_programme("programme-demo").name == "demo"


def test_a_file_of_the_name_counts_before_the_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = find("profiles", "bench-spiral").read_text()
    (tmp_path / "bench-spiral.toml").write_text(text.replace('"bench-spiral"', '"mine"'))
    monkeypatch.chdir(tmp_path)
    assert read_profile("bench-spiral").name == "mine"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bench-spirl", "did you mean 'bench-spiral'"),
        ("bench-spirl.toml", "there is no such file"),
        ("here/bench-spiral", "there is no such file"),
    ],
)
def test_neither_a_file_nor_a_shipped_name_is_an_error(name: str, words: str) -> None:
    with pytest.raises(FileError, match=words):
        read_profile(name)


def test_shipped_devices_are_found_by_name() -> None:
    for name in names("devices"):
        assert read_device(find("devices", name)).name == name


def test_an_unknown_name_gets_a_guess() -> None:
    with pytest.raises(FileError, match="did you mean 'laumas-tlb'"):
        find("devices", "laumas-tbl")


def leaves(text: str) -> list[int]:
    """Lines of a file of one ``key = value`` a line that hold such a pair."""
    return [n for n, line in enumerate(text.split("\n")) if re.match(r"[\w.]+ *= *[^\[{]+$", line)]


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_wrong_value_is_found_on_its_line(data: st.DataObject, tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    lines = FULL_WINCH.split("\n")
    number = data.draw(st.sampled_from(leaves(FULL_WINCH)[2:-1]))
    lines[number] = lines[number].split("=")[0] + "= { wrong = [1979-05-27] }"
    file.write_text("\n".join(lines))
    with pytest.raises(FileError) as caught:
        load(file)
    assert {fault.line for fault in caught.value.faults} == {number + 1}


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_damage_brings_the_reader_down(data: st.DataObject, tmp_path: Path) -> None:
    """Lines lost, doubled or garbled: a FileError, or a good file."""
    file = tmp_path / "w.toml"
    lines = data.draw(st.sampled_from(SHIPPED)).read_text().split("\n")
    place = data.draw(st.integers(0, len(lines) - 1))
    match data.draw(st.sampled_from(["lose", "double", "garble", "cut"])):
        case "lose":
            del lines[place]
        case "double":
            lines.insert(place, lines[place])
        case "garble":
            key = lines[place].split("=")[0]
            values = ["1", '"x"', "[]", "{}", "true", "[[]]", '{ "" = 1 }', "inf", '["a"]']
            lines[place] = f"{key}= {data.draw(st.sampled_from(values))}"
        case _:
            del lines[place:]
    file.write_text("\n".join(lines))
    with suppress(FileError):
        load(file)


@given(st.binary(max_size=60))
@example(b"[[a]]\n[a]")
def test_any_bytes_are_refused_with_reason(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "bytes.toml"
    file.write_bytes(data)
    with pytest.raises(FileError):
        load(file)


@given(
    st.floats(-1e6, 1e6, allow_subnormal=False),
    st.sampled_from([(unit, name) for name, table in UNITS.items() for unit in table]),
)
def test_quantities_read_back(value: float, kind: tuple[str, str]) -> None:
    unit, dimension = kind
    si = parse(f"{value!r} {unit}", dimension)
    if dimension == "temperature" and unit == "K":
        assert si == pytest.approx(value - 273.15)
    else:
        assert si == pytest.approx(value * UNITS[dimension][unit], rel=1e-12)


def test_quantities_as_written() -> None:
    assert parse("60 mm", "length") == 0.06
    assert parse("-1.5e-3 m", "length") == -0.0015
    assert parse(".5 %", "ratio") == 0.005
    assert parse("3", "ratio") == parse(3, "ratio") == 3.0
    assert parse("90 deg", "angle") == pytest.approx(math.pi / 2)
    assert parse("inf N", "force") == math.inf
    assert parse("50 µm", "length") == parse("50 um", "length"), "as it is printed"
    assert parse("90 °", "angle") == parse("90°", "angle") == parse("90 deg", "angle")
    assert parse("1500 1/min", "angular speed") == parse("1500 rpm", "angular speed")
    assert parse("2 Nm", "torque") == parse("2 N·m", "torque") == 2.0
    assert parse("3 m/s²", "acceleration") == 3.0
    assert parse("1.2 kg·cm²", "inertia") == parse("1.2 kg cm^2", "inertia")
    assert format_quantity(0.06, "mm") == "60 mm"
    for text in ("60", 60, "mm", "60 kg", "1_0 mm", "nan mm", "0x10 mm", "", True, None):
        with pytest.raises(UsageError):
            parse(text, "length")


AXIS = """\
schema = 1
kind = "axis"
name = "elbow"
[motor]
inertia = "2 kg cm^2"
torque_constant = "90 mN m/A"
[gearbox]
ratio = 50
[[effect]]
id = "joint-gravity"
amplitude = "0.4 N m"
phase = "90 deg"
"""


def written(folder: Path, text: str = AXIS, name: str = "elbow.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_an_axis_has_motor_gearbox_and_effects(tmp_path: Path) -> None:
    axis = read_profile(written(tmp_path))
    assert axis.gearbox.ratio == 50
    assert axis.motor.torque_constant == pytest.approx(0.09)
    values = {term.effect.id: dict(term.values) for term in terms_of(axis)}
    assert values["rotor-inertia"] == {"inertia": pytest.approx(2e-4)}
    assert values["joint-gravity"]["amplitude"] == pytest.approx(0.4)
    assert read_any(tmp_path / "elbow.toml") == axis


def test_an_axis_needs_nothing_but_its_kind(tmp_path: Path) -> None:
    axis = read_profile(written(tmp_path, 'schema = 1\nkind = "axis"\n'))
    assert (axis.name, axis.gearbox.ratio, axis.reference.motor_angle) == ("elbow", 1.0, 0.0)
    assert line_of(axis).modifiers == ()


@pytest.mark.parametrize(
    ("added", "message"),
    [
        ('[drum]\nkind = "grooved"', "drum: belongs to a winch"),
        ('[[pulley]]\nradius = "4 cm"', "pulley: belongs to a winch"),
        ('[cable]\ndiameter = "4 mm"', "cable: belongs to a winch"),
        ('[reference]\ncable_length = "2 m"', "reference.cable_length: belongs to a winch"),
        ("[reference]\nwound_turns = 3", "reference.wound_turns: belongs to a winch"),
        ("wheels = 4", "wheels: unknown key"),
    ],
)
def test_parts_of_a_winch_are_refused(tmp_path: Path, added: str, message: str) -> None:
    text = 'schema = 1\nkind = "axis"\n' + added + "\n"
    with pytest.raises(FileError) as error:
        read_profile(written(tmp_path, text))
    assert message in str(error.value)


def test_a_winch_is_asked_for_in_words(tmp_path: Path) -> None:
    path = written(tmp_path)
    with pytest.raises(FileError, match="'axis', which has no drum and no cable; a 'winch' is"):
        read_winch(path)
    with pytest.raises(FileError, match="a 'robot' is needed here"):
        read_robot(path)


def test_a_bench_refuses_an_axis(tmp_path: Path) -> None:
    written(tmp_path)
    bench = find("sim", "spiral-bench").read_text().split("[winch.A.truth]")[0]
    bench = bench.replace('kind = "sim-bench"', 'kind = "bench"')
    bench = bench.replace('profile = "bench-spiral"', 'profile = "elbow.toml"')
    path = written(tmp_path, bench, "bench.toml")
    found = CliRunner().invoke(command, [str(path)])
    assert found.exit_code == 3
    assert "which has no drum and no cable; a 'winch' is needed here" in found.output
