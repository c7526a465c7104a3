"""``winchkit size``: the paper's own choices, and that every alternative offered does."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import Result
from hypothesis import given
from hypothesis import strategies as st

from command_line import done
from winchkit.errors import FileError, UsageError
from winchkit.model.sizing.parts import belt_length, centre_distance
from winchkit.model.sizing.row import Row, down, up
from winchkit.model.sizing.sizing import sized
from winchkit.schema.profiles.sizing import SizeSpec, WormSpec
from winchkit.schema.read import read_size

EXAMPLE = Path(__file__).parents[2] / "examples" / "winding-device.toml"
PAPER = read_size(EXAMPLE)


def row(spec: SizeSpec, name: str) -> Row:
    (found,) = (each for each in sized(spec) if each.name == name)
    return found


def invoke(*arguments: object, code: int = 0) -> Result:
    return done("size", *arguments, code=code)


def number(text: str) -> float:
    return float(re.findall(r"[\d.]+", text)[0])


def test_the_papers_gearbox_fails_its_own_torque_limit() -> None:
    torque = row(PAPER, "motor torque")
    assert torque.ok is False
    assert torque.value == pytest.approx(2.45, abs=5e-3)
    assert torque.limit == pytest.approx(1.273, abs=5e-4)
    assert torque.alternatives[0].startswith(
        "a gear ratio from 57.8 to 314 of the same efficiency; offered: 60, 80, 100"
    )
    assert [each.name for each in sized(PAPER) if each.ok is False] == [
        "motor torque",
        "drum width",
    ]


def with_ratio(ratio: float) -> SizeSpec:
    return replace(PAPER, gearbox=replace(PAPER.gearbox, ratio=ratio))


@pytest.mark.parametrize(
    ("ratio", "torque", "speed"), [(57, False, True), (58, True, True), (315, True, False)]
)
def test_ratios_from_58_to_314_would_do(ratio: float, torque: bool, speed: bool) -> None:
    spec = with_ratio(ratio)
    assert row(spec, "motor torque").ok is torque
    assert row(spec, "motor speed").ok is speed


def test_every_alternative_to_the_torque_does() -> None:
    ratio, motor, force, radius = row(PAPER, "motor torque").alternatives
    lowest, highest = (float(x) for x in re.findall(r"[\d.]+", ratio)[:2])
    assert row(with_ratio(lowest), "motor torque").ok
    assert row(with_ratio(highest), "motor speed").ok
    stronger = replace(PAPER.motor, torque=number(motor))
    assert row(replace(PAPER, motor=stronger), "motor torque").ok
    lighter = replace(PAPER.requirement, force=number(force))
    assert row(replace(PAPER, requirement=lighter), "motor torque").ok
    smaller = replace(PAPER.drum, winding_radius=number(radius) / 1e3)
    assert row(replace(PAPER, drum=smaller), "motor torque").ok


def test_every_alternative_to_the_drum_does() -> None:
    width, radius, length = (number(text) for text in row(PAPER, "drum width").alternatives)
    for change in ({"width": width / 1e3}, {"winding_radius": radius / 1e3}):
        assert row(replace(PAPER, drum=replace(PAPER.drum, **change)), "drum width").ok
    shorter = replace(PAPER.requirement, cable_length=length)
    assert row(replace(PAPER, requirement=shorter), "drum width").ok


def test_the_screw_and_the_belt_fail_where_they_should() -> None:
    assert PAPER.screw is not None
    assert PAPER.belt is not None
    whirling = replace(PAPER, screw=replace(PAPER.screw, diameter=0.008))
    speed = row(whirling, "screw speed")
    assert speed.ok is False
    thick, short = (number(text) for text in speed.alternatives)
    assert thick == pytest.approx(8.77, abs=0.01)
    for change in ({"diameter": thick / 1e3}, {"length": short / 1e3}):
        assert row(replace(whirling, screw=replace(whirling.screw, **change)), "screw speed").ok
    loaded = replace(PAPER, belt=replace(PAPER.belt, power=80.0))
    module = row(loaded, "belt module")
    assert module.ok is False
    assert module.value == 1.5e-3
    assert module.limit == pytest.approx(7.1e-3, abs=2e-5)
    assert module.alternatives == ("the standard module 10 mm", "at most 0.75 W over this belt")
    wrong = replace(PAPER, screw=replace(PAPER.screw, lead=0.004))
    guide = row(wrong, "guide per drum turn")
    assert (guide.ok, guide.value, guide.limit) == (False, 0.004, 0.005)
    assert guide.alternatives[1].startswith("a belt ratio of 1.25")
    stubby = replace(PAPER, screw=replace(PAPER.screw, nut=0.45))
    assert row(stubby, "screw travel").alternatives == ("750 mm between the bearings",)


def test_a_full_drum_pulls_hardest_and_an_empty_one_turns_fastest() -> None:
    full = replace(PAPER, drum=replace(PAPER.drum, full_radius=0.06))
    assert row(full, "motor torque").value == pytest.approx(row(PAPER, "motor torque").value * 1.2)
    assert row(full, "motor speed").value == row(PAPER, "motor speed").value


def test_a_margin_counts_for_torque_and_power() -> None:
    careful = replace(PAPER, motor=replace(PAPER.motor, margin=2.0))
    for name in ("motor torque", "motor power"):
        assert row(careful, name).value == pytest.approx(2 * row(PAPER, name).value)


def test_a_motor_too_weak_for_any_ratio_is_reported() -> None:
    weak = replace(PAPER, motor=replace(PAPER.motor, power=60.0))
    assert row(weak, "motor torque").alternatives[0].startswith("no gear ratio")
    assert row(weak, "motor power").alternatives == ("a motor of 73.56 W",)


@pytest.mark.parametrize(("friction", "note"), [(0.02, "turns back"), (0.1, "locks")])
def test_a_worm_reports_whether_it_holds(friction: float, note: str) -> None:
    worm = WormSpec(lead_angle=0.06, friction=friction)
    spec = replace(PAPER, gearbox=replace(PAPER.gearbox, worm=worm))
    assert row(spec, "worm efficiency").note == note
    assert row(spec, "gear ratio").ok
    odd = replace(PAPER, gearbox=replace(PAPER.gearbox, ratio=30.4, worm=worm))
    assert row(odd, "gear ratio").ok is False


def test_without_a_guide_only_motor_and_drum_are_reported() -> None:
    names = [each.name for each in sized(replace(PAPER, screw=None, belt=None))]
    assert names[-1] == "drum width"


sizes = st.floats(1e-4, 1e4)


@given(sizes, sizes, sizes, sizes, sizes, sizes)
def test_any_size_gives_a_result(
    force: float, ratio: float, radius: float, width: float, diameter: float, power: float
) -> None:
    """Every row has its number, and one that fails says what would do."""
    assert PAPER.screw is not None
    assert PAPER.belt is not None
    spec = replace(
        PAPER,
        requirement=replace(PAPER.requirement, force=force),
        gearbox=replace(PAPER.gearbox, ratio=ratio),
        drum=replace(PAPER.drum, winding_radius=radius, width=width),
        screw=replace(PAPER.screw, diameter=diameter),
        belt=replace(PAPER.belt, power=power),
    )
    for each in sized(spec):
        assert math.isfinite(each.value)
        assert bool(each.alternatives) == (each.ok is False)


def test_a_drum_no_wider_than_its_dead_wraps() -> None:
    thin = replace(PAPER, drum=replace(PAPER.drum, width=2 * PAPER.drum.groove_pitch))
    (only,) = row(thin, "drum width").alternatives
    assert only.startswith("a drum of")


@given(st.floats(1e-9, 1e9), st.integers(1, 8))
def test_limits_in_words_are_rounded_to_the_safe_side(value: float, digits: int) -> None:
    coarse, rounding = 10.0 ** (1 - digits), 1 + 1e-15
    assert value / rounding <= float(up(value, digits)) <= value * (1 + coarse) * rounding
    assert value * (1 - coarse) / rounding <= float(down(value, digits)) <= value * rounding


def test_belts_that_cannot_be_are_refused() -> None:
    with pytest.raises(UsageError, match="within each other"):
        belt_length(0.05, 0.01, 0.08)
    with pytest.raises(UsageError, match="too short"):
        centre_distance(0.2, 0.01, 0.06)


def test_the_table_of_the_command_line() -> None:
    result = invoke(EXAMPLE, code=1)
    assert re.search(r"motor torque +Eq\. 13 +2\.452 N m +<= +1\.273 N m +FAILS", result.stdout)
    assert (
        "would do: a gear ratio from 57.8 to 314 of the same efficiency; offered: 60, 80, 100"
        in result.stdout
    )
    assert result.stdout.rstrip().endswith("2 requirements not met")


def test_the_json_of_the_command_line(tmp_path: Path) -> None:
    file = tmp_path / "better.toml"
    text = EXAMPLE.read_text(encoding="utf-8")
    file.write_text(text.replace("ratio = 30", "ratio = 60").replace('"300 mm"', '"330 mm"'))
    result = invoke(file, "--json")
    answer = json.loads(result.stdout)
    assert (answer["schema"], answer["name"], answer["ok"]) == (1, "winding-device", True)
    rows = {each["name"]: each for each in answer["requirements"]}
    assert rows["motor speed"]["value"] == pytest.approx(60.0)
    assert rows["motor speed"]["unit"] == "rad/s"
    assert rows["transmission efficiency"]["limit"] is None
    assert "every requirement is met" in invoke(file).stdout


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('power = "400 W"', 'power = "0 W"', "must be above 0 W"),
        ('power = "400 W"', 'powr = "400 W"', "did you mean 'power'"),
        ("[drum] ", '[drum]\nfull_radius = "40 mm"\n#', "is below winding_radius"),
        ("[screw] ", "[screw_]\n#", "unknown key"),
        ('ends = "fixed-fixed"', 'ends = "loose"', "expected one of fixed-fixed"),
    ],
)
def test_faults_of_a_specification_are_reported(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    file = tmp_path / "bad.toml"
    text = EXAMPLE.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1))
    result = invoke(file, code=3)
    assert said in result.stderr
    assert re.match(rf"{re.escape(str(file))}:\d+: ", result.stderr)


def test_another_kind_of_file_is_refused() -> None:
    with pytest.raises(FileError, match="a 'size' is needed"):
        read_size(EXAMPLE.parent / "ladder.toml")
    assert PAPER.motor.speed == pytest.approx(100 * math.pi)
