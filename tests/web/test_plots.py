"""Plots in Chromium: read-out, kept ranges, the address, sizes of first screen and targets."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, number, opened, saved_as, texts, until

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]
SMALL = """() => [...document.querySelectorAll("button, select, input, a, summary")]
    .filter((one) => one.getClientRects().length && !one.classList.contains("visually-hidden"))
    .filter((one) => one.getBoundingClientRect().height < 44)
    .map((one) => one.textContent || one.getAttribute("aria-label"))"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    found = Served("--mystery", "1", folder=tmp_path_factory.mktemp("work"))
    yield found
    found.end()


def diagnosed(browser: Any, url: str, **options: Any) -> tuple[Any, list[str]]:
    page, complaints = opened(browser, url, accept_downloads=True, **options)
    until(page, lambda: page.locator("#time .u-over").count() == 2)
    until(page, lambda: page.locator("#card .u-over").count() == 1)
    return page, complaints


def readouts(page: Any) -> list[str]:
    return [str(text) for text in page.locator("#time .readout:visible").all_inner_texts()]


def test_the_pointer_reads_value_unit_time_and_run_in_both_plots(
    browser: Any, served: Served
) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose/cable_length")
    box = page.locator("#time .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 20)
    until(page, lambda: len(readouts(page)) == 2)
    upper, lower = (text.split(" · ") for text in readouts(page))
    asked = "`/api/curve${location.search}&output=cable_length&points=1480`"
    curve = page.evaluate(f"fetch({asked}).then((answer) => answer.json())")
    time = number(upper[0])
    assert upper[0].endswith(" s")
    assert lower[0] == upper[0]
    known = [(abs(t - time), v) for t, v in zip(curve["x"], curve["measured"], strict=True) if v]
    assert number(upper[1].removeprefix("measured ")) == pytest.approx(min(known)[1], rel=0.02)
    assert upper[1].endswith(f" {curve['unit']}")
    assert upper[2].startswith("predicted ")
    assert lower[1].startswith("residual ")
    assert lower[1].endswith(f" {curve['residual_unit']}")
    (name,) = {run["name"] for run in curve["runs"] if run["at"] <= time} & {upper[-1]}
    assert lower[-1] == name
    page.mouse.move(5, 5)
    until(page, lambda: readouts(page) == [])
    assert complaints == []
    page.context.close()


def ticks(page: Any, name: str) -> list[str]:
    """y ticks of the first panel of an exported drawing."""
    panel = ElementTree.fromstring(saved_as(page, name, "SVG")).find(".//{*}g/{*}g")
    return [str(text.text) for text in panel.iter() if text.get("text-anchor") == "end"]


def test_a_kept_range_outlives_a_zoom_and_is_that_of_the_exports(
    browser: Any, served: Served
) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose/cable_length")
    name = "cable_length-over-time"
    menu = f"[aria-label='Save {name}']"
    page.select_option(menu, "Keep this range")
    before = ticks(page, name)
    box = page.locator("#time .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.95 * box["width"], box["y"] + 20)
    for _ in range(8):
        page.mouse.wheel(0, -300)
        page.wait_for_timeout(250)
    until(page, lambda: page.locator("text=Whole record").count() == 1)
    assert ticks(page, name) == before
    page.select_option(menu, "Fit to the values")
    assert ticks(page, name) != before
    assert complaints == []
    page.context.close()


def test_the_address_has_zoom_comparison_filter_and_channel(browser: Any, served: Served) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose/tension//5to20")
    until(page, lambda: page.locator("text=Whole record").count() == 1)
    assert "Tension" in page.inner_text("#time h2")
    assert re.search(r"#diagnose/tension/[\w-]*/5to20$", page.url)
    page.evaluate("location.hash = '#library'")
    until(page, lambda: page.locator("table.library tr").count() > 3)
    page.fill("[aria-label='Filter runs']", "slow")
    page.select_option("[aria-label=Channel]", "motor_torque")
    shown = page.locator("table.library tr").count()
    assert "/slow/" in page.url
    page.locator("table.library tr:not(.set) input").first.check()
    page.reload()
    until(page, lambda: page.locator("table.library tr").count() == shown)
    assert page.input_value("[aria-label='Filter runs']") == "slow"
    assert page.input_value("[aria-label=Channel]") == "motor_torque"
    assert page.locator("table.library tr:not(.set) input:checked").count() == 1
    page.evaluate("location.hash = '#library/runs/fast'")
    until(page, lambda: page.input_value("[aria-label='Filter runs']") == "fast")
    page.goto("about:blank")
    page.goto(f"{served.url}#diagnose/cable_length///0")
    until(page, lambda: page.locator("#models-b").count() == 1)
    assert page.url.endswith("/0")
    page.click("text=End comparison")
    until(page, lambda: page.locator("#models").count() == 1)
    until(page, lambda: not page.url.endswith("/0"))
    assert complaints == []
    page.context.close()


def test_verdict_errors_and_residual_are_seen_at_a_height_of_900(
    browser: Any, served: Served
) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose/cable_length")
    steps = "document.querySelector('.found ol')"  # as many lines as five steps with their doubts
    page.evaluate(f"{steps}.append(...Array.from({{ length: 15 }}, (_, i) => `step ${{i}}\\n`))")
    page.evaluate(f"{steps}.style.whiteSpace = 'pre'")
    box = page.locator("#time .plot").nth(1).bounding_box()
    assert box["y"] + box["height"] <= 900
    heights = {row.bounding_box()["height"] for row in page.locator(".models .name").all()}
    assert heights == {27}
    assert complaints == []
    page.context.close()


def test_any_channel_over_another_is_chosen_drawn_and_saved(
    browser: Any, served: Served, tmp_path: Path
) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose")
    page.click("#channels summary")
    page.select_option("#channels [aria-label=Channel]", "motor_torque")
    page.select_option("#channels [aria-label=Over]", "temperature")
    name = "motor_torque-over-temperature"
    until(page, lambda: page.locator(f"[aria-label='Save {name}']").count() == 1)
    with page.expect_download() as waiting:
        page.select_option(f"[aria-label='Save {name}']", "CSV")
    waiting.value.save_as(tmp_path / "drawn.csv")
    heads = (tmp_path / "drawn.csv").read_text().splitlines()[2].split(",")
    assert heads[0] == "temperature [degC]"
    assert heads[1].endswith("[N m]")
    over = page.locator("[aria-label='Another variable'] option")
    if over.count() > 1:
        words = over.nth(1).inner_text()
        page.select_option("[aria-label='Another variable']", index=1)
        until(page, lambda: words in page.locator("#over h3").first.inner_text())
    assert complaints == []
    page.context.close()


def test_an_answer_that_arrives_late_does_not_replace_the_newest_one(
    browser: Any, served: Served
) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose")
    held: list[Any] = []

    def hold(route: Any) -> None:
        held.append(route)

    page.route("**/api/lines*channel=motor_torque&over=motor_angle", hold)
    page.click("#channels summary")
    page.select_option("#channels [aria-label=Channel]", "motor_torque")
    until(page, lambda: bool(page.title() and held))
    page.select_option("#channels [aria-label=Over]", "temperature")
    title = page.locator("#channels h3").first
    until(page, lambda: title.count() == 1 and "over temperature" in title.inner_text())
    with page.expect_response("**/api/lines*over=motor_angle") as late:
        held[0].continue_()
    late.value.finished()
    page.evaluate("new Promise((done) => setTimeout(done, 200))")
    assert "over temperature" in title.inner_text()
    assert complaints == []
    page.context.close()


def drawing(page: Any, name: str) -> tuple[str, list[str]]:
    """An exported drawing and its texts."""
    drawn = saved_as(page, name, "SVG").decode()
    return drawn, [str(node.text) for node in ElementTree.fromstring(drawn).findall(".//{*}text")]


LABELS = """() => [...document.querySelectorAll("#models .name > span:first-child")]
    .map((one) => one.firstChild.textContent)"""


def test_exports_show_what_is_seen(browser: Any, served: Served) -> None:
    page, complaints = diagnosed(browser, f"{served.url}#diagnose/cable_length")
    _, drawn = drawing(page, "models")
    labels = page.evaluate(LABELS)
    assert len(labels) > 2
    assert {*labels, *filter(None, texts(page, "#models .value"))} <= set(drawn)
    over = page.locator("#over .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 60, box["y"] + 30, steps=4)
    page.mouse.up()
    until(page, lambda: "samples" in page.inner_text("#brush"))
    time, curves = drawing(page, "cable_length-over-time")
    loads = {text.rpartition(" ")[0].split()[-1] for text in curves if text.endswith(" kg")}
    assert loads == {"10", "20"}, "each run with its load"
    marked = "#7B2FA8"
    assert marked in time
    over, shares = drawing(page, "cable_length-residual")
    assert sum(text.endswith(" %") for text in shares) == page.locator("#over h3").count()
    assert marked in over
    assert complaints == []
    page.context.close()


COLOURS = """() => [...document.querySelectorAll("#channels .legend i")]
    .map((one) => getComputedStyle(one).backgroundColor.match(/\\d+/g).map(Number))"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_two_runs_have_one_colour(browser: Any, served: Served, scheme: str) -> None:
    page, complaints = diagnosed(browser, served.url, color_scheme=scheme)
    page.click("#channels summary")
    until(page, lambda: page.locator("#channels .u-over").count() > 0)
    found = page.evaluate(COLOURS)
    assert len(found) == 8
    assert min(math.dist(*pair) for pair in combinations(found, 2)) > 50
    assert complaints == []
    page.context.close()


@pytest.mark.parametrize("view", ["diagnose", "library"])
def test_targets_of_a_phone_are_44_px_high(browser: Any, served: Served, view: str) -> None:
    size = {"width": 390, "height": 844}
    page, complaints = opened(browser, f"{served.url}#{view}", viewport=size)
    ready = {"diagnose": "#card .u-over", "library": "table.library tr.set"}[view]
    until(page, lambda: page.locator(ready).count() == 1)
    assert page.evaluate(SMALL) == []
    assert page.evaluate("document.documentElement.scrollWidth") == size["width"]
    assert complaints == []
    page.context.close()


def test_the_dialog_of_a_new_profile_fits_a_phone(browser: Any, served: Served) -> None:
    page, complaints = opened(browser, served.url, viewport={"width": 390, "height": 844})
    until(page, lambda: page.locator(".of-runs > button").count() == 2)
    page.click(".of-runs > button >> nth=1")
    page.click("#dialog >> text=New profile…")
    until(page, lambda: page.locator(".drawing label").count() > 5)
    assert (
        page.evaluate("(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth)(dialog)") == 0
    )
    narrow = page.locator(".drawing label > span:first-child").first.bounding_box()
    assert narrow["width"] > 300, "words beside their field would have 60 px"
    assert complaints == []
    page.context.close()
