"""Results in a console and in a notebook: one screen each, with the figures of the report."""

from __future__ import annotations

import re
import sys
from typing import Any

import pytest

from calibration_cases import held, measured, robot, rows
from command_line import own_process
from report_answers import answer_of, recorded
from report_parsed import Page
from robot_poses.truth import csv
from winchkit.catalog import find
from winchkit.diagnosis.add import add
from winchkit.diagnosis.compare import compare
from winchkit.rendering import Renderers, Shown
from winchkit.robot.calibration.calibrate import calibrate
from winchkit.schema.read import read_profile, read_robot

PROFILE = read_profile(find("profiles", "bench-spiral"))
VOID = {"polyline", "br"}


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    runs, answer = recorded("demo-fat-drum"), answer_of("demo-fat-drum")
    return {
        "run": runs[0],
        "profile": PROFILE,
        "robot": read_robot(find("profiles", "cabtive")),
        "comparison": compare(runs, PROFILE),
        "answer": answer,
        "diagnosis": answer.diagnosis,
        "fit": answer.diagnosis.fit,
        "addition": add("drum-radius", runs, PROFILE),
        "calibration": calibrate(robot(), measured(csv(rows())), held()),
    }


NAMES = ("run", "profile", "robot", "comparison", "answer", "diagnosis", "fit", "addition",
         "calibration")  # fmt: skip


def tags(html: str) -> set[str]:
    return {tag for tag, _ in Page(html).elements}


@pytest.mark.parametrize("name", NAMES)
def test_a_result_fits_on_one_screen(name: str, results: dict[str, Any]) -> None:
    lines = repr(results[name]).split("\n")
    assert 1 < len(lines) <= 24
    assert max(map(len, lines)) <= 170 if name == "fit" else max(map(len, lines)) <= 80


@pytest.mark.parametrize("name", NAMES)
def test_a_cell_of_a_notebook_is_whole_and_needs_no_script(
    name: str, results: dict[str, Any]
) -> None:
    html = results[name]._repr_html_()
    assert len(html) < 60_000
    assert not {"script", "style", "link", "img"} & tags(html)


def test_a_run_shows_its_channels_with_their_ranges(results: dict[str, Any]) -> None:
    run = results["run"]
    for text in (repr(run), Page(run._repr_html_()).text):
        assert f"{run['tension'].max():.1f}" in text
        assert "load_mass = 10 kg" in text
    assert tags(run._repr_html_()) >= {"table", "svg"}


def test_a_profile_shows_what_its_file_declares(results: dict[str, Any]) -> None:
    text = repr(results["profile"])
    assert "winding radius 60.00 mm" in text
    assert [line.split("wrap ")[-1] for line in text.splitlines() if "pulley" in line] == [
        "90.00°",
        "60.00°",
    ]
    assert "ratio 20.4" in text
    assert "exit point (861.1 mm" in repr(results["robot"])


def test_a_diagnosis_shows_its_verdict_the_value_and_the_errors(results: dict[str, Any]) -> None:
    diagnosis = results["diagnosis"]
    radius = diagnosis.steps[0].parameters["drum-radius"]["radius_error"]
    cell = Page(diagnosis._repr_html_()).text
    for text in (repr(diagnosis), cell):
        assert "explained" in text.lower()
        assert f"radius error = {radius.value * 1e3:.4f}" in text
    assert repr(results["answer"]) == repr(diagnosis)


def test_a_calibration_shows_the_errors_before_and_after(results: dict[str, Any]) -> None:
    assert re.search(r"held out +40 +1\.\d+ mm", repr(results["calibration"]))


def test_text_in_a_name_is_no_markup(results: dict[str, Any]) -> None:
    from dataclasses import replace

    run = replace(results["run"], name="<script>alert(1)</script>")
    assert "script" not in tags(run._repr_html_())


def test_a_type_without_renderer_has_the_representation_of_an_object() -> None:
    class Bare(Shown):
        pass

    assert repr(Bare()).startswith("<")
    assert Bare()._repr_html_() is None
    assert Renderers().of(Bare) is None


def test_the_report_is_loaded_when_a_result_is_shown_and_not_before() -> None:
    code = (
        "import sys, numpy as np\nfrom winchkit import Run\n"
        "run = Run('a', np.arange(2.0), {})\nprint('winchkit.report' in sys.modules)\n"
        "repr(run)\nprint('winchkit.report' in sys.modules, 'matplotlib' in sys.modules)"
    )
    done = own_process(sys.executable, "-c", code)
    assert done.stdout.split() == ["False", "True", "False"]
