"""A simulated bench that a page moves: however a held jog ends, the winch stops."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, STARTS, Served, opened, until

STOPS = 2.0
"""Bound for a jog to end after its release, s: dead-man 0.2 s, ramp 0.05 / 1 s, pictures 0.1 s,
and stalls of this computer."""
MOVING = {"winding in", "paying out"}
REFUSED = "the browser was too slow"

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]


def commanding(browser: Any, url: str) -> Any:
    """A page of the Bench view that commands."""
    page, _ = opened(browser, f"{url}#bench")
    until(page, lambda: page.locator("#values .value").count() == 3)
    page.click("#take")
    until(page, lambda: "You command" in page.inner_text("#role"))
    return page


def hold(page: Any, button: int = 0) -> None:
    """Press a jog button until the winch moves.

    A browser that is kept from the processor shows a picture that is too old to jog by; the press
    is then refused and nothing moves until the button is released and pressed again.
    """
    end = time.monotonic() + STARTS
    page.locator(".controls .jog").nth(button).hover(position={"x": 20, "y": 20})
    page.mouse.down()
    while state(page) not in MOVING:
        assert time.monotonic() < end, "it did not move"
        if REFUSED in page.inner_text("#banner"):
            page.mouse.up()
            page.mouse.down()
            until(page, lambda: REFUSED not in page.inner_text("#banner"), 10.0)
        page.wait_for_timeout(20)


def state(page: Any) -> str:
    return str(page.inner_text("#values .state span")).lower()


@pytest.mark.parametrize("way", ["release", "blur", "leave", "space"])
def test_a_held_jog_ends(browser: Any, bench: Served, way: str) -> None:
    page = commanding(browser, bench.url)
    hold(page)
    if way == "release":
        page.mouse.up()
    elif way == "blur":
        page.evaluate("window.dispatchEvent(new Event('blur'))")
    elif way == "leave":
        page.mouse.move(900, 400)
    else:
        page.keyboard.press("Space")
    until(page, lambda: state(page) not in MOVING, STOPS)
    page.wait_for_timeout(600)
    assert state(page) in {"at rest", "tripped"}
    page.context.close()


def test_a_log_counts_its_rows_and_cycles_and_objects_are_shown(
    browser: Any, bench: Served, tmp_path: Path
) -> None:
    page = commanding(browser, bench.url)
    name = f"{tmp_path.name}.csv"
    page.fill("[aria-label='Name of the log']", name)
    page.click("#record")
    page.evaluate("location.hash = '#library'")
    until(page, lambda: " rows" in page.inner_text("#recording"))
    page.evaluate("location.hash = '#bench'")
    page.click("text=Cycle time")
    until(page, lambda: page.locator("#cycles rect").count() > 0)
    cycles = int(page.inner_text("#cycles p").split()[0])
    until(page, lambda: int(page.inner_text("#cycles p").split()[0]) > cycles + 100)
    page.click("#record")
    until(page, lambda: page.inner_text("#recording") == "")
    until(
        page,
        lambda: f"{name}, " in page.inner_text("#head") and " rows." in page.inner_text("#head"),
    )
    assert page.input_value("[aria-label='Name of the log']") == name.replace(".csv", "-2.csv")
    page.click("text=Drive objects")
    until(page, lambda: "6041h" in page.inner_text("#objects"))
    page.click("text=Charts")
    until(page, lambda: page.locator("#strips canvas").count() == 4)
    residual = page.locator("#strips .strip").nth(1).locator(".last")
    until(page, lambda: "–" not in residual.inner_text() and residual.inner_text().endswith("N"))
    page.context.close()
    log = bench.folder / name
    assert len(log.read_text(encoding="utf-8").splitlines()) > 20
    log.unlink()


def test_a_page_that_vanishes_stops_its_winch_and_one_page_commands(
    browser: Any, bench: Served
) -> None:
    page = commanding(browser, bench.url)
    watcher, _ = opened(browser, f"{bench.url}#bench")
    until(watcher, lambda: watcher.locator("#values .value").count() == 3)
    assert watcher.locator(".controls .jog").first.is_disabled()
    hold(page, 1)
    page.context.close()
    until(watcher, lambda: state(watcher) not in MOVING, STOPS)
    watcher.click("#take")
    until(watcher, lambda: watcher.locator("#take").inner_text() == "Release command", 10.0)
    watcher.context.close()
