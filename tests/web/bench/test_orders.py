"""What a page orders and what stops it: fields, tare, keys, messages, and a server that is gone."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, number, opened, until

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]

TARGET = "[aria-label='Cable length, m']"
MOVE = "fieldset.move button"
AT_REST = 10.0
"""For a stop or a move of some centimetres to end, s, on a busy computer."""


@dataclass
class Commanding:
    """A page that commands, and the messages that it has sent."""

    page: Any
    sent: list[dict[str, Any]]

    def orders(self, *names: str) -> list[dict[str, Any]]:
        return [item for item in self.sent if item["do"] in names]

    def value(self, place: int) -> float:
        """Cable length, tension or speed as the page shows it."""
        return number(self.page.locator("#values .value").nth(place).inner_text())

    def state(self) -> str:
        return str(self.page.inner_text("#values .state span")).lower()

    def move(self, text: str) -> None:
        self.page.fill(TARGET, text)
        self.page.click(MOVE)

    def start(self) -> None:
        """Start a long move, slowly, to the end that is farther away."""
        self.page.select_option("[aria-label^='Speed of the move']", "0.02")
        self.move("0.6" if self.value(0) > 2.5 else "4.5")
        self.until(lambda: self.state() in {"winding in", "paying out"})

    def until(self, condition: Callable[[], bool]) -> None:
        until(self.page, condition, AT_REST)


@pytest.fixture
def commanding(browser: Any, bench: Served) -> Iterator[Commanding]:
    page, complaints = opened(browser, "about:blank")
    sent: list[dict[str, Any]] = []

    def watch(line: Any) -> None:
        line.on("framesent", lambda text: sent.append(json.loads(text)))

    page.on("websocket", watch)
    page.goto(f"{bench.url}#bench")
    until(page, lambda: page.locator("#values .value").count() == 3)
    page.click("#take")
    until(page, lambda: "You command" in page.inner_text("#role"))
    yield Commanding(page, sent)
    page.context.close()
    assert complaints == []


def test_what_is_no_length_is_said_at_its_field_and_moves_nothing(commanding: Commanding) -> None:
    page, before = commanding.page, commanding.value(0)
    for text in ("", "  ", "2,5 m", "2.5 m", "two", "-1", "1e1", "NaN", "0x2"):
        commanding.move(text)
        fault = f'"{text.strip()}" is not a length.' if text.strip() else "No length is given."
        assert page.inner_text("#move-fault") == f"{fault} Type metres, for example 2.5."
        assert page.get_attribute(TARGET, "aria-invalid") == "true"
    page.wait_for_timeout(500)
    assert commanding.orders("move", "step", "jog") == []
    assert commanding.value(0) == pytest.approx(before, abs=1e-3)
    page.fill(TARGET, "2.5")
    assert page.inner_text("#move-fault") == ""


def test_a_move_has_a_speed_of_its_own(commanding: Commanding) -> None:
    page = commanding.page
    page.click("#speeds button >> nth=0")
    page.select_option("[aria-label^='Speed of the move']", "0.15")
    assert "at 0.02 m/s" in page.inner_text(".controls")
    before = commanding.value(0)
    target = before - 0.2 if before > 2.5 else before + 0.2
    commanding.move(f"{target:.3f}")
    commanding.until(lambda: abs(commanding.value(2)) > 0.1)
    commanding.until(lambda: commanding.state() == "at rest")
    assert [item["speed"] for item in commanding.orders("move")] == [0.15]
    assert commanding.value(0) == pytest.approx(target, abs=2e-3)


CONTROLS = {
    "checkbox": "<input type=checkbox>",
    "radio": "<input type=radio>",
    "slider": "<input type=range value=5>",
    "file": "<input type=file>",
    "select": "<select><option>one<option>two</select>",
    "button": "<button>press</button>",
    "link": "<a href='#library'>library</a>",
    "summary": "<details><summary>more</summary>text</details>",
}


@pytest.mark.parametrize("place", [*CONTROLS, "open select", "dialog"])
def test_space_and_esc_stop_from_every_control(commanding: Commanding, place: str) -> None:
    """Space comes last: it opens the dialog of a field for files."""
    page = commanding.page
    for key in ("Escape", "Space"):
        commanding.start()
        if place == "dialog":
            page.click("#tare")
            until(page, lambda: page.evaluate("document.activeElement.closest('#dialog') !== null"))
        else:
            markup = CONTROLS[place.removeprefix("open ")]
            page.evaluate(
                """markup => { const box = document.createElement("div"); box.id = "under-test";
                box.innerHTML = markup; document.getElementById("main").prepend(box);
                window.used = 0; for (const kind of ["click", "change"])
                box.addEventListener(kind, () => { window.used += 1; });
                box.querySelector("a, button, input, select, summary").focus(); }""",
                markup,
            )
            if place == "open select":
                page.click("#under-test select")
                page.evaluate("window.used = 0")
        page.keyboard.press(key)
        commanding.until(lambda: commanding.state() == "at rest")
        assert commanding.page.get_attribute("#tripped", "hidden") is not None
        if place == "dialog":
            assert page.locator("#dialog").is_visible(), "the key has stopped, and nothing else"
            assert commanding.orders("tare") == []
            page.keyboard.press("Escape")
        else:
            assert page.evaluate("window.used") == 0
            page.evaluate("document.getElementById('under-test').remove()")


def test_in_a_text_field_esc_stops_and_space_is_a_character(commanding: Commanding) -> None:
    page = commanding.page
    commanding.start()
    page.focus("[aria-label='Name of the log']")
    page.keyboard.press("Space")
    page.wait_for_timeout(300)
    assert commanding.state() != "at rest"
    assert " " in page.input_value("[aria-label='Name of the log']")
    page.keyboard.press("Escape")
    commanding.until(lambda: commanding.state() == "at rest")


def test_a_tare_asks_shows_gross_beside_net_and_is_undone(commanding: Commanding) -> None:
    page = commanding.page
    weight = commanding.value(1)
    assert weight == pytest.approx(98.07, abs=4.0), "10 kg at rest"
    page.keyboard.press("t")
    assert "gross 9" in page.inner_text("#dialog")
    assert "15 N and 400 N still act on the gross value" in page.inner_text("#dialog")
    page.keyboard.press("Escape")
    assert not page.locator("#dialog").is_visible()
    assert commanding.orders("tare") == []
    page.keyboard.press("t")
    page.keyboard.press("Enter")
    commanding.until(lambda: abs(commanding.value(1)) < 4.0)
    words = page.locator("#values .note").nth(1)
    commanding.until(lambda: words.inner_text().startswith("Tension, net; gross 9"))
    needle = page.locator("#values .gauge").nth(1).locator("rect").last
    at = float(str(needle.get_attribute("x")).removeprefix("calc(").split("%")[0])
    assert at == pytest.approx(100.0 * weight / 420.0, abs=1.5), "the limits act on the gross value"
    page.click("#untare")
    commanding.until(lambda: abs(commanding.value(1) - weight) < 4.0)
    commanding.until(lambda: words.inner_text() == "Tension")
    assert page.locator("#untare").is_hidden()


def test_a_dialog_that_opens_as_another_closes_keeps_the_focus(commanding: Commanding) -> None:
    page = commanding.page
    focused = page.evaluate(
        """async () => { for (const key of ["t", "Escape", "t"])
        document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        return document.activeElement.textContent; }"""
    )
    assert focused == "Tare winch A"


def test_messages_repeat_end_and_are_above_a_dialog(commanding: Commanding) -> None:
    page = commanding.page
    banner = page.locator("#banner .alert")
    for _ in range(2):
        commanding.move("99")
        commanding.until(lambda: banner.count() == 1)
        assert "99 m" in banner.inner_text()
        page.click("#banner button")
        assert banner.count() == 0
    commanding.move("99")
    commanding.until(lambda: banner.count() == 1)
    page.click("#tare")
    box, over = banner.bounding_box(), page.locator("#dialog").bounding_box()
    assert over["y"] >= box["y"] + box["height"], "a dialog is below the messages"
    hit = "at => document.elementFromPoint(at.x, at.y).closest('#banner .alert') !== null"
    middle = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    assert page.evaluate(hit, middle)
    page.keyboard.press("Escape")
    page.click("text=+1 >> nth=0")
    commanding.until(lambda: banner.count() == 0)
    page.click("#take")
    until(page, lambda: "Watching" in page.inner_text("#role"))
    page.keyboard.press("ArrowUp")
    assert "only watches" in banner.inner_text()
    page.click("#take")
    commanding.until(lambda: banner.count() == 0)


def test_values_of_a_server_that_is_gone_are_grey_with_their_age_and_nothing_is_offered(
    commanding: Commanding, bench: Served
) -> None:
    page = commanding.page
    page.click("#tare")
    before = commanding.value(0)
    os.kill(bench.process.pid, signal.SIGSTOP)
    try:
        until(page, lambda: "Use the emergency stop" in page.inner_text("#trips"))
        until(page, lambda: "What is shown is 3 s old" in page.inner_text("#trips"))
        notes = page.locator("#values .note").all_inner_texts()
        assert sum(" s old" in text for text in notes) == 4, notes
        colours = {
            page.evaluate("place => getComputedStyle(document.querySelector(place)).color", place)
            for place in ("#values .value", "#values .state", "#where")
        }
        assert len(colours) == 1, "values have the colour of notes"
        offered = page.evaluate(
            """() => [...document.querySelectorAll("button, input, select")].filter((node) =>
            node.checkVisibility() && !node.disabled && !node.closest("[inert]"))
            .map((node) => node.textContent.trim() || node.getAttribute("aria-label"))"""
        )
        assert not {"Move", "Record", "Release command", "Tare winch A", "+10"} & set(offered)
        assert not [text for text in offered if text.startswith(("↑", "↓", "Tare"))]
        assert any(text.startswith("Stop") for text in offered)
        page.keyboard.press("Escape")
        page.keyboard.down("ArrowUp")
        page.wait_for_timeout(600)
        page.keyboard.up("ArrowUp")
    finally:
        os.kill(bench.process.pid, signal.SIGCONT)
    until(page, lambda: page.inner_text("#trips") == "")
    until(page, lambda: " s old" not in page.inner_text("#values"))
    page.wait_for_timeout(1000)
    assert commanding.value(0) == pytest.approx(before, abs=1e-3)


def test_a_browser_that_was_too_slow_ends_its_jog_though_the_key_is_down(
    commanding: Commanding,
) -> None:
    page = commanding.page
    page.keyboard.down("ArrowUp" if commanding.value(0) > 2.5 else "ArrowDown")
    commanding.until(lambda: commanding.state() in {"winding in", "paying out"})
    page.evaluate("() => { const end = performance.now() + 800; while (performance.now() < end); }")
    commanding.until(lambda: "the browser was too slow" in page.inner_text("#banner"))
    commanding.until(lambda: commanding.state() == "at rest")
    jogs = len(commanding.orders("jog", "refresh"))
    page.wait_for_timeout(1000)
    assert len(commanding.orders("jog", "refresh")) == jogs
    assert commanding.state() == "at rest"
    page.keyboard.up("ArrowUp")


@pytest.mark.parametrize("order", ["key", "click"])
def test_orders_that_waited_in_a_stalled_server_move_nothing(
    commanding: Commanding, bench: Served, order: str
) -> None:
    """The browser sends them in the first second, before it notices that pictures stay away."""
    page, before = commanding.page, commanding.value(0)
    os.kill(bench.process.pid, signal.SIGSTOP)
    try:
        if order == "key":
            page.keyboard.down("ArrowDown")
            page.wait_for_timeout(300)
            page.keyboard.up("ArrowDown")
        else:
            page.click("text=+10 >> nth=0")
        page.wait_for_timeout(3000)
    finally:
        os.kill(bench.process.pid, signal.SIGCONT)
    until(page, lambda: page.inner_text("#trips") == "")
    page.wait_for_timeout(1000)
    assert commanding.orders("jog", "step") != [], "it was sent"
    assert commanding.value(0) == pytest.approx(before, abs=1e-3)
