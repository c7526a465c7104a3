"""The page: whole, self-contained, escaped, and saying what the diagnosis says."""

from __future__ import annotations

import json
import re
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from winchkit.report.figures.plots import plots_of

from report_answers import FRICTION, answer_of, answered, recorded
from report_parsed import HOSTILE, Page
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.report.figures.waterfall import waterfall_of
from winchkit.report.pages.pages import report_html, residuals_of
from winchkit.report.words.sentence import sentence


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
    assert sentence(answer.diagnosis) in page.text
    assert len(text.encode()) < 3_000_000
    assert page.count("h1") == 1
    assert page.count("table") == page.count("caption")
    assert page.count("script") == 3


@pytest.mark.parametrize("bench", BENCHES)
def test_the_page_asks_nothing_of_the_network(bench: str) -> None:
    page = page_of(bench)
    for tag, attributes in page.elements:
        assert tag not in {"link", "iframe", "object", "img"}
        assert not {"src", "href", "action", "srcset"} & attributes.keys()
    policy = [a["content"] for t, a in page.elements if a.get("http-equiv")]
    assert policy == ["default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"]
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|import)\s*\(", "".join(page.scripts))


def test_uplot_keeps_its_licence() -> None:
    text = report_html(answer_of("demo-adequate"), "x")
    assert "The MIT License (MIT)" in text
    assert "Copyright (c) 2022 Leon Sorokin" in text


def test_every_label_that_is_referred_to_is_there() -> None:
    page = page_of("demo-sticky-pulleys")
    ids = [a["id"] for _, a in page.elements if "id" in a]
    assert len(ids) == len(set(ids))
    referred = {a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a}
    assert referred
    assert referred <= set(ids)
    figures = [a for _, a in page.elements if "data-plot" in a]
    assert {a["data-plot"] for a in figures} == page.plots.keys()
    assert all(a["aria-label"] for a in figures)


def test_hostile_names_are_text_and_nothing_else() -> None:
    answer = answer_of("demo-adequate")
    said = replace(answer.diagnosis, notes=(HOSTILE,))
    hostile = WinchAnswer(renamed(answer.engine), answer.result, said)
    page = Page(report_html(hostile, HOSTILE, [HOSTILE], {HOSTILE: HOSTILE}, HOSTILE))
    clean = page_of("demo-adequate")
    assert page.count("script") == clean.count("script")
    assert page.count("img") == 0
    assert not any(key.startswith("on") for _, a in page.elements for key in a)
    assert page.plots["time-cable_length"]["marks"][0]["name"] == f"{HOSTILE}0"
    assert HOSTILE in "".join(page.words)


@pytest.mark.parametrize("bench", BENCHES)
def test_plots_are_short_and_aligned(bench: str) -> None:
    for plot in page_of(bench).plots.values():
        columns = [one["values"] for one in (*plot["series"], *plot.get("means", ()))]
        assert all(len(column) == len(plot["x"]) <= 2000 for column in columns)
        assert all(a <= b for a, b in zip(plot["x"], plot["x"][1:], strict=False))
        assert plot["unit"] in plot["yLabel"]


def test_the_curves_are_the_residuals_that_the_figures_speak_of() -> None:
    answer = answer_of("demo-elastic-rope")
    own = next(p for p in plots_of(residuals_of(answer)) if p.output == "cable_length")
    before, after = (
        np.array([v for v in one["values"] if v is not None]) * own.scale.worth
        for one in own.over_time.data["series"]
    )
    fit = answer.diagnosis.outputs["cable_length"]
    # Runs this short are drawn in full: only the four digits of a drawing differ.
    assert np.sqrt(np.mean(before**2)) == pytest.approx(fit.rms_before, rel=1e-3)
    assert np.sqrt(np.mean(after**2)) == pytest.approx(fit.rms_after, rel=1e-3)


def test_a_stretch_is_drawn_over_the_load() -> None:
    answer = answer_of("demo-elastic-rope")
    over = {p.output: p.over_variable for p in plots_of(residuals_of(answer))}["cable_length"]
    assert over is not None
    assert over.data["xLabel"] == "load [N]"
    x = np.array(over.data["x"])
    slopes = []
    for one in over.data["means"]:
        known = np.array([v is not None for v in one["values"]])
        means = np.array([v for v in one["values"] if v is not None])
        slopes.append(np.polyfit(x[known], means, 1)[0])
    assert slopes[0] > 0, "an elastic cable is longer under more load"
    assert abs(slopes[1]) < 0.2 * slopes[0]


def test_five_corners_are_drawn_within_a_turn() -> None:
    over = {
        p.output: p.over_variable for p in plots_of(residuals_of(answer_of("five-cornered-drum")))
    }["tension"]
    assert over is not None
    means = over.data["means"][0]["values"]
    angle = np.radians([x for x, v in zip(over.data["x"], means, strict=True) if v is not None])
    value = np.array([v for v in means if v is not None])
    power = [abs(np.mean(value * np.exp(-1j * order * angle))) for order in range(1, 9)]
    assert int(np.argmax(power)) + 1 == 5


def test_nothing_named_draws_nothing_after_and_no_ladder() -> None:
    answer = answer_of("five-cornered-drum")
    assert waterfall_of(answer) is None
    page = page_of("five-cornered-drum")
    names = {one["name"] for plot in page.plots.values() for one in plot["series"]}
    assert names == {"residual"}
    assert "Contribution of each effect" not in page.text
    assert "Unexplained residual" in page.text


def test_the_ladder_begins_and_ends_at_the_figures() -> None:
    answer = answer_of("demo-elastic-rope")
    ladder = waterfall_of(answer)
    assert ladder is not None
    fit = answer.diagnosis.outputs["cable_length"]
    errors = [rung["cable_length"] for _, rung in ladder.rungs]
    assert (errors[0], errors[-1]) == (fit.heldout_rms_before, fit.heldout_rms_after)
    ((name, alone),) = ladder.first.items()
    assert name == "cable-elongation-linear"
    assert alone["cable_length"] == fit.heldout_rms_after
    assert ladder.last[name]["cable_length"] == fit.heldout_rms_before


def test_a_confusion_set_is_reported_with_angles() -> None:
    answer = answer_of("demo-elastic-rope")
    said = replace(answer.diagnosis, steps=(FRICTION,))
    page = Page(report_html(WinchAnswer(answer.engine, answer.result, said), "x"))
    assert "Effects that cannot be distinguished with these runs" in page.text
    assert "0.1°" in page.text


def test_without_repeats_the_page_says_what_cannot_be_excluded() -> None:
    first = [run for run in recorded("demo-adequate") if run.name.endswith("-1")]
    answer = answered(first)
    assert {o.noise_source for o in answer.diagnosis.outputs.values()} == {"saturated fit"}
    page = Page(report_html(answer, "x"))
    assert "an unknown effect cannot be excluded without repeats" in page.text


def test_partly_without_a_name_shows_what_is_left() -> None:
    real = answer_of("five-cornered-drum")
    said = replace(real.diagnosis, verdict="partly", unexplained_share=0.31)
    page = Page(report_html(WinchAnswer(real.engine, real.result, said), "x"))
    assert "Partly explained" in page.text
    assert "31 % of the residual variance above the noise floor remains" in page.text


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
    said = replace(real.diagnosis, steps=(*real.diagnosis.steps, FRICTION))
    text = Page(report_html(WinchAnswer(real.engine, real.result, said), "x", profile="p")).text
    assert "winchkit add cable-elongation-linear --profile p --fit" in text
    assert "winchkit add pulley-coulomb --profile better-1.toml --fit" in text
    assert "-o better-2.toml" in text


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
    own = next(p for p in plots_of(residuals_of(answer)) if p.output == "cable_length")
    assert None in own.over_time.data["series"][0]["values"]
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
    assert all(len(plot["x"]) <= 2000 for plot in Page(text).plots.values())
    assert len(text.encode()) < 600_000
