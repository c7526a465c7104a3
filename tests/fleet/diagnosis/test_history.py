"""A fleet over time: changes, odd winches, the false discovery rate, and fits of sessions."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import pytest

from winchkit.fleet.diagnosis.history import FleetHistory, fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate

DAY = 86400.0
EFFECTS = ("cell-gain", "motor-coulomb")


def fleet(
    random: np.random.Generator,
    winches: int,
    sessions: int,
    changes: dict[tuple[int, str], np.ndarray] | None = None,
    correlation: float = 0.6,
) -> list[SessionEstimate]:
    """Estimates with a session effect, correlated within a fit; levels differ between winches."""
    covariance = np.array([[1.0, correlation], [correlation, 1.0]])
    out = []
    for winch in range(winches):
        level = random.normal(0.0, 2.0, 2)
        for session in range(sessions):
            values = level + random.multivariate_normal(np.zeros(2), covariance)
            values = values + random.normal(0.0, 0.5, 2)
            for index, effect in enumerate(EFFECTS):
                moved = (changes or {}).get((winch, effect), np.zeros(sessions))[session]
                out.append(
                    SessionEstimate(
                        f"W{winch:03}",
                        DAY * session,
                        effect,
                        "size",
                        float(values[index] + moved),
                        1.0,
                        "N",
                        tuple(covariance[index]),
                        {"tension": 0.5},
                    )
                )
    return out


def names(history: FleetHistory) -> set[tuple[str, str]]:
    return {(winch.winch, parameter.effect) for parameter, winch in history.changed}


def test_steps_are_named_dated_and_costed() -> None:
    random = np.random.default_rng(1)
    step = np.where(np.arange(24) < 10, 0.0, 6.0)
    history = fleet_history(fleet(random, 20, 24, {(4, "cell-gain"): step}))
    assert names(history) == {("W004", "cell-gain")}
    ((_, winch),) = history.changed
    assert winch.kind == "step"
    assert winch.change is not None
    assert winch.change.date is not None
    assert 8 * DAY <= winch.change.date.date <= 11 * DAY
    assert winch.cost["tension"] == pytest.approx(3.0, abs=1.0)
    assert history.procedure == "Benjamini-Yekutieli"
    json.dumps(history.to_json())


def test_false_changes_are_at_most_one_per_thousand_winch_effects() -> None:
    random = np.random.default_rng(2)
    false = sum(len(fleet_history(fleet(random, 50, 16)).changed) for _ in range(10))
    assert false <= 1


def test_the_false_discovery_rate_is_held_beside_true_changes() -> None:
    random = np.random.default_rng(3)
    step = np.where(np.arange(16) < 8, 0.0, 5.0)
    truth = {(winch, "cell-gain"): step for winch in range(10)}
    shares, found = [], 0
    for _ in range(8):
        got = names(fleet_history(fleet(random, 40, 16, truth)))
        right = {(f"W{winch:03}", effect) for winch, effect in truth}
        shares.append(len(got - right) / max(len(got), 1))
        found += len(got & right)
    assert np.mean(shares) <= 0.02
    assert found >= 0.95 * 80


def test_an_odd_winch_is_found_and_keeps_its_own_estimate() -> None:
    random = np.random.default_rng(4)
    odd = {(7, "motor-coulomb"): np.full(12, 30.0)}
    history = fleet_history(fleet(random, 20, 12, odd))
    ((parameter, winch),) = history.odd
    assert (parameter.effect, winch.winch) == ("motor-coulomb", "W007")
    assert winch.value == pytest.approx(30.0, abs=7.0)
    assert abs(winch.pooled - parameter.common) <= abs(winch.value - parameter.common)
    assert not winch.changed


def test_one_parameter_per_fit_takes_the_independent_procedure() -> None:
    random = np.random.default_rng(5)
    alone = [e for e in fleet(random, 6, 8) if e.effect == "cell-gain"]
    alone = [SessionEstimate(**{**vars(e), "covariance": ()}) for e in alone]
    assert fleet_history(alone).procedure == "Benjamini-Hochberg"


def test_undetermined_estimates_are_counted_and_left_out() -> None:
    random = np.random.default_rng(6)
    known = fleet(random, 5, 6)
    lost = [SessionEstimate(**{**vars(known[0]), "std": float("nan")})]
    assert fleet_history([*known[1:], *lost]).undetermined == 1
    empty: Sequence[SessionEstimate] = []
    assert fleet_history(empty).parameters == ()


def test_a_trend_has_the_date_of_its_limit() -> None:
    random = np.random.default_rng(7)
    creep = {(2, "cell-gain"): 0.8 * np.arange(24)}
    history = fleet_history(fleet(random, 12, 24, creep), {("cell-gain", "size"): 40.0})
    ((_, winch),) = history.changed
    assert winch.kind == "trend"
    assert winch.limit is not None
    assert winch.limit.earliest < winch.limit.date < winch.limit.latest
    assert not winch.is_beyond_limit


def test_a_step_has_no_date_of_a_limit_but_may_be_beyond_it() -> None:
    random = np.random.default_rng(8)
    step = {(2, "cell-gain"): np.where(np.arange(24) < 12, 0.0, 20.0)}
    history = fleet_history(fleet(random, 12, 24, step), {("cell-gain", "size"): 12.0})
    ((_, winch),) = history.beyond_limit
    assert (winch.winch, winch.changed, winch.kind, winch.limit) == ("W002", True, "step", None)
    told = [each.to_json()["beyond_limit"] for p in history.parameters for each in p.winches]
    assert told == [w == 2 for w in range(12)] + [None] * 12
