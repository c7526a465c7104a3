"""The ledger as a page, and the words of intervals."""

from __future__ import annotations

import re
from datetime import date

import pytest
from hypothesis import given
from hypothesis import strategies as st

from report_parsed import HOSTILE, Page
from winchkit.diagnosis.results import Estimate
from winchkit.profile_edit.history import HistoryStep
from winchkit.quantity_text import between, plain
from winchkit.report.pages.history import ladder_html
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
    page = Page(ladder_html("p", GROWN))
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
    page = Page(ladder_html(HOSTILE, ()))
    assert "No effect was added" in page.text
    assert page.count("script") == 0


def test_a_step_that_was_not_judged_has_a_dash() -> None:
    bare = HistoryStep("remove", "mine", date(2026, 11, 3))
    page = Page(ladder_html("p", (*GROWN, bare)))
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
