"""Profiles of kind axis: contents, refusals, and that nothing takes one for a winch."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from winchkit.catalog import find
from winchkit.cli.files.check import command
from winchkit.effects.bind import line_of, terms_of
from winchkit.errors import FileError
from winchkit.schema.read import read_any, read_profile, read_robot, read_winch

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
