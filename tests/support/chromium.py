"""Debian's Chromium, driven by Playwright."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

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
