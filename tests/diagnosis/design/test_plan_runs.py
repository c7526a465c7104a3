"""The comparison of plan with random and D-optimal programmes, on one case."""

from __future__ import annotations

import json

import pytest

from plan_runs import STRATEGIES, main_of


@pytest.mark.slow
def test_each_strategy_ends_with_the_hidden_effect(capsys: pytest.CaptureFixture[str]) -> None:
    assert main_of(["--cases", "1", "--seed", "3", "--most", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found.pop("not separable") == 0
    assert set(found) == set(STRATEGIES)
    for strategy in found.values():
        assert strategy["cases"] == 1
        assert 0 < strategy["runs_mean"] <= 3
    assert found["plan"]["right"] == 1.0
