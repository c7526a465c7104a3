"""A page beside a winch whose cable length is unknown, where `limits.unhomed` forbids jogs too."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, opened, until
from winchkit import find

pytestmark = [pytest.mark.slow, pytest.mark.realtime, NEEDS_CHROMIUM]


@pytest.fixture
def unhomed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A bench with an incremental encoder that no record knows."""
    folder = tmp_path_factory.mktemp("work")
    text = find("sim", "demo-adequate").read_text(encoding="utf-8")
    changed = text.replace('encoder = "absolute"', 'encoder = "incremental"').replace(
        "[winch.A.limits]\n", '[winch.A.limits]\nunhomed = "none"\n'
    )
    assert changed.count("unhomed") == 1
    assert changed.count("incremental") == 1
    (folder / "unhomed.toml").write_text(changed, encoding="utf-8")
    served = Served("--sim", "unhomed.toml", folder=folder)
    yield served
    served.end()


def test_no_jog_is_offered_and_the_page_says_why(browser: Any, unhomed: Served) -> None:
    page, complaints = opened(browser, "about:blank")
    sent: list[dict[str, Any]] = []
    page.on(
        "websocket", lambda line: line.on("framesent", lambda text: sent.append(json.loads(text)))
    )
    page.goto(f"{unhomed.url}#bench")
    until(page, lambda: page.locator("#values .value").count() == 3)
    page.click("#take")
    until(page, lambda: "You command" in page.inner_text("#role"))
    buttons = page.locator(".jog")
    assert buttons.count() == 4
    for button in buttons.all():
        assert button.is_disabled()
        assert "home first" in button.inner_text()
    assert "unknown: home the winch; no jogs" in page.inner_text("#values")
    page.keyboard.down("ArrowUp")
    until(page, lambda: 'limits.unhomed = "none" forbids jogs' in page.inner_text("#banner"), 5.0)
    page.wait_for_timeout(500)
    page.keyboard.up("ArrowUp")
    assert not {"jog", "refresh"} & {item["do"] for item in sent}
    page.context.close()
    assert complaints == []
