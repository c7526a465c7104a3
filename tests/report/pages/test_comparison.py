"""The page of a comparison: one state only, in plain sentences, whole and escaped."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from report_answers import recorded
from report_parsed import HOSTILE, Page
from winchkit.catalog import find
from winchkit.diagnosis.compare import Compared, compare, compared
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import OutputError
from winchkit.report.figures.residuals import Residuals, residual_figures
from winchkit.report.pages.comparison import distance_text
from winchkit.report.pages.pages import comparison_html
from winchkit.schema.read import read_profile

STRETCHED = OutputError("m", 100, None, 2.5, 1.6e-3, 4e-3, 0.0, 0.4e-3, (("load", 0.82),))


@cache
def held_against(bench: str) -> Compared:
    return compared(recorded(bench), read_profile(find("profiles", "bench-spiral")))


def page_of(bench: str) -> Page:
    return Page(comparison_html(held_against(bench), bench, "my profile.toml"))


def outputs_drawn(page: Page, kind: str) -> set[str]:
    return {name.removeprefix(kind) for name in page.figures if name.startswith(kind)}


def test_the_page_belongs_to_the_figures_of_the_comparison() -> None:
    known = held_against("demo-elastic-rope")
    profile = read_profile(find("profiles", "bench-spiral"))
    assert known.comparison == compare(recorded("demo-elastic-rope"), profile)
    raw = next(w for w in page_of("demo-elastic-rope").words if w.startswith("{"))
    assert json.loads(raw) == json.loads(json.dumps(known.comparison.to_json()))


@pytest.mark.parametrize("bench", ["demo-elastic-rope", "five-cornered-drum"])
def test_the_page_is_whole_and_needs_nothing_else(bench: str) -> None:
    page_of(bench).require_whole()


def test_only_the_present_state_is_drawn() -> None:
    page = page_of("demo-elastic-rope")
    heads = page.figures["time-cable_length"]["head"]
    assert heads == ["run", "time [s]", "measured [m]", "predicted [m]", "residual [mm]"]
    assert outputs_drawn(page, "time-") == {"cable_length", "tension", "motor_torque"}
    assert "load [N]" in page.figures["over-cable_length"]["head"]


def test_the_curves_are_the_residual_of_the_figures() -> None:
    known = held_against("demo-elastic-rope")
    figures = residual_figures(Residuals(known.regression, known.residual, None, {}))
    for own in figures:
        (line,) = own.over_time.panels[1].series
        values = line.y[np.isfinite(line.y)] * own.scale.worth
        error = known.comparison.outputs[own.output]
        assert np.abs(values).max() == pytest.approx(error.max, rel=1e-3)
        assert error.rms <= 1.001 * np.sqrt(np.mean(values**2))


def test_every_output_gets_its_sentence_and_the_offset_is_reported() -> None:
    known = held_against("demo-elastic-rope").comparison
    text = page_of("demo-elastic-rope").text
    assert "Above the noise" in text
    for name in ("cable length", "tension", "motor torque"):
        assert f"The error of the {name} is" in text
    assert "it depends on load (" in text
    assert known.offset is not None
    assert f"fitted: {1000 * known.offset:.2f} mm." in text


def test_a_true_profile_is_at_the_noise() -> None:
    text = page_of("demo-adequate").text
    assert "At the noise" in text
    assert "times its noise" not in text


def test_without_repeats_the_noise_is_not_invented() -> None:
    first = [run for run in recorded("demo-adequate") if run.name.endswith("-1")]
    known = compared(first, read_profile(find("profiles", "bench-spiral")))
    page = Page(comparison_html(known, "x"))
    assert "Noise unknown" in page.text
    assert "its noise is unknown without repeats" in page.text
    assert "band: noise floor" not in page.text
    assert "errors" not in page.figures


@pytest.mark.parametrize(
    ("error", "over", "text"),
    [
        (
            STRETCHED,
            Attribution("cable_length", "load", 0.82),
            "The error of the cable length is 1.60 mm rms, 4.0 times its noise of 0.400 mm; "
            "it depends on load (82 % of its variance).",
        ),
        (
            STRETCHED,
            Attribution("cable_length", "drum_angle", 0.5, order=5),
            "The error of the cable length is 1.60 mm rms, 4.0 times its noise of 0.400 mm; "
            "it has 5 periods per drum turn (50 % of its variance).",
        ),
        (
            replace(STRETCHED, noise_rms=1.5e-3),
            Attribution("cable_length", "load", 0.82),
            "The error of the cable length is 1.60 mm rms, about its noise of 1.50 mm.",
        ),
        (
            replace(STRETCHED, noise_rms=None),
            None,
            "The error of the cable length is 1.60 mm rms; its noise is unknown without repeats; "
            "no measured variable explains it.",
        ),
        (
            replace(STRETCHED, noise_rms=0.0),
            None,
            "The error of the cable length is 1.60 mm rms, with its noise of 0 m; "
            "no measured variable explains it.",
        ),
    ],
)
def test_the_error_in_words(error: OutputError, over: Attribution | None, text: str) -> None:
    assert distance_text("cable_length", error, over) == text


def test_the_commands_repeat_what_was_given_and_go_on() -> None:
    options = ("--effects", "my effects.py", "--band", "10")
    page = Page(comparison_html(held_against("demo-adequate"), "x", "p.toml", options=options))
    given = "--profile p.toml --effects 'my effects.py' --band 10"
    runs = " ".join(run.path or run.name for run in recorded("demo-adequate"))
    assert f"winchkit compare {runs} {given}" in page.text
    assert f"{given} --html report.html" in page.text


def test_hostile_names_stay_text() -> None:
    known = held_against("demo-adequate")
    said = replace(known, comparison=replace(known.comparison, notes=(HOSTILE,)))
    page = Page(comparison_html(said, HOSTILE, HOSTILE, options=(HOSTILE,)))
    assert page.count("script") == 2
    assert page.count("img") == 0
    assert not any(key.startswith("on") for _, a in page.elements for key in a)
    assert HOSTILE in "".join(page.words)


def test_an_order_within_a_turn_is_reported_without_a_trend() -> None:
    known = held_against("five-cornered-drum").comparison
    text = page_of("five-cornered-drum").text
    assert known.outputs["tension"].follows == ()
    assert "it has 5 periods per drum turn" in text
    assert "no measured variable" not in text
