"""Cards and the command that shows them."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from command_line import own_process
from effect_lines import ALL_IDS, CATALOGUE, MINE
from winchkit.cli.model.effects import command
from winchkit.effects import Effect
from winchkit.effects.card import card, card_data, signature, sparkline
from winchkit.errors import UsageError


@pytest.mark.parametrize("effect", list(CATALOGUE), ids=ALL_IDS)
def test_a_card_says_everything_and_fits_a_terminal(effect: Effect) -> None:
    text = card(effect)
    lines = text.splitlines()
    assert lines[0] == effect.id
    flat = " ".join(text.split())
    for words in (effect.what, effect.formula, effect.source, effect.looks_like):
        assert " ".join(words.split()) in flat
    for name in (*effect.confused_with, *effect.outputs, *(p.name for p in effect.parameters)):
        assert name in text
    drawn = [line for line in lines if any(bar in line for bar in "▁▂▃▄▅▆▇█")]
    assert len(drawn) == 1 + len(effect.outputs)
    assert max(map(len, lines)) <= 80


def test_a_sparkline_runs_from_lowest_to_highest_and_keeps_gaps() -> None:
    assert sparkline(np.array([0.0, 1.0, 2.0, 7.0]), 4) == "▁▂▃█"
    assert sparkline(np.array([0.0, np.nan, 7.0]), 3) == "▁ █"
    assert sparkline(np.full(8, 3.0), 4) == "▅▅▅▅"
    assert sparkline(np.full(8, np.nan), 4) == "    "
    spike = np.zeros(1000)
    spike[437] = 1.0
    assert sparkline(spike, 10).count("█") == 1


def test_the_signature_of_an_elastic_cable_is_hookes() -> None:
    drawn = signature(CATALOGUE["cable-elongation-linear"])
    stretch = drawn.changes["cable_length"]
    light, heavy = 15.0 * 9.80665, 45.0 * 9.80665
    in_the_hold_before_the_load_changes = len(stretch) // 2 - 150
    for index, force in ((in_the_hold_before_the_load_changes, light), (-1, heavy)):
        assert stretch[index] == pytest.approx(force * (6.0 + 1.5) / 2e5, rel=1e-6)


def test_the_command_lists_every_effect_once() -> None:
    result = CliRunner().invoke(command, [])
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert max(map(len, lines)) <= 80
    listed = [line.split()[0] for line in lines if line[:2] == "  " != line[2:4]]
    assert sorted(listed) == sorted(ALL_IDS)


def test_the_command_prints_json_without_nan_or_infinity() -> None:
    result = CliRunner().invoke(command, ["--json"])
    data = json.loads(result.output, parse_constant=pytest.fail)
    assert data["schema"] == 1
    assert [effect["id"] for effect in data["effects"]] == ALL_IDS
    one = json.loads(CliRunner().invoke(command, ["frame-compliance", "--json"]).output)
    assert one["parameters"][0]["null"] is None
    assert one["signature"]["changes"]["cable_length"]["unit"] == "m"
    assert len(one["signature"]["time"]) == len(one["signature"]["cable_length"])


def test_an_effect_of_the_users_own_is_listed_and_shown(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE)
    listed = CliRunner().invoke(command, ["--effects", str(file)])
    assert f"{len(ALL_IDS) + 1} effects" in listed.output
    shown = CliRunner().invoke(command, ["my-own", "--effects", str(file)])
    assert shown.output.startswith("my-own")
    assert "+0.001 to +0.001 m" in shown.output


def test_an_unknown_effect_is_a_usage_error_that_suggests() -> None:
    result = CliRunner().invoke(command, ["drum-radus"])
    assert isinstance(result.exception, UsageError)
    assert "did you mean 'drum-radius'?" in str(result.exception)


def test_card_data_is_complete() -> None:
    data = card_data(CATALOGUE["pulley-dahl"])
    assert [p["name"] for p in data["parameters"]] == ["friction", "stiffness", "shape", "start"]
    assert data["contains"] == ["pulley-coulomb", "pulley-capstan"]


def test_the_catalogue_needs_neither_scipy_nor_a_bus() -> None:
    code = (
        "import sys; from winchkit.effects import load_catalogue; load_catalogue();"
        "heavy = {'scipy', 'can', 'canopen', 'pymodbus', 'pydantic', 'rich'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = own_process(sys.executable, "-c", code)
    assert done.stdout.strip() == "[]"
