"""Changelog fragments are lists, and the release program collects them."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from snippets import ROOT

made = runpy.run_path(str(ROOT / "docs/make_changelog.py"))
FRAGMENTS = sorted((ROOT / "docs" / "changes").glob("*.md"))


@pytest.mark.parametrize("path", FRAGMENTS, ids=lambda path: path.stem)
def test_a_fragment_is_a_list(path: Path) -> None:
    assert made["items"](path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("text", ["", "text\n", "- one\ntext\n", "# heading\n- one\n"])
def test_other_text_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a list"):
        made["items"](text)


def test_fragments_come_before_what_was_unreleased_and_older_sections_stay() -> None:
    log = (
        "# Changelog\n\nIntro.\n\n## Unreleased\n\n- old\n  line\n\n"
        "## 0.1.0 – 2026-01-01\n\n- first\n"
    )
    new = made["collected"](log, ["- a\n- b\n  more\n", "- c\n"], "0.2.0", "2026-11-25")
    assert new == (
        "# Changelog\n\nIntro.\n\n## Unreleased\n\n## 0.2.0 – 2026-11-25\n\n"
        "- a\n- b\n  more\n- c\n- old\n  line\n\n## 0.1.0 – 2026-01-01\n\n- first\n"
    )
    again = made["collected"](new, ["- d\n"], "0.3.0", "2026-12-01")
    assert again.count("\n## ") == 4
    assert "## 0.3.0 – 2026-12-01\n\n- d\n\n## 0.2.0" in again


def test_a_changelog_without_the_section_is_refused() -> None:
    with pytest.raises(ValueError, match="Unreleased"):
        made["collected"]("# Changelog\n", ["- a\n"], "0.2.0", "2026-11-25")
