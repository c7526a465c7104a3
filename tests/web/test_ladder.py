"""The ladder and the sentence of one diagnosis have the same errors, digit by digit."""

from __future__ import annotations

import pytest

pytest.importorskip("starlette")

import winchkit
from winchkit.report.words.sentence import sentence
from winchkit.web.examples import example_runs
from winchkit.web.ladder import ladder


@pytest.mark.slow
def test_the_named_candidate_has_the_errors_of_the_sentence() -> None:
    example = example_runs("demo-eccentric-drum")
    profile = winchkit.read_profile(winchkit.find("profiles", example.profile))
    answer = winchkit.diagnose(list(example.runs), profile)
    said = sentence(answer.diagnosis)
    assert len(answer.diagnosis.steps) == 1
    found = ladder(answer, ())
    units = {column["output"]: column["unit"] for column in found["columns"]}
    rows = {row["kind"]: row["cells"] for row in reversed(found["rows"])}
    compared = 0
    for output, unit in units.items():
        today, after = rows["today"][output], rows["candidate"][output]
        falls = f"from {today['text']} {unit} to"
        if falls in said:
            assert f"{falls} {after['text']} {unit}" in said
            compared += 1
    assert compared == 2, "cable length and motor torque"
