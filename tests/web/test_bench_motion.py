"""Motion from the page: however a held jog ends, the simulated motor stands within a bound."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import Motor, Relay, Served, opened, texts, until
from chromium import NEEDS_CHROMIUM, chromium
from stalls import StallWatch
from winchkit import catalog
from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.sim.live.client import send
from winchkit.web.simulated import simulated_bench

BOUND = DEAD_MAN + 0.35
"""From an event to the motor's rest, s: the dead-man, the ramp of 0.05 m/s at 1.5 m/s² (0.03), one
message (0.05), two cycles of 20 ms, a question of this test (0.02), and the event's way through the
browser and the server."""

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]


@pytest.fixture(scope="module")
def watch() -> Iterator[StallWatch]:
    with StallWatch() as found:
        yield found


@pytest.fixture(scope="module")
def browser(watch: StallWatch) -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def bench(watch: StallWatch, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A simulated bench with long cycles and patience, so that a busy computer trips nothing."""
    folder = tmp_path_factory.mktemp("bench")
    text = catalog.find("sim", "demo-adequate").read_text(encoding="utf-8")
    for before, after in (
        ('cycle = "4 ms"', 'cycle = "20 ms"'),
        ('heartbeat = "100 ms"', 'heartbeat = "1 s"'),
        ('rate = "100 Hz"', 'rate = "10 Hz"'),
        ("[winch.A.limits]", '[winch.A.limits]\nresponse_time = "1 s"'),
    ):
        assert before in text
        text = text.replace(before, after)
    declared = folder / "calm.toml"
    declared.write_text(text, encoding="utf-8")
    with simulated_bench(str(declared), folder) as file:
        yield file


@pytest.fixture(scope="module")
def motor(bench: str, watch: StallWatch) -> Motor:
    return Motor(bench, watch)


@pytest.fixture(scope="module")
def served(bench: str) -> Iterator[Served]:
    found = Served("--bench", bench, "--allow-motion")
    yield found
    found.end()


def watching(browser: Any, url: str, **options: Any) -> Any:
    """A page of the Bench view."""
    page, complaints = opened(browser, f"{url}#bench", **options)
    page.complaints = complaints
    until(page, lambda: page.locator("#values .value").count() == 3)
    return page


def commanding(browser: Any, url: str, **options: Any) -> Any:
    """The same, which commands."""
    page = watching(browser, url, **options)
    until(page, page.locator("#take").is_enabled)
    page.click("#take")
    until(page, lambda: page.locator("#role .command").count() == 1)
    return page


def press(page: Any, motor: Motor, button: int = 0) -> None:
    """Hold a jog button with the mouse until the motor turns."""
    box = page.locator(".controls .jog").nth(button).bounding_box()
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.mouse.down()
    until(page, lambda: motor.now() != 0.0)


def stands(motor: Motor, event: Callable[[], object]) -> None:
    """The motor stands within the bound after an event, and goes on standing."""
    assert motor.moved_after(event) < BOUND


def hidden(page: Any) -> None:
    """Hide the tab, as far as its scripts see it."""
    page.evaluate(
        """() => { Object.defineProperty(document, "hidden", { value: true, configurable: true });
        document.dispatchEvent(new Event("visibilitychange")); delete document.hidden; }"""
    )


def frozen(page: Any) -> None:
    """Freeze the page: none of its scripts runs."""
    session = page.context.new_cdp_session(page)
    session.send("Page.setWebLifecycleState", {"state": "frozen"})


@pytest.fixture(scope="class")
def page(browser: Any, served: Served) -> Iterator[Any]:
    page = commanding(browser, served.url)
    yield page
    page.context.close()
    assert page.complaints == []


class TestHeldWithTheMouse:
    @pytest.mark.parametrize(
        "event",
        [
            lambda page: page.mouse.up(),
            lambda page: page.evaluate("window.dispatchEvent(new Event('blur'))"),
            lambda page: page.mouse.move(900, 400),
            lambda page: page.keyboard.press("Space"),
            hidden,
        ],
        ids=["release", "blur", "pointer leaves", "Stop", "tab hidden"],
    )
    def test_the_jog_ends(self, page: Any, motor: Motor, event: Callable[[Any], None]) -> None:
        press(page, motor)
        stands(motor, lambda: event(page))
        page.mouse.up()

    def test_one_page_commands_and_another_watches_and_stops(
        self, page: Any, browser: Any, served: Served, motor: Motor
    ) -> None:
        watcher = watching(browser, served.url)
        assert watcher.locator("#take").is_disabled()
        assert watcher.locator(".controls .jog").first.is_disabled()
        said = watcher.evaluate(
            """() => new Promise((resolve) => {
            const line = new WebSocket(`ws://${location.host}/live/bench${location.search}`);
            line.onmessage = (event) => { const got = JSON.parse(event.data);
              if (got.said) { line.close(); resolve(got.said); }
              else line.send(JSON.stringify({ do: "jog", winch: "A", speed: 0.05,
                seen: got.status.time })); }; })"""
        )
        assert "only watches" in said
        assert motor.now() == 0.0
        press(page, motor, 1)
        stands(motor, lambda: watcher.click(".station .stop"))
        page.mouse.up()
        watcher.context.close()

    def test_a_trip_is_said_in_words_and_nothing_moves_before_a_reset_and_a_new_press(
        self, page: Any, bench: str, motor: Motor
    ) -> None:
        press(page, motor, 1)
        stands(motor, lambda: send(bench, "fault A.servo over-temperature"))
        until(page, lambda: "temperature" in page.inner_text("#trips"))
        assert page.inner_text("#values .state").endswith("ripped")
        assert page.locator(".controls .jog").first.is_disabled()
        until(page, lambda: page.locator("#trip svg").count() > 0)
        shown = page.inner_text("#trip")
        assert "winch A" in shown
        assert "0.000 s" in shown, "the trip is an event of its strip"
        send(bench, "recover A.servo")
        page.once("dialog", lambda shown: shown.accept())
        page.click("#trips button:has-text('Reset')")
        until(page, lambda: page.inner_text("#trips") == "")
        assert motor.moved_after(lambda: None) == 0.0, "nothing moves by the reset"
        page.mouse.up()
        assert motor.moved_after(lambda: None) == 0.0
        press(page, motor)
        page.mouse.up()


def test_a_log_counts_its_rows_and_cycles_objects_and_frames_are_shown(
    browser: Any, served: Served, tmp_path: Path
) -> None:
    page = commanding(browser, served.url)
    name = f"{tmp_path.name}.csv"
    page.fill("[aria-label='Name of the log']", name)
    page.click("#record")
    until(page, lambda: " rows" in page.inner_text("#recording"))
    page.click("text=Cycle time")
    until(page, lambda: page.locator("#cycles rect").count() > 0)
    cycles = int(page.inner_text("#cycles p").split()[0])
    until(page, lambda: int(page.inner_text("#cycles p").split()[0]) > cycles + 100)
    page.click("#record")
    until(page, lambda: page.inner_text("#recording") == "")
    page.click("text=Drive objects")
    until(page, lambda: "6041h" in page.inner_text("#objects"))
    page.click("text=Charts")
    until(page, lambda: page.locator("#strips canvas").count() == 4)
    residual = page.locator("#strips .strip").nth(1).locator(".last")
    until(page, lambda: "–" not in residual.inner_text() and residual.inner_text().endswith("N"))
    page.click("text=Bus frames")
    until(page, lambda: "Controlword" in page.inner_text("#frames"))
    page.fill("[aria-label='Filter of the frames']", "heartbeat")
    until(page, lambda: page.locator("#frames tbody tr").count() == 2)
    page.context.close()
    log = Path(name)
    assert len(log.read_text(encoding="utf-8").splitlines()) > 20
    log.unlink()


def touched(page: Any, *places: tuple[float, float]) -> None:
    """Fingers on these places, and on no other."""
    session = page.context.new_cdp_session(page)
    points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
    kind = "touchStart" if points else "touchEnd"
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def test_with_a_finger_at_390_px_a_lifted_or_a_second_one_ends_the_jog(
    browser: Any, served: Served, motor: Motor
) -> None:
    small = {"width": 390, "height": 667}
    page = commanding(browser, served.url, viewport=small, has_touch=True, is_mobile=True)
    button = page.locator(".stopbar .jog").first
    assert button.is_visible()
    assert page.locator(".stopbar .stop").is_visible()
    box = button.bounding_box()
    place = (box["x"] + 30, box["y"] + 20)
    for end in ((), (place, (200, 300))):
        touched(page, place)
        until(page, lambda: motor.now() != 0.0)
        stands(motor, lambda end=end: touched(page, *end))
        touched(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.context.close()


@pytest.mark.parametrize("way", ["frozen", "stalled", "cut", "closed", "killed"])
def test_a_page_or_a_server_that_vanishes_moves_nothing_on(
    browser: Any, bench: str, served: Served, motor: Motor, way: str
) -> None:
    own = Served("--bench", bench, "--allow-motion") if way == "killed" else served
    relay = Relay(int(own.url.split("/")[2].rpartition(":")[2]))
    url = own.url.replace(own.url.split("/")[2], f"127.0.0.1:{relay.port}")
    page = commanding(browser, url)
    press(page, motor)
    events: dict[str, Callable[[], object]] = {
        "frozen": lambda: frozen(page),
        "stalled": relay.stall,
        "cut": relay.cut,
        "closed": page.context.close,
        "killed": own.process.kill,
    }
    stands(motor, events[way])
    if way in {"cut", "killed"}:
        until(page, lambda: "emergency stop" in " ".join(texts(page, "#trips")))
    if way != "closed":
        page.context.close()
    relay.cut()
    if way == "killed":
        own.process.communicate(timeout=60.0)


def test_a_programme_is_previewed_started_by_a_held_button_and_ended_with_its_page(
    browser: Any, served: Served, motor: Motor
) -> None:
    page = commanding(browser, served.url)
    page.click("#programmes")
    steps = '[[step]]\nby = "-50 mm"\nspeed = "0.1 m/s"\n\n[[step]]\nask = "look at it"\n'
    text = f'schema = 1\nkind = "programme"\nname = "own"\n\n{steps}\n[[step]]\nhold = "20 s"\n'
    own = {"name": "own.toml", "mimeType": "text/plain", "buffer": text.encode()}
    page.set_input_files("[aria-label='Programme file']", own)
    until(page, lambda: "1 repeat" in page.inner_text("#preview"))
    page.fill("[aria-label='Folder of the runs']", "runs-of-a-test")
    button = page.locator(".hold")
    button.dispatch_event("pointerdown", {"button": 0})
    button.dispatch_event("pointerup")
    assert page.locator("#dialog[open]").count() == 1, "a short press starts nothing"
    button.dispatch_event("pointerdown", {"button": 0})
    until(page, lambda: motor.now() != 0.0)
    until(page, lambda: page.locator("text=It is done").count() == 1)
    page.click("text=It is done")
    until(page, lambda: "hold 20 s" in page.inner_text("#programme"))
    hidden(page)
    page.evaluate("Object.defineProperty(document, 'hidden', { value: true, configurable: true })")
    page.wait_for_timeout(1200)
    page.evaluate("delete document.hidden")
    until(page, lambda: "no sign of life" in page.inner_text("#programme"))
    page.context.close()
    shutil.rmtree("runs-of-a-test")
