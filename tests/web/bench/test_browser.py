"""The page in Debian's Chromium: the whole story, accessibility, a robot."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, opened, saved_as, texts, until
from recordings_of_others import lay_out
from robot_poses.truth import Truth, csv, poses
from winchkit.runs.writer import write_run
from winchkit.web.examples import example_runs

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("runs")
    paths = []
    for run in example_runs("demo-thick-layers").runs:
        paths.append(folder / f"{run.name}.csv")
        write_run(run, paths[-1])
    return paths


@pytest.fixture(scope="module")
def served(recorded: list[Path]) -> Iterator[Served]:
    found = Served("--folder", str(recorded[0].parent))
    yield found
    found.end()


def test_drop_see_add_the_error_falls_save_and_reload(
    browser: Any, served: Served, recorded: list[Path], tmp_path: Path
) -> None:
    page, complaints = opened(browser, served.url, accept_downloads=True)
    page.set_input_files("#files", [str(path) for path in recorded])
    until(page, lambda: "8 runs" in page.inner_text("main"))
    page.click("text=choose…")
    page.select_option("#dialog select", "bench-spiral")
    page.click("#dialog .primary")
    until(page, lambda: page.locator("#card .primary").count() == 1)
    assert page.locator(".chip.explained").count() == 1
    before = float(texts(page, ".models .cell.today.focus .value")[0])
    page.keyboard.press("a")
    until(page, lambda: page.locator(".chip.adequate").count() == 1)
    output = page.locator(".models .head.focus").inner_text()
    after = float(texts(page, ".models .cell.today.focus .value")[0])
    history = [float(text) for text in texts(page, ".models .cell.history .value") if text != "–"]
    assert max(history) > 2 * after or before > 2 * after, output
    with page.expect_download() as saved:
        page.click("text=Save profile")
    saved.value.save_as(tmp_path / "better.toml")
    assert "layer-thickness" in (tmp_path / "better.toml").read_text()
    page.reload()
    until(page, lambda: page.locator(".chip.adequate").count() == 1)
    page.keyboard.press("c")
    page.click("#dialog .primary")
    until(page, lambda: page.locator("#over-b canvas").count() > 0)
    assert page.locator(".chip.adequate").count() == page.locator(".chip.explained").count() == 1
    page.click("text=End comparison")
    until(page, lambda: page.locator("#time canvas").count() == 2)
    page.keyboard.press("4")
    until(page, lambda: page.locator("tr.set").count() == 1)
    until(page, lambda: page.locator("main input[type=checkbox]").count() == 1 + len(recorded))
    page.locator("main input[type=checkbox]").nth(1).check()
    until(page, lambda: page.locator("#overlay canvas").count() == 1)
    assert complaints == []
    page.context.close()


def test_files_that_are_no_runs_are_one_line_of_the_library(browser: Any, tmp_path: Path) -> None:
    """A folder has figures, mappings and notes beside its runs: they must not hide these."""
    write_run(next(iter(example_runs("demo-adequate").runs)), tmp_path / "lift.csv")
    for number in range(12):
        (tmp_path / f"figure-{number}.csv").write_text("load [N],mean residual [mm]\n1,2\n")
    served = Served("--folder", str(tmp_path))
    try:
        page, complaints = opened(browser, f"{served.url}#library")
        until(page, lambda: page.locator("tr.set").count() == 1)
        assert "1 run in 1 set" in page.inner_text("main")
        assert "12 files are no runs" in page.inner_text("main")
        assert "figure-3.csv" not in page.inner_text("main")
        page.click("#faults")
        until(page, lambda: "figure-3.csv" in page.inner_text("main"))
        assert page.get_attribute("#faults", "aria-expanded") == "true"
        assert complaints == []
        page.context.close()
    finally:
        served.end()


EMPS = """\
schema = 1
kind = "axis"
name = "emps"

[gearbox]
ratio = 1

[reference]
motor_angle = "0 rad"

[[effect]]
id = "rotor-inertia"
inertia = "95.11 kg m^2"

[[effect]]
id = "motor-viscous"
viscosity = "203.5 N m s"
"""


def test_emps_from_its_authors_file_and_a_log_of_another_program(
    browser: Any, tmp_path: Path
) -> None:
    """Until measured and predicted torque are drawn; tests/diagnosis/test_real_emps.py goes on."""
    lay_out("emps", tmp_path)
    profile, log = tmp_path / "emps.toml", tmp_path / "log.csv"
    profile.write_text(EMPS)
    rows = "\n".join(
        f"{i * 0.02:.2f};{57.3 * abs(i % 100 - 50):.3f};{9 + i % 3}" for i in range(300)
    )
    log.write_text(f"Zeit [s];Pos [deg];Kraft\n{rows}\n")
    served = Served("--folder", str(tmp_path))
    page, complaints = opened(browser, served.url)
    page.set_input_files("#files", str(log))
    until(page, lambda: page.locator("#dialog .primary").count() == 1)
    assert page.locator("#dialog .primary").is_disabled(), "the unit of Kraft is not known"
    page.select_option("[aria-label='Channel of Kraft']", "tension")
    until(page, lambda: page.locator("[aria-label='Unit of Kraft']").count() == 1)
    page.fill("[aria-label='Unit of Kraft']", "N")
    page.keyboard.press("Tab")
    until(page, lambda: page.locator("#dialog .primary").is_enabled())
    page.click("#dialog .primary")
    until(page, lambda: "1 run" in page.inner_text("main"))
    page.click("text=1 run")
    page.click("[aria-label^='Remove log']")
    until(page, lambda: page.locator("#files").count() == 1)

    page.click("text=choose…")
    page.set_input_files("#dialog input[type=file]", str(profile))
    until(page, lambda: "emps" in page.inner_text("main"))
    page.set_input_files("#files", str(tmp_path / "DATA_EMPS.mat"))
    until(page, lambda: page.locator("[aria-label='Channel of vir']").count() == 1)
    page.select_option("[aria-label='Channel of vir']", "motor_torque")
    until(page, lambda: page.locator("[aria-label='Factor of vir']").count() == 1)
    page.fill("[aria-label='Factor of vir']", "gtau")
    page.keyboard.press("Tab")
    until(page, lambda: page.input_value("[aria-label='Unit of vir']") == "N m")
    page.click("#dialog .primary")
    until(page, lambda: page.locator("#time canvas").count() == 2)
    assert complaints == []
    page.context.close()
    served.end()


def rail(page: Any) -> float:
    """Place of the rail of today's error in the focused column, per cent of its drawing."""
    place = page.locator(".models .cell.focus line.rail").first.get_attribute("x1")
    return float(str(place).rstrip("%"))


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    found = Served("--mystery", "1", folder=tmp_path_factory.mktemp("work"))
    yield found
    found.end()


def test_samples_are_marked_by_a_finger_and_by_keys(browser: Any, example: Served) -> None:
    page, complaints = opened(browser, example.url, has_touch=True)
    page.set_viewport_size({"width": 390, "height": 844})
    until(page, lambda: page.locator("#over .u-over").count() == 6)
    plot = page.locator("#over .u-over").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    touch = page.context.new_cdp_session(page)
    for kind, shares in (
        ("touchStart", [0.2]),
        ("touchMove", [0.4]),
        ("touchMove", [0.7]),
        ("touchEnd", []),
    ):
        points = [{"x": box["x"] + at * box["width"], "y": box["y"] + 20} for at in shares]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    until(page, lambda: " samples, " in page.inner_text("#brush"))
    by_finger = page.inner_text("#brush")
    page.locator("#over .plot").first.focus()
    page.keyboard.press("b")
    until(page, lambda: page.inner_text("#brush") != by_finger)
    assert " samples, " in page.inner_text("#brush")
    page.keyboard.press("Escape")
    until(page, lambda: "samples" not in page.inner_text("#brush"))
    assert complaints == []
    page.context.close()


@pytest.mark.parametrize("motion", ["no-preference", "reduce"])
def test_the_rail_slides_to_the_new_error_or_its_earlier_place_stays_dotted(
    browser: Any, example: Served, motion: str
) -> None:
    page, complaints = opened(browser, example.url, reduced_motion=motion)
    until(page, lambda: page.locator("#card .primary").count() == 1)
    before = rail(page)
    page.evaluate(
        """() => { window.places = []; const look = () => {
        const node = document.querySelector(".models .cell.focus line.rail");
        if (node) window.places.push(parseFloat(node.getAttribute("x1")));
        requestAnimationFrame(look); }; look(); }"""
    )
    page.keyboard.press("a")
    until(page, lambda: page.locator(".name.history").count() == 1 and rail(page) < before - 5)
    if motion == "reduce":
        until(page, lambda: page.locator("line.earlier").count() > 0, 2.0)
        until(page, lambda: page.locator("line.earlier").count() == 0, 6.0)
    page.wait_for_timeout(1000)
    places, after = page.evaluate("window.places"), rail(page)
    between = {at for at in places if after + 1 < at < before - 1}
    assert (len(between) > 3) == (motion == "no-preference")
    assert ", was " in page.inner_text("#live")
    until(page, lambda: page.locator("#busy progress").count() == 0)
    page.keyboard.press("u")
    until(page, lambda: page.locator(".name.history").count() == 0)
    page.wait_for_timeout(1000)
    assert rail(page) == pytest.approx(before, abs=0.5)
    assert complaints == []
    page.context.close()


def test_every_plot_is_saved_with_its_title_its_runs_its_profile_and_the_version(
    browser: Any, example: Served
) -> None:
    page, complaints = opened(browser, example.url, color_scheme="dark")
    until(page, lambda: page.locator("#card .exports").count() == 1)
    until(page, lambda: page.locator("#over .exports").count() == 1)
    until(page, lambda: page.locator("#time .exports").count() == 1)
    runs = page.evaluate("fetch('/api/view' + location.search).then((r) => r.json())")
    names = [run["name"] for run in runs["runs"]]
    labels = [
        str(node.get_attribute("aria-label")).removeprefix("Save ")
        for node in page.locator("select.exports").all()
    ]
    assert len(labels) == 4
    for name in labels:
        drawn = saved_as(page, name, "SVG").decode()
        root = ElementTree.fromstring(drawn)
        words = " ".join(root.itertext())
        assert "var(" not in drawn
        assert "NaN" not in drawn
        assert f"profile {runs['profile']['name']}" in words
        assert f"winchkit {runs['version']}" in words
        assert all(run in words for run in names)
        table = saved_as(page, name, "CSV").decode().splitlines()
        assert table[0].startswith("# ")
        assert len(table) > 4
        picture = saved_as(page, name, "PNG")
        assert picture[:8] == b"\x89PNG\r\n\x1a\n"
        wide = int.from_bytes(picture[16:20], "big")
        assert wide == 2 * float(root.get("width"))
    assert complaints == []
    page.context.close()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    path = tmp_path_factory.mktemp("robot") / "poses.csv"
    path.write_text(csv(poses(Truth(), 60, 7), angles=True))
    found = Served(str(path), "-p", "cabtive")
    yield found
    found.end()


def test_a_robot_is_calibrated_turned_and_saved(
    browser: Any, robot: Served, tmp_path: Path
) -> None:
    page, complaints = opened(browser, robot.url, accept_downloads=True)
    until(page, lambda: page.locator("#details svg").count() == 2)
    assert "Pose error falls from" in page.inner_text("h1")
    assert page.locator("#picture svg circle").count() >= 9
    page.locator("#details svg").nth(1).hover(position={"x": 120, "y": 60})
    assert re.match(
        r"cable \d, (before|after) [\d.]+ mm", page.inner_text("#details .readout:visible")
    )
    until(page, lambda: "margin 0 to" in page.inner_text("#picture"))
    page.focus("#row")
    page.keyboard.press("ArrowRight")
    until(page, lambda: "Pose 1 of 60" in page.inner_text("#picture"))
    page.click("text=Top")
    text = saved_as(page, "robot", "SVG").decode()
    assert "poses.csv" in text
    assert "var(" not in text
    with page.expect_download() as saved:
        page.click("text=Save profile")
    saved.value.save_as(tmp_path / "better.toml")
    assert "[fitted]" in (tmp_path / "better.toml").read_text()
    assert complaints == []
    asked: list[str] = []

    def fail_once(route: Any) -> None:
        asked.append(route.request.url)
        route.abort() if len(asked) == 1 else route.continue_()

    page.route("**/api/robot", fail_once)
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 844})
        page.reload()
        until(page, lambda: page.locator("#details svg").count() == 2)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert len(asked) >= 3, "a reading that fails is repeated"
    assert [text for text in complaints if "ERR_FAILED" not in text] == []


DRAWN = "#over canvas, main .drop, #details svg, table.library"
"""What each view shows last, where no bench is attached."""


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.campaign)])
def test_no_view_has_a_violation_of_axe_or_scrolls_sideways(
    browser: Any, served: Served, robot: Served, scheme: str, tmp_path: Path
) -> None:
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("no npm: axe-core comes from it")
    got = subprocess.run(
        [npm, "install", "--silent", "axe-core@4"], cwd=tmp_path, capture_output=True, check=False
    )
    if got.returncode:
        pytest.skip("npm has no axe-core here")
    axe = (tmp_path / "node_modules/axe-core/axe.min.js").read_text()
    context = browser.new_context(color_scheme=scheme, bypass_csp=True)
    page = context.new_page()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 844})
        for view in ("diagnose", "bench", "robot", "library"):
            url = robot.url if view == "robot" else f"{served.url}#{view}"
            page.goto(url)
            page.reload()
            until(page, lambda: page.locator(DRAWN).count() > 0)
            page.wait_for_timeout(200)
            page.evaluate(axe)
            found = page.evaluate("async () => (await axe.run()).violations")
            said = [(v["id"], [node["html"][:120] for node in v["nodes"]][:3]) for v in found]
            assert said == [], f"{view} at {width} px, {scheme}"
            wide = page.evaluate("document.documentElement.scrollWidth")
            assert wide <= width, f"{view}: {wide} px wide at {width} px"
    context.close()
