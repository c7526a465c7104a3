"""Takes docs/pictures/page-*.png from the page: ``python docs/make_screenshots.py [VIEW …]``.

It needs Chromium, the package ``playwright`` and the extra ``web``. The bench is simulated in real
time, so it wants a quiet computer.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from winchkit import write_run
from winchkit.web.examples import example_runs

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
from robot_poses.truth import Truth, csv, poses

PICTURES = Path(__file__).with_name("pictures")
SIZE = {"width": 1280, "height": 900}
TRIES = 5


@contextmanager
def served(folder: str, *arguments: str) -> Iterator[str]:
    """URL of a page that is served while the block runs; its work is in the folder."""
    command = [sys.executable, "-m", "winchkit", "serve", "--no-browser", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
    finally:
        process.terminate()
        process.wait(30)


def diagnose(page: Any, url: str) -> None:
    """Diagnose view with marked samples."""
    page.goto(url)
    page.wait_for_selector("#card .primary", timeout=120_000)
    page.wait_for_timeout(2000)
    residual = page.locator("#over .u-over").first
    residual.scroll_into_view_if_needed()
    box = residual.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 30, steps=5)
    page.mouse.up()
    page.evaluate("scrollTo(0, 0)")  # a full page has its head where it is scrolled to
    page.wait_for_timeout(1500)


def bench(page: Any, url: str) -> None:
    """Bench view while the winch moves."""
    page.goto(f"{url}#bench")
    page.wait_for_selector("#values .value", timeout=60_000)
    page.click("#take")
    page.wait_for_timeout(25_000)
    page.fill("[aria-label='Cable length, m']", "2.5")
    for _ in range(TRIES):  # a busy computer ends the move: the page answers too late
        page.click(".move button")
        page.evaluate("scrollTo(0, 0)")
        page.wait_for_timeout(8000)
        if page.inner_text("#values .state span").lower() == "winding in":
            return
        for close in page.locator("#banner button").all():
            close.click()
    sys.exit("bench: the move ended early; take the picture on a quieter computer")


def robot(page: Any, url: str) -> None:
    """Robot view with calibrated poses and a slice of the feasible ones."""
    page.goto(url)
    page.wait_for_selector("#details svg", timeout=120_000)
    page.wait_for_selector("text=margin 0 to", timeout=120_000)


def library(page: Any, url: str) -> None:
    """Library view with a verdict and two runs laid over each other."""
    page.goto(url)
    page.wait_for_selector("#card .primary", timeout=120_000)
    page.keyboard.press("4")
    page.wait_for_selector("main .chip", timeout=120_000)
    for row in (1, 3):  # the first box chooses the whole set
        page.locator("main input[type=checkbox]").nth(row).check()
    page.wait_for_timeout(2000)


def main() -> None:
    """Take all of them."""
    chromium = shutil.which("chromium")
    if chromium is None:
        sys.exit("no Chromium: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        runs = Path(folder) / "runs"
        runs.mkdir()
        for run in example_runs("demo-eccentric-drum").runs:
            write_run(run, runs / f"{run.name}.csv", replace=True)
        recorded = Path(folder) / "poses.csv"
        recorded.write_text(csv(poses(Truth(), 60, 7), angles=True))
        profile = ["-p", "bench-spiral"]
        browser = driver.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        views = {
            "diagnose": (diagnose, ["--mystery", "1"]),
            "bench": (bench, ["--sim", "demo-adequate"]),
            "robot": (robot, [str(recorded), "-p", "cabtive"]),
            "library": (
                library,
                [*map(str, sorted(runs.iterdir())), *profile, "--folder", str(runs)],
            ),
        }
        for name in sys.argv[1:] or views:
            show, arguments = views[name]
            with served(folder, *arguments) as url:
                page = browser.new_page(viewport=SIZE)
                show(page, url)
                whole = name != "bench"  # it stops what moves, as long as it takes
                page.screenshot(path=PICTURES / f"page-{name}.png", full_page=whole)
                page.close()
        browser.close()


if __name__ == "__main__":
    main()
