"""Profiles from the values of a drawing, each read back and nothing invented, and their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import done
from winchkit import find
from winchkit.errors import UsageError
from winchkit.profile_edit.drawing import DRUMS, FIELDS
from winchkit.profile_edit.naming import extended_name
from winchkit.profile_edit.new_profile import new_profile
from winchkit.schema.read import read_profile

SPIRAL = {"drum.kind": "spiral", "drum.winding_radius": "60 mm", "gearbox.ratio": "20.4"}
PULLEYS = ["40 mm, 90 deg", "40 mm, 60 deg"]


def test_the_drawing_of_a_shipped_winch_gives_its_profile(tmp_path: Path) -> None:
    values = {
        **SPIRAL,
        "drum.layer_growth": "0.08 mm",
        "cable.diameter": "4 mm",
        "cable.dead_length": "1500 mm",
        "path.inclination": "0.25 turn",
        "reference.cable_length": "400 cm",
        "reference.wound_turns": "4",
    }
    path = tmp_path / "bench-spiral.toml"
    unknown = new_profile(path, values, PULLEYS)
    shipped, own = read_profile(find("profiles", "bench-spiral")), read_profile(path)
    for part in ("drum", "cable", "path", "gearbox", "motor", "guide", "pulley", "reference"):
        assert getattr(own, part) == getattr(shipped, part), part
    text = path.read_text()
    for key, words in unknown.items():
        assert f"# {key.partition('.')[2]}: unknown; {words}" in text
    with pytest.raises(UsageError, match="exists already"):
        new_profile(path, values)


@pytest.mark.parametrize("kind", DRUMS)
def test_every_example_is_read_and_what_is_needed_is_required(kind: str, tmp_path: Path) -> None:
    own = [field for field in FIELDS if kind in field.drums]
    values = {field.key: field.example for field in own} | {"drum.kind": kind}
    assert new_profile(tmp_path / "all.toml", values, PULLEYS) == {}
    read_profile(tmp_path / "all.toml")
    needed = {field.key: values[field.key] for field in own if not field.without}
    for key in needed:
        if key != "drum.kind":
            rest = {other: text for other, text in values.items() if other != key}
            with pytest.raises(UsageError, match=f"{key}: missing"):
                new_profile(tmp_path / "less.toml", rest)
    assert not (tmp_path / "less.toml").exists()


@pytest.mark.parametrize(
    ("values", "fault"),
    [
        ({"drum.winding_radius": "60"}, "drum.winding_radius: '60' has no unit"),
        ({"drum.winding_radius": "60,5 mm"}, "write the decimal point: 60.5 mm"),
        ({"drum.winding_radius": "-60 mm"}, "must be above 0 m"),
        ({"reference.cable_length": "-1 m"}, "reference.cable_length: '-1 m' must be at least 0 m"),
        (
            {"path.inclination": "1e6 deg"},
            "path.inclination: '1e6 deg' must be at most 3.14159 rad",
        ),
        ({"motor.inertia": "1e300 kg m^2"}, "motor.inertia: '1e300 kg m^2' must be at most 1e+09"),
        ({"motor.torque_constant": "nan N m/A"}, "motor.torque_constant: 'nan N m/A'"),
        ({"cable.mass_per_length": "1e9 g/m"}, "cable.mass_per_length: '1e9 g/m' must be at most"),
        (
            {"guide.screw_lead": "5 mm", "guide.belt_ratio": "1e9"},
            "guide.belt_ratio: '1e9' must be at most 1000",
        ),
        ({"drum.kind": "spirl"}, "did you mean 'spiral'?"),
        ({"drum.groove_pitch": "5 mm"}, "drum.groove_pitch: a spiral drum has none"),
        ({"guide.distance": "1 m"}, "guide.distance: give guide.screw_lead too"),
        ({"drum.radius": "1 m"}, "drum.radius: unknown key"),
        ({}, "drum.layer_growth: missing; a spiral drum needs it, or cable.diameter"),
    ],
)
def test_a_wrong_value_names_its_key_and_writes_nothing(
    values: dict[str, str], fault: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError) as refused:
        new_profile(tmp_path / "own.toml", SPIRAL | values)
    assert fault in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_the_terminal_asks_until_the_answer_can_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("winchkit.cli.model.profile.may_ask", lambda: True)
    answers = ["grooved", "60", "60 mm", "5 mm", "", "20.4", *[""] * 9, "4 m", "", "40 mm", ""]
    target = tmp_path / "asked.toml"
    typed = "\n".join([*answers, ""])
    found = done("profile", "new", target, input=typed)
    assert "'60' has no unit" in found.output
    own = read_profile(target)
    values = own.drum.kind, own.drum.groove_pitch, own.reference.cable_length
    assert values == ("grooved", 5e-3, 4.0)
    assert [pulley.radius for pulley in own.pulley] == [0.04]


@pytest.mark.parametrize(
    ("profile", "effects", "name"),
    [
        ("bench-spiral", ["drum-radius"], "bench-spiral-drum-radius.toml"),
        ("there/own.toml", ["drum-radius"], "own-drum-radius.toml"),
        ("release-1.2", ["drum-radius"], "release-1.2-drum-radius.toml"),
        ("cabtive", ["swivel-radius/3"], "cabtive-swivel-radius-3.toml"),
        (Path("a/own.toml"), [], "own.toml"),
    ],
)
def test_the_name_has_the_profile_and_its_additions(
    profile: str | Path, effects: list[str], name: str
) -> None:
    assert extended_name(profile, *effects) == name


def test_one_addition_after_another_has_the_name_of_both_at_once() -> None:
    first = extended_name("bench-spiral", "drum-radius")
    assert extended_name(first, "cable-creep") == extended_name(
        "bench-spiral", "drum-radius", "cable-creep"
    )
