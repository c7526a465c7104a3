"""Pages, text and JSON of a robot's poses, made as a user makes them, on the benchmark's files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from report_parsed import HOSTILE, Page
from robot_poses.cases import CASES
from robot_poses.hidden import profile_text, record
from winchkit.cli import main

BY_NAME = {case.name: case for case in CASES}


def call(*arguments: object) -> Result:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result


def diagnosed(folder: Path, fault: str, *options: str, count: int, repeats: int) -> dict[str, Any]:
    """What ``winchkit diagnose`` writes of a robot with a hidden fault."""
    profile, page = folder / "robot.toml", folder / "out.html"
    profile.write_text(profile_text())
    run = record(BY_NAME[fault], folder, "poses.csv", count=count, repeats=repeats)
    text = call("diagnose", run, "--profile", profile, "--html", page, *options).stdout
    return {"text": text, "html": page.read_text(), "run": run, "robot": profile}


@pytest.fixture(scope="module")
def drum(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A drum radius hidden on line 2: its page and its JSON."""
    folder = tmp_path_factory.mktemp("drum")
    found = diagnosed(folder, "drum radius", "--json", count=40, repeats=12)
    return found | {"answer": json.loads(found["text"])}


@pytest.fixture(scope="module")
def unknown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Waves along x that no effect has."""
    return diagnosed(tmp_path_factory.mktemp("waves"), "outside: waves", count=50, repeats=15)


def test_the_page_is_whole_without_script_and_network(drum: dict[str, Any]) -> None:
    page = Page(drum["html"])
    assert len(page.scripts) == 2
    for _, attributes in page.elements:
        assert "src" not in attributes
        assert attributes.get("href", "#").startswith("#"), "links lead within the page"
    ids = {attributes.get("id") for _, attributes in page.elements}
    parts = ("verdict", "residuals", "waterfall", "candidates", "confusion", "detectable", "next")
    assert {*parts, "notes", "repeat"} <= ids


def test_the_page_says_what_the_json_says(drum: dict[str, Any]) -> None:
    page, answer = Page(drum["html"]), drum["answer"]
    assert answer["sentence"].replace("\u00a0", " ") in page.text
    assert "drum-radius/2" in page.text
    assert "cannot be distinguished with these poses" in page.text
    assert answer["would_change"] in page.text
    assert f"winchkit add drum-radius/2 --profile {drum['robot']}" in page.text
    assert "these runs" not in page.text.lower()


def test_errors_are_drawn_over_what_they_follow(drum: dict[str, Any]) -> None:
    """A wrong radius errs along the cable of its line, and no longer once it is fitted."""
    before, after = (drum["answer"]["residuals"][when] for when in ("before", "after"))
    (own,) = [curve for curve in before if curve["output"] == "cable_length"]
    (then,) = [curve for curve in after if curve["output"] == "cable_length"]
    assert own["line"] == "2"
    assert own["variable"] in ("cable_length", "motor_angle", "drum_angle")
    ends = [curve["mean"][-1] - curve["mean"][0] for curve in (own, then)]
    assert abs(ends[1]) < 0.5 * abs(ends[0])
    assert Page(drum["html"]).shown.count("error-cable_length") == 1


def test_the_waterfall_begins_and_ends_at_the_figures(drum: dict[str, Any]) -> None:
    outputs, waterfall = drum["answer"]["outputs"], drum["answer"]["waterfall"]
    assert len(waterfall["steps"]) == 2
    for step, when in zip(waterfall["steps"], ("before", "after"), strict=True):
        for name, rms in step["heldout_rms"].items():
            assert rms == pytest.approx(outputs[name][f"heldout_rms_{when}"])


def test_candidates_have_errors_in_the_units_of_the_outputs(drum: dict[str, Any]) -> None:
    """The effect that was found, alone, leaves held out what the diagnosis leaves."""
    answer = drum["answer"]
    own = next(c for c in answer["candidates"] if c["effect"] == "drum-radius" and c["heldout_rms"])
    for name, output in answer["outputs"].items():
        assert own["heldout_rms"][name] == pytest.approx(output["heldout_rms_after"], rel=0.02)


def test_a_rest_is_located_drawn_and_reported_within_eighty_columns(
    unknown: dict[str, Any],
) -> None:
    text, page = unknown["text"], Page(unknown["html"])
    assert text.startswith("UNKNOWN")
    assert "as a function of platform x" in text
    assert "▁" in text
    assert max(map(len, text.splitlines())) <= 80
    assert len(text.splitlines()) <= 70
    ids = {attributes.get("id") for _, attributes in page.elements}
    assert "unexplained" in ids
    assert any(name.startswith("pattern-") for name in page.shown)


def test_a_comparison_and_an_addition_have_pages_too(drum: dict[str, Any], tmp_path: Path) -> None:
    run, profile = drum["run"], drum["robot"]
    first, second = tmp_path / "compare.html", tmp_path / "add.html"
    call("compare", run, "-p", profile, "--html", first)
    better = tmp_path / "better.toml"
    call("add", "drum-radius/2", "--fit", run, "-p", profile, "-o", better, "--html", second)
    compared, added = (Page(path.read_text()) for path in (first, second))
    assert "error of the cable length is" in compared.text
    assert "Written to" in added.text
    assert set(compared.shown) == compared.figures.keys()
    assert "errors" in added.shown


def test_hostile_names_are_text_and_nothing_else(drum: dict[str, Any], tmp_path: Path) -> None:
    profile, page = tmp_path / "robot.toml", tmp_path / "out.html"
    profile.write_text(profile_text().replace('"known"', f"'{HOSTILE}'"))
    call("compare", drum["run"], "-p", profile, "--html", page)
    parsed = Page(page.read_text())
    assert len(parsed.scripts) == 2
    assert parsed.count("img") == 0


def test_a_geometry_off_as_a_whole_is_reported_so_and_calibrated(
    drum: dict[str, Any], tmp_path: Path
) -> None:
    page = tmp_path / "out.html"
    answer = json.loads(
        call("diagnose", drum["run"], "-p", "cabtive", "--json", "--html", page).stdout
    )
    assert answer["steps"][0]["whole"]
    assert "geometry of the robot differs as a whole" in answer["sentence"]
    steps = [step["model"] for step in answer["waterfall"]["steps"]]
    assert steps[1].startswith("+ the whole geometry")
    assert "winchkit calibrate cabtive" in Page(page.read_text()).text
