"""Error over noise: ratios, order, and pages over all winches."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import pytest

from report_answers import AT_NOISE, ELASTIC, FRICTIONAL, NOISY, diagnosis_of
from report_parsed import HOSTILE, Page
from winchkit.fleet.report.comparison import shared_effects_html
from winchkit.report.figures.ladder import error_ladder, fleet_ladders
from winchkit.report.words.headline import worst_outputs
from winchkit.report.words.sentence import headline

OUTPUTS = {"tension": AT_NOISE, "cable_length": NOISY, "motor_torque": FRICTIONAL}


def test_the_ladder_has_the_ratios_and_the_worst_first() -> None:
    ladder = error_ladder(OUTPUTS, extended=True, changed="with x")
    assert ladder is not None
    rows = list(csv.DictReader(io.StringIO(ladder.table().csv())))
    assert [row["output"] for row in rows] == ["motor torque", "cable length", "tension"]
    for row, output in zip(rows, (FRICTIONAL, NOISY, AT_NOISE), strict=True):
        noise = output.noise_rms
        assert noise is not None
        for column, error in (
            ("error ÷ noise, today", output.heldout_rms_before),
            ("error ÷ noise, with x", output.heldout_rms_after),
        ):
            assert float(row[column]) == pytest.approx(error / noise, rel=1e-6)


def test_without_noise_there_is_no_ladder_and_errors_are_compared_with_signals() -> None:
    outputs = {name: replace(one, noise_rms=None) for name, one in OUTPUTS.items()}
    assert error_ladder(outputs) is None
    assert worst_outputs(outputs)[0] == "motor_torque"


def test_the_page_over_all_winches_draws_each_and_keeps_names_as_text() -> None:
    found = {"A": diagnosis_of("explained", ELASTIC), HOSTILE: diagnosis_of("adequate")}
    pages = dict.fromkeys(found, "own.html")
    page = Page(shared_effects_html(found, [], {}, "x", pages))
    assert set(page.shown) == page.figures.keys() == {"errors-cable_length", "errors-tension"}
    assert page.figures["errors-cable_length"]["words"] == ["A", HOSTILE]
    assert page.count("img") == 0
    assert page.count("script") == 2
    (first, second) = page.figures["errors-cable_length"]["columns"][2]
    assert first == pytest.approx(0.36 / 0.30)
    assert second is None, "no effect was named there"
    assert next(f.id for f in fleet_ladders(found)) == "errors-cable_length"


def test_headlines_are_short() -> None:
    assert headline(diagnosis_of("explained", ELASTIC)) == "The cable is elastic"
    assert headline(diagnosis_of("adequate")) == "No effect is missing"
    assert headline(diagnosis_of("unknown")) == "No known effect explains the cable length error"
    two = headline(diagnosis_of("explained", ELASTIC, ELASTIC))
    assert two == "2 effects are missing; first, the cable is elastic"
