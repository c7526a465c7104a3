"""What the page shows is in the JSON, too, in SI."""

from __future__ import annotations

import json

import numpy as np
import pytest

from report_answers import answer_of, answer_of_both
from report_parsed import Page
from winchkit.cli.core.output import to_json
from winchkit.report.as_json import report_json
from winchkit.report.pages.pages import report_html

UNKNOWN = pytest.param("five-cornered-drum", marks=pytest.mark.slow)
"""A cause that no effect describes: the search for one ends last."""


@pytest.mark.slow
def test_the_waterfall_begins_and_ends_with_the_errors_of_the_answer() -> None:
    answer = answer_of_both("demo-elastic-rope", "demo-motor-drag")
    waterfall = report_json(answer)["waterfall"]
    for name, output in answer.diagnosis.outputs.items():
        steps = [step["heldout_rms"][name] for step in waterfall["steps"]]
        assert steps[0] == output.heldout_rms_before
        assert steps[-1] == output.heldout_rms_after
    assert len(waterfall["steps"]) == 1 + len(answer.diagnosis.steps)
    assert len(waterfall["first"]) == len(waterfall["last"]) == len(answer.diagnosis.steps)


@pytest.mark.parametrize("bench", ["demo-adequate", UNKNOWN])
def test_nothing_named_has_no_waterfall_and_no_after(bench: str) -> None:
    found = report_json(answer_of(bench))
    assert found["waterfall"] is None
    assert found["residuals"]["after"] is None
    assert found["maps"]["after"] is None


@pytest.mark.slow
def test_the_curve_of_the_rest_has_its_five_corners() -> None:
    curves = report_json(answer_of("five-cornered-drum"))["residuals"]["before"]
    curve = next(c for c in curves if c["order"] == 5)
    assert (curve["variable"], curve["unit"]) == ("drum_angle", "rad")
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    spectrum = np.abs(np.fft.rfft(np.interp(turn, curve["x"], curve["mean"])))
    assert int(np.argmax(spectrum[1:])) + 1 == 5


@pytest.mark.slow
@pytest.mark.parametrize("bench", ["demo-elastic-rope", UNKNOWN, "demo-adequate"])
def test_text_and_json_report_the_same(bench: str) -> None:
    answer = answer_of(bench)
    found = report_json(answer)
    page = Page(report_html(answer, bench))
    assert found["sentence"] in page.text
    assert found["would_change"] in page.text
    assert json.loads(to_json(found)) == next(
        json.loads(words) for words in page.words if words.startswith("{")
    )
