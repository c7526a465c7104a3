"""The page of effects: every card whole, every signature drawn from its code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from report_parsed import Page
from winchkit.cli.model.effects import command
from winchkit.effects.card import signature
from winchkit.effects.catalogue import load_catalogue
from winchkit.report.html.markup import formula
from winchkit.report.pages.effects import effects_html

CATALOGUE = load_catalogue()
EFFECTS = tuple(CATALOGUE)


@pytest.fixture(scope="module")
def whole() -> Page:
    return Page(effects_html(EFFECTS, "all"))


def test_every_effect_has_its_section_and_its_link(whole: Page) -> None:
    ids = [a["id"] for tag, a in whole.elements if tag == "section"]
    links = [a["href"] for tag, a in whole.elements if tag == "a"]
    assert set(ids) == {e.id for e in EFFECTS} | {"contents"}
    assert sorted(str(link) for link in links) == sorted(f"#{e.id}" for e in EFFECTS)


def test_every_card_says_everything(whole: Page) -> None:
    for effect in EFFECTS:
        for words in (effect.what, effect.source, effect.looks_like):
            assert " ".join(words.split()) in whole.text
        assert " ".join(effect.formula.replace("_", "").split()) in whole.text
        assert effect.told_apart in whole.text


def test_indices_of_a_formula_are_subscripts() -> None:
    assert formula("F_c = μ N < F") == ('<span class="formula">F<sub>c</sub> = μ N &lt; F</span>')


def test_every_output_that_changes_is_drawn(whole: Page) -> None:
    drawn = sum(1 + len(signature(e).changes) for e in EFFECTS)
    assert len(whole.shown) == len(whole.figures) == drawn
    assert whole.count("script") == 2


def test_a_picture_is_the_signature() -> None:
    effect = CATALOGUE["motor-viscous"]
    page = Page(effects_html([effect], effect.id))
    time, change = (
        np.array(page.column("signature-motor-viscous-motor_torque", name), dtype=float)
        for name in ("time", "change")
    )
    drawn = signature(effect)
    assert change == pytest.approx(
        np.interp(time, drawn.time, drawn.changes["motor_torque"]), rel=1e-5, abs=1e-9
    )
    assert np.ptp(change) == pytest.approx(np.ptp(drawn.changes["motor_torque"]), rel=1e-5)
    assert "change [N m]" in page.text


def test_the_command_writes_the_page(tmp_path: Path) -> None:
    for words in ([], ["cable-sag"]):
        path = tmp_path / f"page{len(words)}.html"
        result = CliRunner().invoke(command, [*words, "--html", str(path)])
        assert result.exit_code == 0
        assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert (tmp_path / "page1.html").stat().st_size < 120_000
