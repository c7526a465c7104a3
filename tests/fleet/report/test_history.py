"""The maintenance report of a fleet as a page."""

from __future__ import annotations

import numpy as np
import pytest

from report_parsed import HOSTILE, Page
from winchkit.fleet.diagnosis.history import FleetHistory, fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate
from winchkit.fleet.report.history import fleet_history_html
from winchkit.fleet.report.text import odd_texts

WEEK = 7 * 86400.0
STD = 1e-4


def history(step: float, slope: float, name: str = "C") -> FleetHistory:
    random, known = np.random.default_rng(2), []
    for winch in ("A", "B", name, "D", "E", "F"):
        for number in range(12):
            value = 0.01 + random.normal(0.0, STD)
            value += step * (winch == name and number >= 7) + slope * number * (winch == "D")
            about = "cell-gain", "gain_error", float(value), STD, "1", (), {"tension": 150.0}
            known.append(SessionEstimate(winch, WEEK * number, *about))
    return fleet_history(known, {("cell-gain", "gain_error"): 0.05})


def test_a_row_and_a_figure_for_each_change() -> None:
    page = Page(fleet_history_html(history(0.02, 1e-3), "fleet"))
    assert "2 changes in 2 winches" in page.text
    assert page.count("figure") == 2
    drawn = [a for _, a in page.elements if "today-points" in str(a.get("class"))]
    assert drawn, "a point per session"
    assert page.count("tr") == 3, "a head and two changes"
    assert "since 1970-02-" in page.text, "a step between sessions 7 and 8"
    assert "over the sessions" in page.text
    assert "3.00" in page.text or "3 N" in page.text.replace("\u00a0", " "), "0.02 of 150 N"
    assert "calibrate the load cell" in page.text
    assert "reaches the limit of" in page.text


def test_no_change_has_no_table_and_names_stay_text() -> None:
    assert "No change over time" in Page(fleet_history_html(history(0.0, 0.0), "fleet")).text
    hostile = Page(fleet_history_html(history(0.02, 0.0, HOSTILE), HOSTILE))
    plain = Page(fleet_history_html(history(0.02, 0.0), "fleet"))
    assert hostile.count("script") == plain.count("script")


def test_a_winch_is_compared_with_the_mean_of_the_others() -> None:
    (parameter,) = history(0.02, 0.0).parameters
    winch = next(one for one in parameter.winches if one.winch == "C")
    line, _ = odd_texts(parameter, winch)
    own, others = line.partition("gain_error")[2].split(", the others ")
    assert float(own.split()[0]) == pytest.approx(3.0, abs=0.02), "per cent: 0.01 and 0.02"
    assert float(others.split()[0]) == pytest.approx(1.0, abs=0.02), "all of them have 0.01"
