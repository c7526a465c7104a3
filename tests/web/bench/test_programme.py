"""Programmes that a page starts: how they begin, are followed, and end."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from playwright.sync_api import TimeoutError as PlaywrightTimeout

from browsing import NEEDS_CHROMIUM, Served, number, opened, until

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]

MOVING = {"winding in", "paying out"}
HEAD = """\
schema = 1
kind = "programme"
name = "stroke"
"""
STEP = """
[[step]]
winch = "A"
by = "{change}"
speed = "{speed}"
acceleration = "0.5 m/s^2"
"""


@pytest.fixture
def page(browser: Any, bench: Served) -> Iterator[Any]:
    """A page of the Bench view that commands a winch at rest."""
    found, complaints = opened(browser, f"{bench.url}#bench")
    until(found, lambda: found.locator("#values .value").count() == 3)
    found.click("#take")
    until(found, lambda: "You command" in found.inner_text("#role"))
    yield found
    assert complaints == []
    found.context.close()


def state(page: Any) -> str:
    """State of the winch; its first letter is a capital, before it is an arrow."""
    return str(page.inner_text("#values .state span")).lower()


def length(page: Any) -> float:
    return number(page.inner_text("#values .value >> nth=0"))


def choose(page: Any, folder: Path, change: str, speed: str, moves: int = 1) -> None:
    """Open the dialog of the programmes with a file of one move, or of several alike."""
    path = folder / "stroke.toml"
    path.write_text(HEAD + moves * STEP.format(change=change, speed=speed))
    page.click("#programmes")
    until(page, lambda: page.locator("#dialog .hold").count() == 1, 10.0)
    page.set_input_files("#dialog input[type=file]", str(path))
    until(page, lambda: page.locator("#dialog select").input_value() == "stroke.toml", 10.0)
    page.fill("[aria-label='Folder of the runs']", folder.name)
    until(page, lambda: "stroke" in page.inner_text("#preview"), 10.0)
    until(page, lambda: page.locator("#dialog .hold").is_visible(), 10.0)


def press(page: Any, seconds: float) -> None:
    """Hold the button that starts the programme."""
    page.locator("#dialog .hold").hover()
    page.mouse.down()
    page.wait_for_timeout(1000 * seconds)
    page.mouse.up()


def test_a_programme_starts_after_its_button_was_held_and_its_end_is_reported(
    page: Any, tmp_path: Path
) -> None:
    choose(page, tmp_path, "-60 mm", "0.2 m/s")
    before = length(page)
    press(page, 1.0)
    until(page, lambda: "stroke is done" in page.inner_text("#programme"), 15.0)
    until(page, lambda: state(page) == "at rest", 5.0)
    assert length(page) == pytest.approx(before - 0.06, abs=0.002)
    assert not page.locator("#dialog").is_visible()
    page.click("#programme button")


@pytest.mark.parametrize("way", ["released", "left"])
def test_a_button_that_is_not_held_long_enough_starts_nothing(
    page: Any, tmp_path: Path, way: str
) -> None:
    choose(page, tmp_path, "-60 mm", "0.2 m/s")
    before = length(page)
    if way == "released":
        press(page, 0.3)
    else:
        page.locator("#dialog .hold").hover()
        page.mouse.down()
        page.wait_for_timeout(200)
        page.mouse.move(10, 300)
    page.wait_for_timeout(1500)
    page.mouse.up()
    assert page.inner_text("#programme") == ""
    assert length(page) == pytest.approx(before, abs=0.001)
    assert state(page) == "at rest"


def test_the_button_that_ends_a_programme_stays_the_same_from_step_to_step(
    page: Any, tmp_path: Path
) -> None:
    # The browser clicks an element where the pointer went down and up on the same one.
    choose(page, tmp_path, "-20 mm", "0.05 m/s", moves=3)
    press(page, 1.0)
    until(page, lambda: page.locator("text=End programme").count() == 1, 10.0)
    button = page.locator("text=End programme").element_handle()
    texts = set()
    while "is done" not in (text := page.inner_text("#programme")):
        if text:
            texts.add(text)
            assert button.evaluate("each => each.isConnected") or "is done" in page.inner_text(
                "#programme"
            )
    assert len(texts) > 1, "the programme advanced while its button was there"


def test_progress_is_drawn_again_after_the_connection_was_lost(page: Any) -> None:
    # In between the page knows of no programme; the state after it may be the same.
    shown = page.evaluate(
        """async () => {
          const { progress } = await import("/static/programme.js");
          const host = document.createElement("div"), none = () => {};
          const now = { name: "stroke", does: "moves", repeat: 1, repeats: 2, step: 1, steps: 3 };
          return [now, null, now].map((each) => (progress(host, each, none), host.textContent));
        }"""
    )
    assert shown[1] == ""
    assert "stroke" in shown[0]
    assert shown[2] == shown[0]


@pytest.mark.parametrize("way", ["Space", "button", "End programme"])
def test_a_programme_that_is_stopped_ends_at_rest(page: Any, tmp_path: Path, way: str) -> None:
    # Half a minute: a busy browser clicks seconds later.
    choose(page, tmp_path, "0.6 m" if way == "button" else "-0.6 m", "0.02 m/s")
    before = length(page)
    press(page, 1.0)
    until(page, lambda: state(page) in MOVING, 10.0)
    if way == "Space":
        page.keyboard.press("Space")
    elif way == "button":
        page.click("header .stop")
    else:
        try:
            page.click("text=End programme", timeout=10_000)
        except PlaywrightTimeout as error:
            raise AssertionError(f"the page shows: {page.inner_text('#programme')}") from error
    until(page, lambda: state(page) not in MOVING, 2.0)
    until(page, lambda: "stroke ended early" in page.inner_text("#programme"), 5.0)
    stopped = length(page)
    page.wait_for_timeout(800)
    assert length(page) == pytest.approx(stopped, abs=0.02), "the ramp at the most"
    assert abs(length(page) - before) < 0.55
    if page.locator("#reset").count():
        page.once("dialog", lambda shown: shown.accept())
        page.click("#reset")
        until(page, lambda: page.locator("#trips .trip").count() == 0, 10.0)
