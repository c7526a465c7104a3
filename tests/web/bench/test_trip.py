"""A tension trip that a held jog causes, on the page: its words, the last two seconds, its file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, opened, texts, until
from snippets import ROOT
from winchkit.runs.read import read_run

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]

HIGH = 106.0
"""Limit of the tension, N: 10 kg at rest are 98 N, and the jog's ramp of 1.5 m/s² adds 15 N."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    text = (ROOT / "sim/demo-adequate.toml").read_text(encoding="utf-8")
    for old, new in (
        ('tension_high = "400 N"', f'tension_high = "{HIGH:g} N"'),
        ('channel = "spiral-bench"', 'channel = "trip-bench"'),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "tight.toml").write_text(text, encoding="utf-8")
    found = Served("--sim", str(tmp_path / "tight.toml"), folder=tmp_path)
    yield found
    found.end()


def test_a_jog_that_trips_the_tension_is_reported_and_its_last_seconds_are_saved(
    browser: Any, served: Served, tmp_path: Path
) -> None:
    page, complaints = opened(browser, f"{served.url}#bench", accept_downloads=True)
    until(page, lambda: page.locator("#values .value").count() == 3)
    page.click("#take")
    until(page, lambda: "You command" in page.inner_text("#role"))
    page.wait_for_timeout(2500)  # the history before the trip
    page.locator(".controls .jog").first.hover(position={"x": 20, "y": 20})
    page.mouse.down()
    until(page, lambda: page.locator("#trips .trip").count() == 1, 20.0)
    page.mouse.up()
    words = page.inner_text("#trips .trip")
    assert "tension" in words.lower()
    assert f"{HIGH:g} N" in words
    assert page.locator(".controls .jog").first.is_disabled()
    # The answer to the jog has the words too, until the next picture of the bench has the trip.
    until(page, lambda: "tension" not in page.inner_text("#banner"), 2.0)
    until(page, lambda: page.locator("#save-trip").count() == 1, 10.0)
    chart = page.locator("svg[aria-label^='Winch A: two seconds before the trip']")
    until(page, lambda: chart.count() == 1, 10.0)
    assert chart.locator("path").count() >= 3, "tension, and the speed commanded and measured"
    assert any("tension" in event.lower() for event in texts(page, "table.events tr.cause"))
    with page.expect_download() as saved:
        page.click("#save-trip")
    assert saved.value.suggested_filename.startswith("trip-")
    path = tmp_path / saved.value.suggested_filename
    saved.value.save_as(path)
    run = read_run(path)
    assert run.time[0] == pytest.approx(-2.0, abs=0.05)
    assert run.time[-1] == pytest.approx(0.5, abs=0.05)
    before = run.time < -0.5
    tension = run["A.tension"]
    assert np.nanmean(tension[before]) == pytest.approx(98.07, abs=2.0), "10 kg at rest"
    assert np.nanmax(tension) > HIGH
    assert run.metadata["tripped"] in words or "tension" in run.metadata["tripped"]
    page.screenshot(path=tmp_path / "trip.png", full_page=True)
    page.keyboard.press("r")
    assert "Nothing moves before a new command" in page.inner_text("#dialog")
    page.keyboard.press("Enter")
    until(page, lambda: page.locator("#trips .trip").count() == 0, 10.0)
    assert page.locator(".controls .jog").first.is_enabled()
    assert complaints == []
    page.context.close()
