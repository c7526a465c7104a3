"""The page: whole, self-contained, escaped, and saying what the diagnosis says."""

from __future__ import annotations

import csv
import io
import json
import re
import xml.etree.ElementTree as ET
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from report_answers import FRICTION, OPEN, answer_of, answered, recorded
from report_parsed import HOSTILE, Page
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.report.figures.residuals import residual_figures
from winchkit.report.figures.unexplained import open_law_figures
from winchkit.report.figures.waterfall import waterfall_of
from winchkit.report.html.svg import file_svg
from winchkit.report.pages.pages import report_figures, report_html, residuals_of
from winchkit.report.words.headline import noise_text, worst_outputs
from winchkit.report.words.sentence import capital, error_text, headline, remaining_text
from winchkit.report.words.steps import doubt_texts
from winchkit.report.words.vocabulary import VERDICT_NAMES


def renamed(engine: TimeSeriesSelection) -> TimeSeriesSelection:
    """The same inquiry into runs with hostile names."""
    out, regression = copy(engine), copy(engine.regression)
    recordings = [
        replace(r, name=f"{HOSTILE}{n}", path=HOSTILE, programme=HOSTILE)
        for n, r in enumerate(regression.dataset.recordings)
    ]
    regression.dataset = replace(regression.dataset, recordings=tuple(recordings))
    out.regression = regression
    return out


def page_of(bench: str) -> Page:
    return Page(report_html(answer_of(bench), bench))


BENCHES = ["demo-elastic-rope", "demo-adequate", "five-cornered-drum", "demo-sticky-pulleys"]


@pytest.mark.parametrize("bench", BENCHES)
def test_the_page_is_whole_and_says_the_verdict(bench: str) -> None:
    answer = answer_of(bench)
    text = report_html(answer, bench)
    page = Page(text)
    assert headline(answer.diagnosis) in page.text
    assert error_text(answer.diagnosis) in page.text
    assert remaining_text(answer.diagnosis) in page.text
    for step in answer.diagnosis.steps:
        assert all(capital(doubt) in page.text for doubt in doubt_texts(step))
    assert len(text.encode()) < 1_000_000
    page.require_whole()


@pytest.mark.parametrize("bench", BENCHES)
def test_the_page_asks_nothing_of_the_network(bench: str) -> None:
    page = page_of(bench)
    policy = [a["content"] for t, a in page.elements if a.get("http-equiv")]
    assert policy == [
        "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src blob:"
    ]
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|import)\s*\(", "".join(page.scripts))


def test_every_label_that_is_referred_to_is_there() -> None:
    page = page_of("demo-sticky-pulleys")
    ids = [a["id"] for _, a in page.elements if "id" in a]
    referred = {a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a}
    assert referred
    assert referred <= set(ids)
    drawn = [a for tag, a in page.elements if tag == "svg" and "role" in a]
    assert len(drawn) == 2 * len(page.shown), "wide and narrow"
    assert all(a["aria-label"] for a in drawn)
    used = {str(a["href"]).removeprefix("#") for tag, a in page.elements if tag == "use"}
    assert used <= set(ids)


def test_hostile_names_are_text_and_nothing_else() -> None:
    answer = answer_of("demo-adequate")
    said = replace(answer.diagnosis, notes=(HOSTILE,))
    hostile = WinchAnswer(renamed(answer.engine), answer.result, said)
    page = Page(report_html(hostile, HOSTILE, [HOSTILE], {HOSTILE: HOSTILE}, HOSTILE))
    clean = page_of("demo-adequate")
    assert page.count("script") == clean.count("script")
    assert page.count("img") == 0
    assert not any(key.startswith("on") for _, a in page.elements for key in a)
    assert page.figures["time-cable_length"]["words"][0] == f"{HOSTILE}0"
    assert HOSTILE in "".join(page.words)


@pytest.mark.parametrize("bench", BENCHES)
def test_figures_are_short_and_the_worst_output_is_first(bench: str) -> None:
    page = page_of(bench)
    for table in page.figures.values():
        assert len({len(column) for column in table["columns"]}) == 1
        assert len(table["columns"][0]) <= 3000
    ordered = [n.removeprefix("time-") for n in page.shown if n.startswith("time-")]
    outputs = answer_of(bench).diagnosis.outputs
    assert ordered == worst_outputs(outputs)
    ratios = [outputs[n].heldout_rms_before / (outputs[n].noise_rms or 1) for n in ordered]
    assert ratios == sorted(ratios, reverse=True)


@pytest.mark.parametrize("bench", BENCHES)
def test_every_figure_has_buttons_for_its_files(bench: str) -> None:
    page = page_of(bench)
    kinds = [a["data-save"] for _, a in page.elements if "data-save" in a]
    assert kinds == ["png", "svg", "csv"] * len(page.shown)
    zoomed = [n for n in page.shown if n.startswith("time-")]
    zooms = [a for _, a in page.elements if "data-zoom" in a]
    assert [a["data-zoom"] for a in zooms] == ["in", "out", "left", "right", "reset"] * len(zoomed)
    assert all(a["aria-label"] for a in zooms)


def test_every_figure_of_the_page_is_exported_with_the_same_data() -> None:
    answer = answer_of("five-cornered-drum")
    figures, page = report_figures(answer), page_of("five-cornered-drum")
    assert sorted(f.id for f in figures) == sorted(page.shown)
    for figure in figures:
        table = figure.table()
        assert page.figures[figure.id]["columns"] == [list(c) for c in table.columns]
        rows = list(csv.reader(io.StringIO(table.csv())))
        assert rows[0] == list(table.head)
        assert len(rows) == 1 + len(table.columns[0])
        ET.fromstring(file_svg(figure))


def test_the_curves_are_the_residuals_that_the_figures_speak_of() -> None:
    answer = answer_of("demo-elastic-rope")
    own = next(p for p in residual_figures(residuals_of(answer)) if p.output == "cable_length")
    signals, errors = own.over_time.panels
    fit = answer.diagnosis.outputs["cable_length"]
    # Runs this short are drawn in full.
    for series, rms in zip(errors.series, (fit.rms_before, fit.rms_after), strict=True):
        known = series.y[np.isfinite(series.y)] * own.scale.worth
        assert np.sqrt(np.mean(known**2)) == pytest.approx(rms, rel=1e-6)
    measured, today, grown = (series.y for series in signals.series)
    assert errors.band == pytest.approx((fit.noise_rms or 0) / own.scale.worth)
    assert own.scale.label == "mm"
    assert 1e3 * (measured - today) == pytest.approx(errors.series[0].y, nan_ok=True)
    assert 1e3 * (measured - grown) == pytest.approx(errors.series[1].y, nan_ok=True)


def test_the_measured_curve_is_the_recording() -> None:
    answer = answer_of("demo-elastic-rope")
    own = next(p for p in residual_figures(residuals_of(answer)) if p.output == "cable_length")
    series = own.over_time.panels[0].series[0]
    runs = {run.name: run for run in recorded("demo-elastic-rope")}
    starts = [mark.at for mark in own.over_time.marks]
    for number, mark in enumerate(own.over_time.marks):
        inside = np.searchsorted(starts, series.x, side="right") - 1 == number
        run = runs[mark.run]
        values = np.interp(
            series.x[inside] - mark.at + run.time[0], run.time, run.channels["cable_length"].values
        )
        assert series.y[inside] == pytest.approx(values, abs=1e-9, nan_ok=True)
    labels = [mark.label for mark in own.over_time.marks if mark.label]
    assert labels == ["demo 10 kg", "demo 20 kg"], "repeats share a label"


def test_a_stretch_is_drawn_over_the_load() -> None:
    answer = answer_of("demo-elastic-rope")
    figures = residual_figures(residuals_of(answer))
    over = {p.output: p.over_variable for p in figures}["cable_length"]
    assert over.x.label == "load [N]"
    slopes = []
    for one in over.panels[0].series:
        if one.mark == "mean":
            known = np.isfinite(one.y)
            slopes.append(np.polyfit(one.x[known], one.y[known], 1)[0])
            assert not known.all(), "no mean between the loads, where no sample lies"
    assert slopes[0] > 0, "an elastic cable is longer under more load"
    assert abs(slopes[1]) < 0.2 * slopes[0]


def test_five_corners_are_drawn_within_a_turn() -> None:
    figures = residual_figures(residuals_of(answer_of("five-cornered-drum")))
    over = {p.output: p.over_variable for p in figures}["tension"]
    mean = next(one for one in over.panels[0].series if one.mark == "mean")
    angle = np.radians(mean.x)
    power = [abs(np.mean(mean.y * np.exp(-1j * order * angle))) for order in range(1, 9)]
    assert int(np.argmax(power)) + 1 == 5


def test_no_step_draws_nothing_after_and_no_waterfall() -> None:
    answer = answer_of("five-cornered-drum")
    assert waterfall_of(answer) is None
    page = page_of("five-cornered-drum")
    heads = {head for n, t in page.figures.items() if n.startswith("time-") for head in t["head"]}
    assert not any("with" in head for head in heads)
    assert "Contribution of each effect" not in page.text
    assert "Unexplained residual" in page.text


def test_the_waterfall_begins_and_ends_at_the_figures() -> None:
    answer = answer_of("demo-elastic-rope")
    waterfall = waterfall_of(answer)
    assert waterfall is not None
    fit = answer.diagnosis.outputs["cable_length"]
    errors = [step["cable_length"] for _, step in waterfall.steps]
    assert (errors[0], errors[-1]) == (fit.heldout_rms_before, fit.heldout_rms_after)
    ((name, alone),) = waterfall.first.items()
    assert name == "cable-elongation-linear"
    assert alone["cable_length"] == fit.heldout_rms_after
    assert waterfall.last[name]["cable_length"] == fit.heldout_rms_before


def test_a_confusion_set_is_reported_with_angles() -> None:
    answer = answer_of("demo-elastic-rope")
    said = replace(answer.diagnosis, steps=(FRICTION,))
    page = Page(report_html(WinchAnswer(answer.engine, answer.result, said), "x"))
    assert "Effects that cannot be distinguished with these runs" in page.text
    assert "0.1°" in page.text


def test_without_repeats_the_noise_has_two_bounds() -> None:
    first = [run for run in recorded("demo-adequate") if run.name.endswith("-1")]
    answer = answered(first)
    assert {o.noise_source for o in answer.diagnosis.outputs.values()} == {"white noise"}
    page = Page(report_html(answer, "x"))
    for output in answer.diagnosis.outputs.values():
        assert noise_text(output).removeprefix("noise ") in page.text
    assert "≤ " in page.text, "a ratio to the lower bound is the largest one"


@pytest.mark.parametrize("verdict", ["partly", "unknown", "undecided"])
def test_what_remains_is_shown_with_its_icon(verdict: str) -> None:
    real = answer_of("five-cornered-drum")
    said = replace(real.diagnosis, verdict=verdict, steps=(OPEN,), unexplained_share=0.61)  # type: ignore[arg-type]
    page = Page(report_html(WinchAnswer(real.engine, real.result, said), "x"))
    assert VERDICT_NAMES[verdict] in page.text
    assert "61 % of the error above the noise remains" in page.text
    assert any(a.get("class") == f"verdict {verdict}" for _, a in page.elements)


def test_an_open_law_is_drawn_beside_its_curve() -> None:
    real = answer_of("demo-elastic-rope")
    (step,) = real.diagnosis.steps
    said = replace(real.diagnosis, steps=(replace(OPEN, effects=step.effects),))
    answer = WinchAnswer(real.engine, real.result, said)
    (figure,) = open_law_figures(answer)
    curve, law = figure.panels[0].series
    # The effect explains nearly all of it: the closest law is the curve.
    assert np.corrcoef(curve.y, law.y)[0, 1] > 0.99
    assert np.ptp(law.y) == pytest.approx(np.ptp(curve.y), rel=0.05)
    page = Page(report_html(answer, "x"))
    assert figure.id in page.shown
    assert "Open laws: the curve and the closest law" in page.text
    assert open_law_figures(real) == []


def test_story_truth_and_commands_are_reported() -> None:
    page = Page(
        report_html(
            answer_of("demo-elastic-rope"),
            "A bench",
            story=["The bench was started."],
            truth={"hidden": "elastic rope"},
            profile="my profile.toml",
        )
    )
    assert "The bench was started." in page.text
    assert page.text.index("elastic rope") > page.text.index("Candidate effects")
    assert "--profile 'my profile.toml' --html report.html" in page.text
    assert "winchkit add cable-elongation-linear" in page.text


def test_several_effects_are_added_one_after_another() -> None:
    real = answer_of("demo-elastic-rope")
    said = replace(real.diagnosis, steps=(*real.diagnosis.steps, replace(FRICTION, share=0.01)))
    text = Page(report_html(WinchAnswer(real.engine, real.result, said), "x", profile="p")).text
    assert "winchkit add cable-elongation-linear --profile p --fit" in text
    assert "winchkit add pulley-coulomb --profile p-cable-elongation-linear.toml --fit" in text
    assert "-o p-cable-elongation-linear-pulley-coulomb.toml" in text


def test_the_raw_diagnosis_is_there_as_json() -> None:
    answer = answer_of("demo-adequate")
    page = page_of("demo-adequate")
    raw = next(word for word in page.words if word.startswith("{"))
    read = json.loads(raw)
    assert read["verdict"] == "adequate"
    noise = answer.diagnosis.outputs["tension"].noise_rms
    assert read["outputs"]["tension"]["noise_rms"] == pytest.approx(noise)


def test_a_gap_in_a_run_is_drawn_as_a_gap() -> None:
    runs = list(recorded("demo-adequate"))
    length = runs[0].channels["cable_length"]
    values = length.values.copy()
    values[200:260] = np.nan
    broken = {**runs[0].channels, "cable_length": replace(length, values=values)}
    runs[0] = replace(runs[0], channels=broken)
    answer = answered(runs)
    own = next(p for p in residual_figures(residuals_of(answer)) if p.output == "cable_length")
    assert int(np.isnan(own.over_time.panels[0].series[0].y).sum()) >= 60
    assert "NaN samples not compared: cable_length 60" in Page(report_html(answer, "x")).text


def test_long_runs_are_made_short() -> None:
    runs = []
    for run in recorded("demo-adequate")[:2]:
        fine = np.linspace(run.time[0], run.time[-1], 3000)
        channels = {
            name: replace(c, values=np.interp(fine, run.time, c.values))
            for name, c in run.channels.items()
        }
        runs.append(replace(run, time=fine, channels=channels))
    text = report_html(answered(runs), "x")
    tables = Page(text).figures.values()
    assert all(len(table["columns"][0]) <= 2500 for table in tables)
    assert len(text.encode()) < 1_000_000, "the limit that docs/figures.md states"
