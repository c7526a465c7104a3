"""Every refusal of the page's server is seen at once: in each view, and within an open dialog."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("playwright.sync_api")

from browsing import NEEDS_CHROMIUM, Served, opened, until

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]

VIEWS = ("diagnose", "bench", "robot", "library")
SHOWN = [
    pytest.param(number, view, dialog, id=f"{view}-{'dialog' if dialog else 'view'}")
    for number, (view, dialog) in enumerate(product(VIEWS, (False, True)))
]
"""Where a refusal is shown. What is refused is shared out among them: every view and dialog has
some, and each is refused once, since one function of page.js shows them all."""
WITHIN = 200.0
"""From the answer to the sentence on the screen, ms."""
BAD_PROFILE = 'schema = 1\nkind = "winch"\nname = "mine"\ncolour = "red"\n'
READS = (
    *("curve?output=x", "curve?output=x&points=many", "multiples?output=x", "card?effect=x"),
    *("card?effect=x&", "truth", "profile", "report", "pattern", "pattern?number=one"),
    *("overlay?name=../../etc/passwd", "fleet/runs", "fleet/runs?winch=A&time=0"),
    *("robot", "robot/picture", "robot/slice", "robot/profile", "robot/report"),
)
WRITES = (("plan", "{}"), ("effect", "{}"), ("guess", "{}"), ("guess", "[]"), ("guess", "no JSON"))
NEW = {"name": "mine", "values": {"drum.kind": "spirl"}, "pulleys": []}
ORDERS: tuple[dict[str, Any], ...] = (
    {"do": "dance"},
    {},
    *({"do": name} for name in ("profile", "example", "mystery", "use", "remove", "import")),
    *({"do": name} for name in ("add", "use-effect", "compare", "new-profile", "library")),
    {"do": "mystery", "seed": "x"},
    {"do": "guess", "file": "../x"},
    {"do": "new-profile", **NEW},
    {"do": "new-profile", **NEW, "name": ".."},
)
LATER: tuple[dict[str, Any], ...] = (
    *({"do": name} for name in ("diagnose", "undo", "swap", "calibrate", "propose")),
    {"do": "profile", "name": "no-such-profile"},
    {"do": "example", "name": "no-such-bench"},
    {"do": "add", "effect": "no-such-effect"},
    {"do": "import", "file": "../x", "answers": {}},
    {"do": "compare", "profile": 7, "runs": []},
    {"do": "use-effect", "file": "none.py"},
    {"do": "fleet"},
)
"""Accepted, and refused by the work."""
ASKED = """async ([path, body, headers]) => {
  const page = await import("/static/page.js");
  document.querySelectorAll(".alert").forEach((node) => node.querySelector("button").click());
  let said = null, at = null;
  await page.attempt(async () => {
    try { await page.ask(path, body === null ? undefined : body, headers); }
    catch (error) { said = error.message; at = performance.now(); throw error; }
  });
  return [said, at === null ? null : performance.now() - at];
}"""
SEEN = """(said) => {
  const node = [...document.querySelectorAll(".alert")].find((one) => one.innerText.includes(said));
  if (!node) return "is not there";
  const box = node.getBoundingClientRect(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  if (!node.contains(document.elementFromPoint(x, y))) return "is covered";
  const dialog = document.getElementById("dialog");
  return dialog.open && !dialog.contains(node) ? "is outside the dialog" : "";
}"""
FOUND = """async ([action, before]) => {
  const page = await import("/static/page.js");
  await page.order(action.do, action);
  let view;
  do { view = await page.ask("/api/view"); } while (view.refusals === before || view.busy);
  const start = performance.now(), said = view.faults[0].split("\\n")[0];
  const alerts = () => [...document.querySelectorAll(".alert")];
  const there = () => alerts().some((node) => node.innerText.includes(said));
  while (!there() && performance.now() - start < 5000) await new Promise(requestAnimationFrame);
  return [said, performance.now() - start];
}"""


@pytest.fixture(scope="module")
def page(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("work")
    served = Served(folder=folder)
    found, _ = opened(browser, served.url)
    until(found, lambda: found.locator("main .drop").count() == 1)
    yield found
    found.context.close()
    served.end()
    assert not list(folder.iterdir()), "what is refused writes nothing"


def clean(said: str) -> bool:
    """Whether a sentence has no option, temporary path or exception of Python."""
    return not any(word in said for word in ("--", "/tmp", "winchkit-page", "Error", "()"))


def show(page: Any, view: str, *, dialog: bool) -> None:
    page.evaluate("(view) => { location.hash = `#${view}`; }", view)
    until(page, lambda: page.locator(f"#views a[data-view={view}][aria-current]").count() == 1)
    page.evaluate(
        "async (wanted) => { const p = await import('/static/page.js'); p.closeDialog();"
        " if (wanted) p.dialog('Asked', 'words'); }",
        dialog,
    )


@pytest.mark.parametrize(("number", "view", "dialog"), SHOWN)
def test_a_refused_request_is_seen_at_once(page: Any, number: int, view: str, dialog: bool) -> None:
    show(page, view, dialog=dialog)
    requests = [
        *(("/api/" + path, None, {}) for path in READS),
        *(("/api/" + path, body, {}) for path, body in WRITES),
        *(("/api/do", json.dumps(asked), {}) for asked in ORDERS),
        ("/api/drop", "\x00\x01" * 99, {"x-file-name": "noise.bin"}),
        ("/api/nowhere", None, {}),
    ]
    for path, body, headers in requests[number :: len(SHOWN)]:
        said, late = page.evaluate(ASKED, [path, body, headers])
        if said is None:
            raise AssertionError(f"{path} {body}: not refused")
        assert clean(said), said
        assert page.evaluate(SEEN, said.split("\n")[0]) == "", (path, body, said)
        assert late < WITHIN, (path, late)
    assert page.locator(".alert").count() == 1
    page.click(".alert button")
    assert page.locator(".alert").count() == 0


def test_what_an_order_of_a_dialog_refused_ends_with_the_dialog(page: Any) -> None:
    show(page, "library", dialog=True)
    page.evaluate(ASKED, ["/api/nowhere", None, {}])
    assert page.locator("#dialog .alert").count() == 1
    page.keyboard.press("Escape")
    until(page, lambda: page.locator(".alert").count() == 0)


@pytest.mark.parametrize(("number", "view", "dialog"), SHOWN)
def test_refused_work_is_seen_in_every_view(
    page: Any, number: int, view: str, dialog: bool
) -> None:
    show(page, view, dialog=dialog)
    for action in LATER[number :: len(SHOWN)]:
        before = page.evaluate(
            "async () => (await (await import('/static/page.js')).ask('/api/view')).refusals"
        )
        said, late = page.evaluate(FOUND, [action, before])
        assert clean(said), said
        assert page.evaluate(SEEN, said) == "", (action, said)
        assert late < WITHIN, (action, late)


def test_a_refused_drop_is_seen_where_it_was_dropped(page: Any, tmp_path: Path) -> None:
    show(page, "diagnose", dialog=False)
    profile = tmp_path / "winch.toml"
    profile.write_text(BAD_PROFILE)
    page.set_input_files("#files", str(profile))
    until(page, lambda: "winch.toml" in page.inner_text("main .drop"))
    assert "/tmp" not in page.inner_text("main")
    page.click("main .drop .alert button")
    assert page.locator(".alert").count() == 0
