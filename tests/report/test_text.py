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
    OPEN,
    answer_of,
    answer_of_both,
    diagnosis_of,
    recorded,
)
from winchkit.catalog import find
from winchkit.diagnosis.add import add
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.results import (
    CandidateScore,
    Comparison,
    Diagnosis,
    NextRun,
    OutputError,
    RunOffset,
)
from winchkit.quantity_text import percent
from winchkit.report.comparison_rows import failing
from winchkit.report.detectability import untestable, useful_candidates, visible
from winchkit.report.figures.waterfall import falls_of
from winchkit.report.text import FAILS, addition_text, compare_text, report_text
from winchkit.report.words.sentence import changes_text, headline
from winchkit.report.words.steps import lowered_most, step_text
from winchkit.schema.read import read_profile

UNKNOWN = pytest.param("five-cornered-drum", marks=pytest.mark.slow)
"""A cause that no effect describes: the search for one ends last."""


def saying(diagnosis: Diagnosis) -> WinchAnswer:
    """A real answer with another diagnosis."""
    real = answer_of("demo-adequate")
    return WinchAnswer(real.engine, real.result, diagnosis)


BENCHES = ["demo-elastic-rope", "demo-adequate", "demo-sticky-pulleys", UNKNOWN]


@pytest.mark.parametrize("bench", BENCHES)
def test_the_answer_is_one_screen(bench: str) -> None:
    answer = answer_of(bench)
    lines = report_text(answer).splitlines()
    assert len(lines) <= 29
    assert max(map(len, lines)) <= 80
    assert lines[0] == answer.diagnosis.verdict.upper()
    assert headline(answer.diagnosis) in " ".join(lines)
    told = " ".join(" ".join(lines).split())
    assert changes_text(answer.diagnosis) in told
    assert not any("<" in line or "\u00a0" in line for line in lines)


@pytest.mark.parametrize("bench", BENCHES)
def test_how_it_was_reached_needs_verbose(bench: str) -> None:
    answer = answer_of(bench)
    short, long = report_text(answer), report_text(answer, verbose=True)
    for what in ("90 % power", "highest evidence", "between signatures", "correlation"):
        assert what not in short
    assert set(short.splitlines()) <= set(long.splitlines())
    rows = visible(answer)
    able = sum(row.share <= 1 for row in rows)
    blind = [effect for effect, _ in untestable(answer)]
    assert f"(90 % power): {able} of {len(rows) + len(blind)} effects at typical size" in long
    faint = [row.effect for row in rows if not row.share <= 1]
    assert faint
    assert all(effect in long for effect in (*blind, *faint))
    assert "temperature nearly constant" in long, "what the runs cannot show is no fault of them"
    assert "temperature nearly constant" not in short


@pytest.mark.slow
def test_the_shape_of_a_residual_is_drawn_over_its_variable() -> None:
    lines = report_text(answer_of("five-cornered-drum")).splitlines()
    at = next(n for n, line in enumerate(lines) if "5 periods per drum turn" in line and n > 5)
    heights = np.array(["▁▂▃▄▅▆▇█".index(bar) for bar in lines[at + 1].split()[0]])
    # The bench hides a drum with five corners.
    assert int(np.argmax(np.abs(np.fft.rfft(heights - heights.mean())))) == 5


def test_every_step_has_the_error_before_and_after_it_and_its_share() -> None:
    answer = answer_of_both("demo-elastic-rope", "demo-motor-drag")
    text = " ".join(report_text(answer, verbose=True).split())
    found = zip(answer.diagnosis.steps, falls_of(answer), strict=True)
    outputs = {"cable-elongation-linear": "cable_length", "motor-coulomb": "motor_torque"}
    for step, fall in found:
        name = outputs.pop(step.effects[0], "")
        if name:
            # One effect moves the length, the other the torque, whichever is first.
            output = answer.diagnosis.outputs[name]
            assert lowered_most(fall) == name
            assert fall[0][name] == pytest.approx(output.heldout_rms_before, rel=0.02)
            assert fall[1][name] == pytest.approx(output.heldout_rms_after, rel=0.1), (
                "a small third"
            )
            assert step.explains == pytest.approx(step.share, abs=0.02)
        told = step_text(step, answer.diagnosis.outputs, fall)
        assert "→" in told
        assert f"explains {percent(step.explains)}" in told
        assert told in text
    assert not outputs


def test_contributions_are_listed_with_verbose() -> None:
    answer = answer_of_both("demo-elastic-rope", "demo-motor-drag")
    stretch, drag = "cable-elongation-linear", "motor-coulomb"
    text = report_text(answer, verbose=True)
    rows = {line[:34].strip(): line[34:].split() for line in text.splitlines()}
    # The cable moves the length, the drag not.
    length = {label: cells[:2] for label, cells in rows.items()}
    assert length[f"only {drag}"] == length["unchanged profile"] == length[f"all but {stretch}"]
    assert length[f"only {stretch}"] == length[f"all but {drag}"] != length["unchanged profile"]


def test_errors_before_and_after_are_shown_with_the_noise() -> None:
    text = report_text(saying(diagnosis_of("explained", ELASTIC)))
    (row,) = [line for line in text.splitlines() if line.startswith("  cable length")]
    assert row.split() == ["cable", "length", "1.63", "mm", "0.360", "mm", "0.300", "mm"]
    bounds = replace(NOISY, noise_upper=0.36e-3)
    text = report_text(saying(diagnosis_of("explained", ELASTIC, outputs={"cable_length": bounds})))
    (row,) = [line for line in text.splitlines() if line.startswith("  cable length")]
    assert row.endswith("0.300 to 0.360 mm")


def test_without_steps_there_is_no_after() -> None:
    text = report_text(saying(diagnosis_of("unknown", where=FIVE_CORNERS, unexplained_share=1.0)))
    head = next(line for line in text.splitlines() if "held-out" in line)
    assert head.split()[-2:] == ["error", "noise"]
    assert "100 % of the error above the noise remains." in text.splitlines()
    line = "  motor torque, as a function of drum angle (49 % of its residual variance)"
    assert line in text.splitlines()


def test_doubts_stand_under_their_step_and_nowhere_else() -> None:
    text = report_text(saying(diagnosis_of("partly", ELASTIC, OPEN, unexplained_share=0.2)))
    lines = text.splitlines()
    first, second = (next(n for n, x in enumerate(lines) if x.startswith(f"{k}. ")) for k in (1, 2))
    assert [n for n, line in enumerate(lines) if line.startswith("   ? ")] == [
        n for n in range(second, len(lines)) if lines[n].startswith("   ? a free curve over load")
    ]
    assert first < second


def test_rivals_are_shown_with_the_run_that_separates_them() -> None:
    runs = (
        NextRun(("pulley-coulomb", "pulley-capstan"), "full stroke, twice the load", 0.93),
        NextRun(("pulley-coulomb", "pulley-capstan"), "change a wrap angle", float("nan")),
    )
    found = saying(diagnosis_of("explained", FRICTION, next_runs=runs))
    short = " ".join(report_text(found).split())
    same = "capstan friction at a pulley (pulley-capstan)"
    assert f"? these runs cannot distinguish it from {same}" in short
    assert (
        "To decide between pulley-coulomb and pulley-capstan: full stroke, twice the load" in short
    )
    long = report_text(found, verbose=True)
    assert "pulley-coulomb / pulley-capstan  0.1° between signatures" in long
    assert "change a wrap angle" in [line.rpartition(": ")[2] for line in long.splitlines()]


def test_signatures_far_apart_are_in_no_list_of_what_cannot_be_distinguished() -> None:
    apart = replace(FRICTION, angles={"pulley-capstan": np.radians(85.3)})
    text = report_text(saying(diagnosis_of("explained", apart)), verbose=True)
    assert "cannot be distinguished" not in text
    assert "85.3°" not in text


def test_a_candidate_that_lowers_no_error_is_not_shown() -> None:
    worse = {name: output.heldout_rms_before for name, output in (("cable_length", NOISY),)}
    better = {"cable_length": 0.5e-3}
    found = diagnosis_of(
        "partly",
        ELASTIC,
        outputs={"cable_length": NOISY},
        candidates=(
            CandidateScore("cell-gain", 900.0, worse),
            CandidateScore("drum-radius", 800.0, better),
            CandidateScore("gear-ratio", -2.0, {}),
        ),
    )
    assert [one.effect for one in useful_candidates(found)] == ["drum-radius"]
    text = report_text(saying(found), verbose=True)
    assert "drum-radius  800" in text
    assert "cell-gain  900" not in text


def test_offsets_of_runs_have_one_unit() -> None:
    offsets = tuple(
        RunOffset("cable_length", f"run-{n}", value, 1e-5, "m")
        for n, value in enumerate((2e-5, 3e-3))
    )
    text = report_text(saying(diagnosis_of("explained", ELASTIC, run_offsets=offsets)))
    rows = [line.split() for line in text.splitlines() if line.startswith("  run-")]
    assert [row[-1] for row in rows] == ["mm", "mm"]


def test_too_much_to_say_is_cut_and_says_so() -> None:
    notes = tuple(f"run number {n} has something about it" for n in range(90))
    found = saying(diagnosis_of("explained", ELASTIC, notes=notes))
    lines = report_text(found).splitlines()
    assert len(lines) == 29
    assert lines[-1] == "… more with --verbose"
    assert "  run number 89 has something about it" in report_text(found, verbose=True).splitlines()
    many = saying(diagnosis_of("explained", *[replace(OPEN, share=0.1)] * 9))
    lines = report_text(many).splitlines()
    counted = next(line for line in lines if line.startswith("… "))
    shown = sum(line[1:3] == ". " for line in lines)
    assert counted.startswith(f"… {9 - shown} more with --verbose: {OPEN.effects[0]}, ")
    assert any(line.startswith("To check:") for line in lines), "the next run is not cut off"
    assert 25 < len(lines) <= 29, "steps have the lines that the rest leaves"


def test_a_comparison_has_errors_and_their_attribution() -> None:
    error = OutputError(
        "m", 100, None, 2.5, 1.6e-3, 4e-3, -3e-19, None, (("load", 0.82), ("time", 0.1))
    )
    found = Comparison({"cable_length": error}, 2.39e-3, ("a note",))
    lines = compare_text(found, verbose=True).splitlines()
    assert lines[3].split()[2:] == ["1.60", "mm", "0", "mm", "4.00", "mm", "unknown", "2.50", "m"]
    assert "  cable length: load 82 % and time 10 %" in lines
    assert "offset of the length instrument, fitted: 2.39 mm" in lines
    assert lines[-1] == "  a note"


def test_a_constant_error_follows_no_variable() -> None:
    error = OutputError("N", 9, None, 150.0, 2.5, 3.0, -2.4, 0.5, (("direction", 0.94),))
    assert failing(Comparison({"tension": error}, None)) == [
        "tension: 92 % is constant; mean −2.4 N"
    ]


def test_a_comparison_says_first_how_large_the_errors_are_and_where_they_fail() -> None:
    sizes = {"cable_length": 1.6e-3, "tension": 4.0, "motor_torque": 0.1, "force": 9.0, "x": 8.0}
    errors = {
        name: OutputError(
            "N", 9, None, 150.0, rms, 9.0, bias, 0.5, (("load", 0.8),), variation=50.0
        )
        for (name, rms), bias in zip(sizes.items(), (0.0, 3.4, 0.0, 0.0, 0.0), strict=True)
    }
    lines = compare_text(Comparison(errors, None)).splitlines()
    assert lines[0] == "The force error is 18 times its noise."
    (tension,) = (line.split() for line in lines if line.startswith("  tension  "))
    assert tension == ["tension", "4.00", "N", "0.500", "N", "8.0", "%"]
    assert not any("%" in line for line in lines if line.startswith("  cable length  "))
    told = lines[lines.index(FAILS) + 1 :]
    assert told == [
        "  force: 80 % follows the load",
        "  x: 80 % follows the load",
        "  tension: 80 % follows the load; mean +3.4 N",
    ]


def test_a_comparison_of_real_runs_fits_a_terminal() -> None:
    profile = read_profile(find("profiles", "bench-spiral"))
    lines = compare_text(compare(recorded("demo-elastic-rope"), profile)).splitlines()
    assert len(lines) <= 70
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("  cable length: ") and "follows the load" in line for line in lines)


def test_a_comparison_without_outputs_has_nothing_to_follow() -> None:
    assert "variance" not in compare_text(Comparison({}, None))
    quiet = OutputError("N", 10, None, 150.0, 0.7, 2.0, 0.1, 0.7, ())
    text = compare_text(Comparison({"tension": quiet}, None), verbose=True)
    assert "  tension: no measured variable" in text


def test_an_addition_is_reported_with_value_and_gain() -> None:
    profile = read_profile(find("profiles", "bench-spiral"))
    addition = add("cable-elongation-linear", recorded("demo-elastic-rope"), profile)
    text = addition_text(replace(addition, outputs={"cable_length": NOISY}))
    (value,) = [line for line in text.splitlines() if "EA = " in line]
    assert value.startswith("  cable-elongation-linear")
    assert " ± " in value
    assert "1.63 mm" in text
    assert "0.360 mm" in text
