"""The script of a report in Debian's Chromium: zoom, values under the cursor, saved files."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from browsing import NEEDS_CHROMIUM, chromium
from command_line import invoke
from model_files import write_runs
from report_answers import recorded

pytest.importorskip("playwright.sync_api")
pytest.importorskip("matplotlib")

SVG = "{http://www.w3.org/2000/svg}"

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``report.html`` and ``figures/`` of one comparison, as the command line writes them."""
    made = tmp_path_factory.mktemp("report")
    paths = write_runs(made, recorded("demo-elastic-rope"))
    options = ["--html", str(made / "report.html"), "--figures", str(made / "figures")]
    done = invoke("compare", *paths, "-p", "bench-spiral", *options)
    assert done.exit_code in {0, 1}, done.output
    return made


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as opened:
        yield opened


@pytest.fixture
def page(browser: Any, folder: Path) -> Iterator[Any]:
    """The report, opened as a file; ends with an error where the script complained."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, accept_downloads=True)
    shown, complaints = context.new_page(), []
    shown.on("pageerror", lambda error: complaints.append(str(error)))
    shown.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    address = (folder / "report.html").as_uri()
    shown.on(
        "request",
        lambda asked: (
            None if asked.url.startswith((address, "blob:")) else complaints.append(asked.url)
        ),
    )
    shown.goto(address)
    yield shown
    context.close()
    assert not complaints


def figure(page: Any, name: str = "time-cable_length") -> Any:
    return page.locator(f"[data-figure={name}]")


def span(page: Any, name: str = "time-cable_length") -> tuple[float, float]:
    """Selected part of the time axis, thousandths of all."""
    box = figure(page, name).locator("svg.at-wide svg.area").first.get_attribute("viewBox")
    low, _, width, _ = map(float, box.split())
    return low, low + width


def ticks(page: Any) -> list[float]:
    shown = figure(page).locator("svg.at-wide .xticks text").all_text_contents()
    return [float(text.replace("−", "-")) for text in shown]


def saved(page: Any, kind: str, folder: Path, name: str = "time-cable_length") -> Path:
    with page.expect_download() as found:
        figure(page, name).locator(f"[data-save={kind}]").click()
    path = folder / found.value.suggested_filename
    found.value.save_as(path)
    return path


def test_every_figure_over_time_is_enlarged_together_and_reset(page: Any) -> None:
    whole = ticks(page)
    assert span(page) == (0, 1000)
    button = figure(page).locator("[data-zoom=reset]")
    assert button.get_attribute("aria-disabled") == "true"
    figure(page).locator("[data-zoom=in]").click()
    assert span(page) == span(page, "time-tension") == pytest.approx((250, 750))
    assert button.get_attribute("aria-disabled") == "false"
    assert max(ticks(page)) - min(ticks(page)) <= 0.5 * (max(whole) - min(whole)) * 1.5
    canvas = figure(page).locator(".canvas")
    canvas.focus()
    page.keyboard.press("ArrowRight")
    assert span(page) == pytest.approx((500, 1000))
    page.keyboard.press("ArrowRight")
    assert span(page) == pytest.approx((500, 1000)), "the end of the recording is the limit"
    page.keyboard.press("0")
    assert span(page) == (0, 1000)
    assert ticks(page) == whole


def test_a_part_that_is_dragged_over_is_shown(page: Any) -> None:
    canvas = figure(page).locator(".canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    axis = (
        figure(page)
        .locator("svg.at-wide")
        .evaluate(
            "svg => ({...JSON.parse(svg.dataset.axis),"
            " scale: svg.getBoundingClientRect().width / svg.viewBox.baseVal.width})"
        )
    )
    at = [box["x"] + (axis["left"] + part * axis["width"]) * axis["scale"] for part in (0.2, 0.6)]
    middle = box["y"] + box["height"] / 2
    page.mouse.move(at[0], middle)
    page.mouse.down()
    page.mouse.move(at[1], middle, steps=4)
    page.mouse.up()
    assert span(page) == pytest.approx((200, 600), abs=5)


def test_the_cursor_shows_values_that_the_figure_holds(page: Any, folder: Path) -> None:
    canvas = figure(page).locator(".canvas")
    canvas.hover()
    tip = canvas.locator(".tip").inner_text().splitlines()
    with (folder / "figures/time-cable_length.csv").open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert tip[0] in {row[0] for row in rows}
    assert len(tip) == len(head)
    time = float(tip[1].removeprefix("time ").removesuffix(" s"))
    row = min(rows, key=lambda row: abs(float(row[1]) - time))
    measured = next(line for line in tip if line.startswith("measured "))
    column = next(n for n, name in enumerate(head) if name.startswith("measured"))
    assert float(measured.split()[1].replace("−", "-")) == pytest.approx(
        float(row[column]), rel=1e-3
    )


@pytest.mark.parametrize("name", ["time-cable_length", "over-cable_length"])
def test_saved_values_are_those_of_the_command_line(page: Any, folder: Path, name: str) -> None:
    if not figure(page, name).is_visible():
        page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    path = saved(page, "csv", folder, name)
    with path.open(encoding="utf-8") as ours, (folder / f"figures/{name}.csv").open() as theirs:
        got, wanted = list(csv.reader(ours)), list(csv.reader(theirs))
    assert got[0] == wanted[0]
    assert len(got) == len(wanted)
    for one, other in zip(got[1:], wanted[1:], strict=True):
        assert [text and _value(text) for text in one] == [text and _value(text) for text in other]


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def test_saved_pictures_hold_what_is_selected(page: Any, folder: Path) -> None:
    drawn = ElementTree.parse(folder / "figures/time-cable_length.svg").getroot()
    whole = ElementTree.parse(saved(page, "svg", folder)).getroot()
    assert whole.attrib["width"] == drawn.attrib["width"]
    words = {text.text for text in drawn.iter(f"{SVG}text")}
    assert {text.text for text in whole.iter(f"{SVG}text")} == words
    assert not any("class" in element.attrib for element in whole.iter())
    figure(page).locator("[data-zoom=in]").click()
    part = ElementTree.parse(saved(page, "svg", folder)).getroot()
    assert {text.text for text in part.iter(f"{SVG}text")} != words
    picture = saved(page, "png", folder).read_bytes()
    assert picture.startswith(b"\x89PNG")
    width, height = (int.from_bytes(picture[at : at + 4]) for at in (16, 20))
    assert (width, height) == (2 * float(part.attrib["width"]), 2 * float(part.attrib["height"]))


def test_what_is_folded_is_printed_with_its_figures(page: Any) -> None:
    folded = "details:not([open]):has([data-figure])"
    before = page.locator(folded).count()
    assert before
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator(folded).count() == 0
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator(folded).count() == before
