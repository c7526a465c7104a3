"""The Bench view on a phone: what a page with a bench opens, Stop and jogs, sizes of targets."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, opened, until

pytestmark = [pytest.mark.realtime, pytest.mark.slow, NEEDS_CHROMIUM]
SIZE = {"width": 390, "height": 667}
SMALL = """() => [...document.querySelectorAll("button, select, input, a, summary")]
    .filter((one) => one.getClientRects().length && !one.classList.contains("visually-hidden"))
    .filter((one) => Math.min(one.offsetWidth, one.offsetHeight) < 44)
    .map((one) => one.textContent || one.getAttribute("aria-label"))"""


PLACES = """(names) => names.map((name) => document.querySelector(name).getBoundingClientRect())
    .map(({ top, bottom }) => [top, bottom])"""


def test_a_page_with_a_bench_opens_it_with_stop_and_jogs_within_reach(
    browser: Any, bench: Served
) -> None:
    page, complaints = opened(browser, bench.url, viewport=SIZE)
    until(page, lambda: page.locator("#values .value").count() == 3)
    assert "#bench/" in page.url
    reach = ["#stopbar .jog:nth-child(1)", "#stopbar .jog:nth-child(2)", "#stopbar .stop"]
    for top, bottom in page.evaluate(PLACES, reach):
        assert SIZE["height"] / 2 < top <= bottom - 56
        assert bottom <= SIZE["height"]
    assert page.inner_text("#values").rstrip().endswith("drive off")
    places = page.evaluate(PLACES, ["#values", ".controls", "#drawing"])
    assert places == sorted(places), "orders follow the values"
    assert page.evaluate(SMALL) == []
    assert page.evaluate("document.documentElement.scrollWidth") == SIZE["width"]
    assert complaints == []
    page.context.close()
