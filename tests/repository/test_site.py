"""The documentation site: every page has a place, links are rewritten, the build has no warning."""

from __future__ import annotations

import base64
import runpy
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from command_line import own_process
from snippets import ROOT

made = runpy.run_path(str(ROOT / "docs/make_site.py"))


def places(nav: list[dict[str, Any]]) -> list[str]:
    found = []
    for entry in nav:
        for value in entry.values():
            found += places(value) if isinstance(value, list) else [value]
    return found


def test_every_page_is_in_the_navigation() -> None:
    settings = tomllib.loads((ROOT / "docs/zensical.toml").read_text(encoding="utf-8"))
    named = places(settings["project"]["nav"])
    assert len(named) == len(set(named))
    there = {place for _, place in made["sources"]() if place.endswith(".md")}
    assert set(named) <= there
    # Decisions are in the list of decisions.
    assert there - set(named) == {p for p in there if p.startswith("decisions/0")}


def test_every_decision_is_in_the_list() -> None:
    folder = ROOT / "docs/decisions"
    text = (folder / "index.md").read_text(encoding="utf-8")
    assert [p.name for p in folder.glob("0*.md") if f"({p.name})" not in text] == []


def test_links_lead_to_the_places_on_the_site(tmp_path: Path) -> None:
    made["stage"](tmp_path)
    readme = (tmp_path / "readme.md").read_text(encoding="utf-8")
    assert "](howto/logger.md)" in readme
    assert "](docs/" not in readme
    assert "](../files/examples/heave.py)" in (tmp_path / "tutorial/bench.md").read_text("utf-8")
    assert (tmp_path / "files/examples/heave.py").is_file()
    assert "](../contributing.md)" in (tmp_path / "howto/effect.md").read_text("utf-8")


def test_a_notebook_is_a_page_with_its_outputs(tmp_path: Path) -> None:
    picture = base64.b64encode(b"PNG").decode()
    cells = [
        {"cell_type": "markdown", "source": ["# Title\n", "text"]},
        {
            "cell_type": "code",
            "source": ["print(1)\n", "plot()"],
            "outputs": [
                {"output_type": "stream", "text": ["1\n"]},
                {"output_type": "display_data", "data": {"image/png": picture, "text/plain": "x"}},
                {"output_type": "execute_result", "data": {"text/plain": ["Run(…)"]}},
            ],
        },
        {"cell_type": "code", "source": [], "outputs": []},
    ]
    page = made["notebook_page"]({"cells": cells}, tmp_path / "one.md")
    (file,) = tmp_path.glob("one-*.png")
    assert file.read_bytes() == b"PNG"
    assert page == (
        "# Title\ntext\n\n```python\nprint(1)\nplot()\n```\n\n```text\n1\n```\n\n"
        f"![output]({file.name})\n\n```text\nRun(…)\n```\n"
    )


@pytest.mark.slow
@pytest.mark.skipif(find_spec("zensical") is None, reason="zensical is in the extra 'docs'")
def test_the_site_is_built_without_a_warning() -> None:
    own_process(sys.executable, str(ROOT / "docs/make_site.py"))
    html = ROOT / "docs/site/html"
    assert "Tutorials" in (html / "index.html").read_text(encoding="utf-8")
    assert (html / "search.json").stat().st_size > 100_000
