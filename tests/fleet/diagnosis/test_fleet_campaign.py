"""The score of benchmarks/fleet_campaign.py, with estimates drawn from what is true."""

from __future__ import annotations

import numpy as np
import pytest

from fleet_campaign import EFFECTS, KINDS, WEEK, Fleet, draw_fleet, score
from winchkit.fleet.diagnosis.sessions import SessionEstimate

SESSIONS = 24
STD = dict(zip(EFFECTS, (1e-3, 0.15, 9e-8, 3e-4, 2e-6), strict=True))


def drawn(fleet: Fleet, seed: int) -> list[SessionEstimate]:
    """Estimates without a model: true values, the error of the profile, and noise."""
    random, out = np.random.default_rng(seed), []
    for session in fleet.sessions:
        for kind in KINDS:
            value = session.values[kind.effect] + random.normal(0.0, STD[kind.effect])
            if kind.effect == "drum-radius":
                value += session.true_radius - session.radius
            time, std = WEEK * session.number, STD[kind.effect]
            out.append(
                SessionEstimate(
                    session.winch, time, kind.effect, "size", float(value), std, "1", (1.0, 0.0)
                )
            )
    return out


@pytest.fixture(scope="module")
def result() -> dict[str, object]:
    fleet = draw_fleet(24, SESSIONS, 2, STD)
    return score(fleet, drawn(fleet, 3), SESSIONS)


def test_steps_of_five_standard_deviations_are_named_and_dated(result: dict[str, dict]) -> None:
    for size in ("5", "10"):
        assert result["steps"][size] >= 2
        assert result["steps_dated"][size] == result["steps_named"][size] == result["steps"][size]


def test_nothing_else_is_found(result: dict[str, object]) -> None:
    assert (result["false_trends"], result["odd_false"], result["swapped_false"]) == (0, 0, 0)


def test_odd_winches_and_exchanged_profiles_are_found(result: dict[str, object]) -> None:
    assert result["odd_found"] == result["odd"] == 3
    assert result["swapped_found"] is True


def test_the_creep_is_found_before_it_costs_one_percent(result: dict[str, float]) -> None:
    assert 0.0 < result["creep_found_at"] < result["creep_limit"]
