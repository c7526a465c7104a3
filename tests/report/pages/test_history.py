"""Pages beside those of runs: the effects with their signatures, and the ledger."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from report_parsed import HOSTILE, Page
from winchkit.cli.model.effects import command
from winchkit.diagnosis.results import Estimate
from winchkit.effects.card import signature
from winchkit.effects.catalogue import load_catalogue
from winchkit.profile_edit.history import HistoryStep
from winchkit.quantity_text import between, plain
from winchkit.report.html.markup import formula
from winchkit.report.pages.effects import effects_html
from winchkit.report.pages.history import history_html
from winchkit.report.words.vocabulary import interval_text

RUNS = ("a.csv", "b.csv")
NOISE = {"tension": 0.8}
GROWN = (
    HistoryStep(
        "add", "pulley-coulomb", date(2026, 11, 1), RUNS, {"tension": 4.0}, {"tension": 1}, NOISE
    ),
    HistoryStep("add", "mine", date(2026, 11, 2), RUNS, {"tension": 1.0}, {"tension": 0.8}, NOISE),
)


def test_every_step_has_a_bar_as_long_as_its_error() -> None:
    page = Page(history_html("p", GROWN))
    widths = [
        float(match[1])
        for _, a in page.elements
        if a.get("class") == "fill" and (match := re.match(r"width:([\d.]+)%", str(a["style"])))
    ]
    # Before, and after each of the two steps: 4 N, 1 N, 0.8 N.
    assert [w / widths[0] for w in widths] == pytest.approx([1.0, 0.25, 0.2], abs=0.002)
    assert "the pulleys have Coulomb friction" in page.text
    assert "on 2 runs" in page.text
    assert page.count("script") == 0


def test_an_empty_ledger_says_so_and_names_stay_text() -> None:
    page = Page(history_html(HOSTILE, ()))
    assert "No effect was added" in page.text
    assert page.count("script") == 0


def test_a_step_that_was_not_judged_has_a_dash() -> None:
    bare = HistoryStep("remove", "mine", date(2026, 11, 3))
    page = Page(history_html("p", (*GROWN, bare)))
    assert page.text.rstrip().endswith("–")
    assert "− mine" in page.text


def test_an_interval_is_reported_to_the_digits_that_it_has() -> None:
    told = interval_text("axial_stiffness", Estimate(247.4e3, 6.1e3, "N", (236e3, 259e3)))
    assert told == "95 %: 236 to 259 kN"
    assert interval_text("axial_stiffness", Estimate(1.0, 1.0, "N")) == ""
    assert interval_text("axial_stiffness", Estimate(1.0, 1.0, "N", (0.0, float("inf")))) == ""


@given(st.floats(1e-3, 1e3), st.floats(1e-5, 1.0))
def test_two_ends_stay_apart(low: float, share: float) -> None:
    high = low * (1 + share)
    text = between(low, high, "unitless")
    shown = [float(end) for end in text.removesuffix(" unitless").split(" to ")]
    assert shown[1] - shown[0] == pytest.approx(high - low, rel=0.12)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.02, "0.02"), (2000.0, "2000"), (-0.5, "−0.5"), (0.0, "0"), (1e-5, "0.00001")],
)
def test_a_chosen_number_keeps_its_digits(value: float, text: str) -> None:
    assert plain(value) == text


CATALOGUE = load_catalogue()
EFFECTS = tuple(CATALOGUE)


@pytest.fixture(scope="module")
def whole() -> Page:
    return Page(effects_html(EFFECTS, "all"))


def test_every_effect_has_its_section_and_its_link(whole: Page) -> None:
    ids = [a["id"] for tag, a in whole.elements if tag == "section"]
    links = [a["href"] for tag, a in whole.elements if tag == "a"]
    assert set(ids) == {e.id for e in EFFECTS} | {"contents"}
    assert sorted(str(link) for link in links) == sorted(f"#{e.id}" for e in EFFECTS)


def test_every_card_says_everything(whole: Page) -> None:
    for effect in EFFECTS:
        for words in (effect.what, effect.source, effect.looks_like):
            assert " ".join(words.split()) in whole.text
        assert " ".join(effect.formula.replace("_", "").split()) in whole.text
        assert effect.told_apart in whole.text


def test_indices_of_a_formula_are_subscripts() -> None:
    assert formula("F_c = μ N < F") == ('<span class="formula">F<sub>c</sub> = μ N &lt; F</span>')


def test_every_output_that_changes_is_drawn(whole: Page) -> None:
    drawn = sum(1 + len(signature(e).changes) for e in EFFECTS)
    assert len(whole.shown) == len(whole.figures) == drawn
    assert whole.count("script") == 2


def test_a_picture_is_the_signature() -> None:
    effect = CATALOGUE["motor-viscous"]
    page = Page(effects_html([effect], effect.id))
    time, change = (
        np.array(page.column("signature-motor-viscous-motor_torque", name), dtype=float)
        for name in ("time", "change")
    )
    drawn = signature(effect)
    assert change == pytest.approx(
        np.interp(time, drawn.time, drawn.changes["motor_torque"]), rel=1e-5, abs=1e-9
    )
    assert np.ptp(change) == pytest.approx(np.ptp(drawn.changes["motor_torque"]), rel=1e-5)
    assert "change [N m]" in page.text


def test_the_command_writes_the_page(tmp_path: Path) -> None:
    for words in ([], ["cable-sag"]):
        path = tmp_path / f"page{len(words)}.html"
        result = CliRunner().invoke(command, [*words, "--html", str(path)])
        assert result.exit_code == 0
        assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert (tmp_path / "page1.html").stat().st_size < 120_000
