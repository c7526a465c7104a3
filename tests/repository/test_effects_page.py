"""docs/effects.md is what the catalogue says today."""

from __future__ import annotations

import runpy
from collections.abc import Callable

import pytest

from snippets import ROOT
from winchkit.effects import Catalogue, load_catalogue
from winchkit.effects.card import card


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return load_catalogue()


@pytest.fixture(scope="module")
def page(catalogue: Catalogue) -> str:
    written: Callable[[Catalogue], str] = runpy.run_path(str(ROOT / "docs/make_effects.py"))["page"]
    return written(catalogue)


def test_the_page_is_up_to_date(page: str) -> None:
    there = (ROOT / "docs/effects.md").read_text(encoding="utf-8")
    assert there == page, "run: python docs/make_effects.py"


def test_every_effect_has_its_card_once(page: str, catalogue: Catalogue) -> None:
    titles = [line.removeprefix("### ") for line in page.splitlines() if line.startswith("### ")]
    assert sorted(titles) == sorted(effect.id for effect in catalogue)


def test_cards_stand_there_line_by_line(page: str, catalogue: Catalogue) -> None:
    for effect in catalogue:
        lines = card(effect).split("Signature over")[0].splitlines()[1:]
        assert "\n".join(lines).strip() in page
