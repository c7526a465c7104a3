"""The page in Debian's Chromium, driven by Playwright: served processes and opened pages."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

STARTS = 60.0
"""For a page or a server to start, s."""


_PROGRAM = shutil.which("chromium")

NEEDS_CHROMIUM = pytest.mark.skipif(
    _PROGRAM is None, reason="no Chromium: apt-get install chromium"
)


@contextmanager
def chromium() -> Iterator[Any]:
    """A browser of Playwright, closed at the end."""
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=_PROGRAM, args=["--no-sandbox"])
        yield opened
        opened.close()


class Served:
    """``winchkit serve`` in a process of its own."""

    def __init__(self, *arguments: str, folder: Path = Path()) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "winchkit", "serve", "--no-browser", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)
        self.url = self.process.stdout.readline().strip()
        assert self.url.startswith("http://127.0.0.1:"), self.url

    def status(self) -> dict[str, Any]:
        """Newest status of the bench."""
        from websockets.sync.client import connect

        server, token = self.url.removeprefix("http://").split("/?token=")
        with connect(f"ws://{server}/live/bench?token={token}") as live:
            found: dict[str, Any] = json.loads(live.recv(STARTS))["status"]
        return found

    def end(self) -> None:
        """End it like Ctrl-C does."""
        self.process.terminate()
        self.process.communicate(timeout=STARTS)


def opened(browser: Any, url: str, **options: Any) -> tuple[Any, list[str]]:
    """A page and its complaints: errors of scripts, and requests that leave this computer."""
    context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
    page, complaints = context.new_page(), []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "console",
        lambda message: complaints.append(message.text) if message.type == "error" else None,
    )
    page.on(
        "request",
        lambda request: (
            None
            if request.url.startswith(("http://127.0.0.1", "ws://127.0.0.1", "data:", "blob:"))
            else complaints.append(request.url)
        ),
    )
    page.goto(url)
    return page, complaints


def until(page: Any, condition: Callable[[], bool], seconds: float = STARTS) -> float:
    """Wait for a condition; the time that it took, s."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < seconds, "it did not happen"
        page.wait_for_timeout(20)
    return time.monotonic() - start


def number(text: str) -> float:
    """Number before a unit."""
    found = re.match(r"−?[\d.]+", text)
    assert found, text
    return float(found[0].replace("−", "-"))


def texts(page: Any, selector: str) -> list[str]:
    """Texts of the elements of a selector."""
    return [str(text) for text in page.locator(selector).all_inner_texts()]


_KEPT = """() => { window.kept = null;
    const blobs = {}, made = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
    URL.createObjectURL = (blob) => { const url = made(blob); blobs[url] = blob; return url; };
    HTMLAnchorElement.prototype.click = async function () {
        URL.createObjectURL = made;
        HTMLAnchorElement.prototype.click = click;
        const bytes = new Uint8Array(await blobs[this.href].arrayBuffer());
        window.kept = [this.download, Array.from(bytes)]; }; }"""


def saved_as(page: Any, name: str, kind: str) -> bytes:
    """Content of the file that the menu of a plot saves.

    It is taken from the page's own link: Chromium refuses a second download of a page where it
    has not yet seen an action of the user.
    """
    page.evaluate(_KEPT)
    page.select_option(f"[aria-label='Save {name}']", kind)
    until(page, lambda: page.evaluate("Boolean(window.kept)"))
    file, content = page.evaluate("window.kept")
    assert file == f"{name}.{kind.lower()}"
    return bytes(content)
