"""The comparison of plan with random and D-optimal programmes, on one case."""

from __future__ import annotations

import json

import numpy as np
import pytest

from campaign.memory import stack
from plan_runs import STRATEGIES, main_of


@pytest.mark.parametrize("start", [0.0, -0.7, 1.2])
def test_the_length_at_a_place_does_not_depend_on_where_a_run_begins(start: float) -> None:
    """Cable on the drum under one tension is longer by its strain times its length."""
    wound = start + 0.5 * np.sin(np.linspace(0, 9, 300))
    assert stack(wound, np.full(300, 2e-3)) == pytest.approx(2e-3 * wound, abs=1e-12)


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
