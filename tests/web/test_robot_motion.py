"""Steps of a robot's platform that a page starts; in a module of its own, without other benches.

The simulated robot, its control and the page's server share a core.
"""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, number, opened, until

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]


def test_a_step_of_the_platform_from_the_robot_view(browser: Any, robot: Served) -> None:
    page, complaints = opened(browser, f"{robot.url}#robot")

    def height() -> float:
        return number(page.inner_text("#position .value >> nth=2"))

    until(page, lambda: page.locator("#position .value").count() == 3)
    assert page.locator("[aria-label='z +10 mm']").is_disabled(), "it only watches"
    page.click("#take")
    until(page, lambda: page.locator("[aria-label='z +10 mm']").is_enabled())
    before = height()
    page.click("[aria-label='z +10 mm']")
    until(page, lambda: abs(height() - before - 10.0) < 1.0, 10.0)
    assert page.inner_text("#banner") == ""
    assert complaints == []
    page.context.close()


def test_four_cables_have_no_steps_and_say_why(browser: Any, hanging_robot: Served) -> None:
    page, complaints = opened(browser, f"{hanging_robot.url}#robot")
    until(page, lambda: page.locator("#position .value").count() == 3)
    assert page.locator("[aria-label='z +10 mm']").count() == 0
    assert "at least 6" in page.inner_text("#platform")
    assert complaints == []
    page.context.close()
