"""The figure and the sentence of one diagnosis have the same errors, digit by digit."""

from __future__ import annotations

import pytest

pytest.importorskip("starlette")

import winchkit
from report_answers import ELASTIC, OPEN, diagnosis_of
from winchkit.report.words.sentence import sentence
from winchkit.web.examples import example_runs
from winchkit.web.model_errors import model_errors, verdict


@pytest.mark.slow
def test_the_named_candidate_has_the_errors_of_the_sentence() -> None:
    example = example_runs("demo-eccentric-drum")
    profile = winchkit.read_profile(winchkit.find("profiles", example.profile))
    answer = winchkit.diagnose(list(example.runs), profile)
    said = sentence(answer.diagnosis)
    assert len(answer.diagnosis.steps) == 1
    found = model_errors(answer, ())
    units = {column["output"]: column["unit"] for column in found["columns"]}
    rows = {row["kind"]: row["cells"] for row in reversed(found["rows"])}
    compared = 0
    for output, unit in units.items():
        today, after = rows["today"][output], rows["candidate"][output]
        falls = f"from {today['text']} {unit} to"
        if falls in said:
            assert f"{falls} {after['text']} {unit}" in said
            compared += 1
    assert compared == 1, "the output whose error falls most"


def test_every_verdict_has_its_word_and_steps_have_their_doubts() -> None:
    told = verdict(diagnosis_of("undecided", ELASTIC, OPEN, unexplained_share=0.6))
    assert (told["verdict"], told["chip"]) == ("undecided", "Undecided")
    assert [step["effect"] for step in told["steps"]] == ["cable-elongation-linear"] * 2
    assert [bool(step["doubts"]) for step in told["steps"]] == [False, True]
    assert told["steps"][0]["text"].startswith("The cable is elastic: EA = 249.9 ± 7.0 kN")
