"""The report and the comparison at a terminal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from report_answers import (
    ELASTIC,
    FIVE_CORNERS,
    FRICTION,
    NOISY,
    answer_of,
    answer_of_both,
    diagnosis_of,
    recorded,
)
from winchkit.catalog import find
from winchkit.diagnosis.add import add
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.results import Comparison, Diagnosis, NextRun, OutputError
from winchkit.report.detectability import untestable, visible
from winchkit.report.text import addition_text, compare_text, report_text
from winchkit.report.words.sentence import changes_text, sentence
from winchkit.schema.read import read_profile

UNKNOWN = pytest.param("five-cornered-drum", marks=pytest.mark.slow)
"""A cause that no effect describes: the search for one ends last."""


def saying(diagnosis: Diagnosis) -> WinchAnswer:
    """A real answer with another diagnosis."""
    real = answer_of("demo-adequate")
    return WinchAnswer(real.engine, real.result, diagnosis)


@pytest.mark.parametrize("bench", ["demo-elastic-rope", "demo-adequate", UNKNOWN])
def test_the_story_fits_a_terminal(bench: str) -> None:
    answer = answer_of(bench)
    lines = report_text(answer).splitlines()
    assert len(lines) <= 70
    assert max(map(len, lines)) <= 80
    assert lines[0] == answer.diagnosis.verdict.upper()
    assert sentence(answer.diagnosis) in " ".join(lines)
    assert not any("<" in line or "\u00a0" in line for line in lines)


@pytest.mark.parametrize("bench", ["demo-elastic-rope", "demo-adequate", UNKNOWN])
def test_every_verdict_has_the_detectable_effects(bench: str) -> None:
    answer = answer_of(bench)
    text = report_text(answer)
    rows = visible(answer)
    able = sum(row.share <= 1 for row in rows)
    blind = [effect for effect, _ in untestable(answer)]
    head = f"(90 % power): {able} of {len(rows) + len(blind)} effects at typical size"
    assert head in text
    faint = [row.effect for row in rows if not row.share <= 1]
    assert faint
    assert all(effect in text for effect in (*blind, *faint))
    assert "'winchkit plan' proposes" in text
    assert " ".join(changes_text(answer.diagnosis).split()) in " ".join(text.split())


@pytest.mark.slow
def test_the_shape_of_a_residual_is_drawn_over_its_variable() -> None:
    lines = report_text(answer_of("five-cornered-drum")).splitlines()
    at = next(n for n, line in enumerate(lines) if "5 periods per drum turn" in line and n > 5)
    heights = np.array(["▁▂▃▄▅▆▇█".index(bar) for bar in lines[at + 1].split()[0]])
    # The bench hides a drum with five corners.
    assert int(np.argmax(np.abs(np.fft.rfft(heights - heights.mean())))) == 5


def test_several_effects_are_reported_with_their_shares() -> None:
    answer = answer_of_both("demo-elastic-rope", "demo-motor-drag")
    stretch, drag = "cable-elongation-linear", "motor-coulomb"
    assert {step.effects[0] for step in answer.diagnosis.steps} == {stretch, drag}
    rows = {line[:34].strip(): line[34:].split() for line in report_text(answer).splitlines()}
    # With two effects, one alone is all but the other; the cable moves the length, the drag not.
    assert rows[f"only {stretch}"] == rows[f"all but {drag}"]
    assert rows[f"only {drag}"][:2] == rows["unchanged profile"][:2] != rows[f"only {stretch}"][:2]


def test_errors_before_and_after_are_shown_with_the_noise() -> None:
    text = report_text(saying(diagnosis_of("explained", ELASTIC)))
    (row,) = [line for line in text.splitlines() if line.startswith("  cable length")]
    assert row.split() == ["cable", "length", "1.63", "mm", "0.360", "mm", "0.300", "mm"]


def test_without_a_name_there_is_no_after() -> None:
    text = report_text(saying(diagnosis_of("unknown", where=FIVE_CORNERS, unexplained_share=1.0)))
    head = next(line for line in text.splitlines() if "held-out" in line)
    assert head.split()[-2:] == ["error", "noise"]
    line = "  tension, 5 periods per drum turn (44 % of its residual variance)"
    assert line in text.splitlines()


def test_rivals_are_shown_with_their_angle_and_the_run_that_separates_them() -> None:
    runs = (
        NextRun(("pulley-coulomb", "pulley-capstan"), "full stroke, three loads", 0.93),
        NextRun(("pulley-coulomb", "pulley-capstan"), "change a wrap angle", float("nan")),
    )
    text = report_text(saying(diagnosis_of("explained", FRICTION, next_runs=runs)))
    assert "pulley-coulomb / pulley-capstan  0.1° between signatures" in text
    assert "full stroke, three loads (power 93 %)" in text
    assert "change a wrap angle" in [line.rpartition(": ")[2] for line in text.splitlines()]


def test_too_much_to_say_is_cut_and_says_so() -> None:
    notes = tuple(f"run number {n} has something about it" for n in range(90))
    lines = report_text(saying(diagnosis_of("explained", ELASTIC, notes=notes))).splitlines()
    assert len(lines) == 70
    assert lines[-1] == "… more in --json and --html"


def test_a_comparison_has_errors_and_their_attribution() -> None:
    error = OutputError(
        "m", 100, None, 2.5, 1.6e-3, 4e-3, -3e-19, None, (("load", 0.82), ("time", 0.1))
    )
    lines = compare_text(Comparison({"cable_length": error}, 2.39e-3, ("a note",))).splitlines()
    assert lines[1].split()[2:] == ["1.60", "mm", "0", "mm", "4.00", "mm", "unknown", "2.50", "m"]
    assert "  cable length: load 82 % and time 10 %" in lines
    assert "offset of the length instrument, fitted: 2.39 mm" in lines
    assert lines[-1] == "  a note"


def test_a_comparison_of_real_runs_fits_a_terminal() -> None:
    profile = read_profile(find("profiles", "bench-spiral"))
    lines = compare_text(compare(recorded("demo-elastic-rope"), profile)).splitlines()
    assert len(lines) <= 70
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("  cable length: load") for line in lines)


def test_a_comparison_without_outputs_has_nothing_to_follow() -> None:
    assert "variance" not in compare_text(Comparison({}, None))
    quiet = OutputError("N", 10, None, 150.0, 0.7, 2.0, 0.1, 0.7, ())
    assert "  tension: no measured variable" in compare_text(Comparison({"tension": quiet}, None))


def test_an_addition_is_reported_with_value_and_gain() -> None:
    profile = read_profile(find("profiles", "bench-spiral"))
    addition = add("cable-elongation-linear", recorded("demo-elastic-rope"), profile)
    text = addition_text(replace(addition, outputs={"cable_length": NOISY}))
    (value,) = [line for line in text.splitlines() if "EA = " in line]
    assert value.startswith("  cable-elongation-linear")
    assert " ± " in value
    assert "1.63 mm" in text
    assert "0.360 mm" in text
