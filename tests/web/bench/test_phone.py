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


def test_a_page_with_a_bench_opens_it_with_stop_and_jogs_within_reach(
    browser: Any, bench: Served
) -> None:
    page, complaints = opened(browser, bench.url, viewport=SIZE)
    until(page, lambda: page.locator("#values .value").count() == 3)
    assert "#bench/" in page.url
    reach = [page.locator("#stopbar .jog").nth(i) for i in (0, 1)]
    for node in (*reach, page.locator("#stopbar .stop")):
        box = node.bounding_box()
        assert box["y"] > SIZE["height"] / 2
        assert box["y"] + box["height"] <= SIZE["height"]
        assert box["height"] >= 56
    assert page.inner_text("#values").rstrip().endswith("drive off")
    values, orders, winch = (
        page.locator(selector).bounding_box()["y"]
        for selector in ("#values", ".controls", "#drawing")
    )
    assert values < orders < winch
    assert page.evaluate(SMALL) == []
    assert page.evaluate("document.documentElement.scrollWidth") == SIZE["width"]
    assert complaints == []
    page.context.close()
