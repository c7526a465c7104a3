"""Effects of the simulator's physics are found, which is independent of the catalogue.

Every case is the demo's two programmes under two loads, twice; the true values are not used. What
a shipped bench hides is found with its size in test_shipped_benches.py. Those marked as cases of a
campaign are run by ``pytest -m campaign``.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, recorded
from winchkit.catalog import find
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.schema.read import read_profile

PROFILE = read_profile(find("profiles", "bench-spiral"))
HIDDEN = {
    "unbalanced drum": "drum-unbalance",
    "balancer": "spring-balancer",
    "load lever": "load-lever",
    "rippled motor": "torque-ripple",
    "rough place": "friction-at-place",
    "sticky place": "load-friction-at-place",
    "growing drag": "friction-growth",
    "leaking current": "cell-crosstalk",
}
OUTSIDE = ("five-cornered drum",)
"""tests/cli/model/test_unknown_effect.py has it in ``.ci/run``."""
SHORT = {"unbalanced drum"}
"""In ``.ci/run``; the others belong to the campaign."""
CASES = [pytest.param(name, marks=() if name in SHORT else pytest.mark.campaign) for name in HIDDEN]


@cache
def answer(physics: str = "none") -> Diagnosis:
    return diagnose(recorded(physics), PROFILE, CATALOGUE).diagnosis


@pytest.mark.parametrize("physics", CASES)
def test_what_is_hidden_is_named_first(physics: str) -> None:
    found = answer(physics)
    assert found.verdict == "explained"
    assert HIDDEN[physics] in found.steps[0].effects
    assert len(found.steps) == 1
    assert len(found.steps[0].effects) <= 3
    for output in found.outputs.values():
        assert output.noise_rms is not None
        assert output.heldout_rms_after < 1.3 * output.noise_rms
        assert output.heldout_rms_after <= 1.02 * output.heldout_rms_before
    assert found.candidates[0].score > 0
    assert found.unexplained_share < 0.1


def test_of_nothing_hidden_nothing_is_named() -> None:
    found = answer()
    assert found.verdict == "adequate"
    assert found.steps == ()
    assert found.next_runs == ()
    assert found.unexplained_share == 0.0
    for output in found.outputs.values():
        assert output.noise_rms is not None
        assert output.rms_before == pytest.approx(output.noise_rms, rel=0.1)


def test_an_adequate_model_comes_with_what_would_have_been_seen() -> None:
    """What was hidden elsewhere, and found, is above the size said to be the smallest seen."""
    smallest = {item.effect: item for item in answer().detectable}
    assert smallest["cell-gain"].smallest < 0.02
    assert smallest["motor-coulomb"].smallest < 0.03
    assert smallest["cable-elongation-linear"].smallest > 250e3
    sizes = [item.smallest for item in smallest.values()]
    assert np.mean(np.isfinite(sizes)) > 0.7
    for effect, item in smallest.items():
        if np.isfinite(item.smallest):
            parameter = CATALOGUE[effect].parameter(item.parameter)
            assert parameter.low <= item.smallest <= parameter.high


@pytest.mark.campaign
@pytest.mark.parametrize("physics", OUTSIDE)
def test_of_what_no_effect_describes_nothing_is_named(physics: str) -> None:
    found = answer(physics)
    assert found.verdict in {"unknown", "partly"}
    assert found.steps == ()
    assert found.unexplained_share > 0
    assert found.where
    assert found.where == tuple(sorted(found.where, key=lambda where: -where.share))
