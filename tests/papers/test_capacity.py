"""How much cable a drum takes, what is left on it, and what ``winchkit check`` says."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from hypothesis import given
from hypothesis import strategies as st

from command_line import invoke
from winchkit.errors import FileError
from winchkit.model.capacity import (
    capacity,
    drum_warnings,
    length_at,
    safe_lengths,
    turns_at,
)
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.schema.read import read_profile


def winch(drum: DrumSpec, turns: float = 4.0, length: float | None = 8.0) -> WinchProfile:
    return WinchProfile(
        name="w",
        drum=drum,
        gearbox=GearboxSpec(ratio=20.0),
        reference=ReferenceSpec(cable_length=length, wound_turns=turns),
        cable=CableSpec(diameter=0.006),
    )


GROOVED = winch(DrumSpec("grooved", 0.05, groove_pitch=0.005, width=0.3))
SPIRAL = winch(DrumSpec("spiral", 0.05, flange_radius=0.083))
DRUMS = {
    "grooved": GROOVED,
    "spiral": SPIRAL,
    "archimedean": winch(DrumSpec("archimedean", 0.05, flange_radius=0.083)),
    "squared": winch(DrumSpec("squared", 0.05, build_up=2e-4, flange_radius=0.083)),
}


def test_a_groove_holds_its_width_over_its_pitch() -> None:
    found = capacity(GROOVED)
    assert (found.turns, found.limited_by) == (pytest.approx(60.0), "width")
    # One turn of the helix is the hypotenuse of circumference and pitch.
    assert found.length == pytest.approx(60 * np.hypot(2 * pi * 0.05, 0.005))


def test_a_spiral_drum_counts_its_layers() -> None:
    """Cable centres at 50, 56, … 80 mm: the sixth layer's outer side just meets 83 mm."""
    found = capacity(SPIRAL)
    assert (found.turns, found.limited_by) == (6.0, "flange")
    assert found.length == pytest.approx(2 * pi * sum((0.05, 0.056, 0.062, 0.068, 0.074, 0.080)))
    lower = replace(SPIRAL, drum=replace(SPIRAL.drum, flange_radius=0.0829))
    assert capacity(lower).turns == 5.0


def test_a_spiral_that_climbs_evenly_ends_at_the_flange() -> None:
    found = capacity(DRUMS["archimedean"])
    assert 0.05 + 0.006 * found.turns + 0.003 == pytest.approx(0.083)
    inner, outer = 0.05, 0.080
    # Its area is that of the ring between the first and the last cable centre.
    assert found.length * 0.006 == pytest.approx(pi * (outer**2 - inner**2), rel=1e-9)


def test_the_squared_law_fills_its_ring() -> None:
    found = capacity(DRUMS["squared"])
    assert found.length == pytest.approx((0.080**2 - 0.05**2) / 2e-4, rel=1e-9)


def test_without_width_or_flange_nothing_is_known() -> None:
    bare = capacity(winch(DrumSpec("grooved", 0.05, groove_pitch=0.005)))
    assert np.isnan([bare.turns, bare.length]).all()
    assert bare.limited_by == ""


def test_a_flange_that_the_first_layer_passes_holds_nothing() -> None:
    assert capacity(winch(DrumSpec("spiral", 0.05, flange_radius=0.051))).turns == 0.0


@pytest.mark.parametrize("kind", DRUMS)
@given(turns=st.floats(0.5, 6))
def test_turns_and_lengths_are_each_others_inverse(kind: str, turns: float) -> None:
    profile = DRUMS[kind]
    assert turns_at(profile, length_at(profile, turns)) == pytest.approx(turns, rel=1e-9)
    assert length_at(profile, 4.0) == pytest.approx(8.0)


def test_safe_lengths_are_the_ends_of_the_stroke() -> None:
    shortest, longest = safe_lengths(GROOVED)
    per_turn = float(np.hypot(2 * pi * 0.05, 0.005))
    assert longest == pytest.approx(8.0 + 2 * per_turn)
    assert shortest == pytest.approx(8.0 - 56 * per_turn)
    assert np.isnan(safe_lengths(replace(GROOVED, reference=ReferenceSpec()))).all()
    assert np.isnan(turns_at(replace(GROOVED, reference=ReferenceSpec()), 3.0))


def test_both_ends_are_warned_of() -> None:
    assert list(drum_warnings(GROOVED, 0.0, 8.6)) == []
    ((key, said),) = drum_warnings(GROOVED, 1.0, 8.7)
    assert key == "reference.wound_turns"
    assert "1.77 turns" in said
    assert "8.7 m" in said
    ((key, said),) = drum_warnings(SPIRAL, 6.0, 8.0)
    assert key == "drum.flange_radius"
    assert "takes 6 turns" in said
    # There is no warning about turns that are not declared.
    assert list(drum_warnings(winch(GROOVED.drum, turns=0.0), 0.0, 100.0)) == []


FILE = """\
schema = 1
kind = "winch"
name = "w"
[drum]
kind = "grooved"
winding_radius = "60 mm"
groove_pitch = "5 mm"
width = "100 mm"
[gearbox]
ratio = 20
[reference]
cable_length = "6 m"
wound_turns = 5
"""
BENCH = """\
schema = 1
kind = "bench"
[bus.c]
kind = "can"
interface = "virtual"
channel = "c"
[winch.A]
profile = "w"
servo = { device = "generic-cia402", bus = "c", node = 1 }
[winch.A.limits]
speed = "0.5 m/s"
length = ["0.2 m", "7 m"]
"""


def check(*arguments: object) -> Result:
    return invoke("check", *arguments)


def test_check_reports_the_safe_stroke(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    file.write_text(FILE)
    result = check(file)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "safe from 0.345 m to 7.13 m of cable" in result.stdout


@pytest.mark.parametrize(
    ("turns", "line", "key"), [("1.5", 13, "reference.wound_turns"), ("21", 8, "drum.width")]
)
def test_check_warns_at_the_line(tmp_path: Path, turns: str, line: int, key: str) -> None:
    file = tmp_path / "w.toml"
    file.write_text(FILE.replace("wound_turns = 5", f"wound_turns = {turns}"))
    result = check(file, "--json")
    assert result.exit_code == 0
    (warning,) = json.loads(result.stdout)["files"][0]["warnings"]
    assert (warning["line"], warning["key"]) == (line, key)


def test_check_of_a_bench_looks_at_its_limits(tmp_path: Path) -> None:
    (tmp_path / "w.toml").write_text(FILE)
    bench = tmp_path / "bench.toml"

    def warnings(text: str) -> list[dict[str, object]]:
        """Those of the limits of length; there is no cell, and so no limit of tension."""
        bench.write_text(text)
        told = json.loads(check(bench, "--json").stdout)["files"][0]["warnings"]
        return [warning for warning in told if warning["key"] == "winch.A.limits.length"]

    (warning,) = warnings(BENCH)
    assert warning["line"] == 12
    assert "overfilled" in str(warning["message"])
    (warning,) = warnings(BENCH.replace('"0.2 m", "7 m"', '"0.4 m", "7.5 m"'))
    assert "dead wraps" in str(warning["message"])
    assert warnings(BENCH.replace('"0.2 m", "7 m"', '"0.4 m", "7 m"')) == []


def test_a_flange_below_the_cable_is_a_fault(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    file.write_text(FILE.replace("width =", 'flange_radius = "50 mm"\nwidth ='))
    with pytest.raises(FileError, match=r"w\.toml:8: drum\.flange_radius: 0\.05 m must be above"):
        read_profile(file)
