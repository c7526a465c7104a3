"""A miniature of benchmarks/diagnosis_campaign.py: cases made by another physics than the model.

Those marked as cases of a campaign are run by ``pytest -m campaign``.
"""

from pathlib import Path

import pytest

from campaign.case import Plan
from campaign.logger_case import LoggerPlan, answer, make_logger_case
from campaign.run import run_case
from campaign.sizes import CATALOGUE, RECENT

CAMPAIGN = pytest.mark.campaign
NOTHING = (101, *(pytest.param(seed, marks=CAMPAIGN) for seed in range(102, 107)))
ONE = (
    # What no shipped bench hides (test_shipped_benches.py finds that); the others are a campaign.
    ("cell-drift", 207),
    ("length-gain", 211),
    ("load-gain", 212),
    pytest.param("layer-thickness", 201, marks=CAMPAIGN),
    pytest.param("drum-eccentricity", 202, marks=CAMPAIGN),
    pytest.param("frame-compliance", 203, marks=CAMPAIGN),
    pytest.param("length-time-offset", 204, marks=CAMPAIGN),
    pytest.param("pulley-coulomb", 205, marks=CAMPAIGN),
    pytest.param("cell-gain", 206, marks=CAMPAIGN),
    pytest.param("torque-constant", 208, marks=CAMPAIGN),
    pytest.param("motor-coulomb", 209, marks=CAMPAIGN),
    pytest.param("cable-elongation-linear", 210, marks=CAMPAIGN),
)
STRANGE = (
    ("outside-harmonic", 301),
    pytest.param("outside-wander", 303, marks=CAMPAIGN),
)
NAMED_SINCE = (
    ("outside-crosstalk", 303),
    pytest.param("outside-clipping", 304, marks=CAMPAIGN),
    pytest.param("outside-sticky-place", 302, marks=CAMPAIGN),
)


@pytest.mark.parametrize("seed", NOTHING)
def test_nothing_hidden_nothing_named(seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("none", 3.0, small=True), tmp_path)
    assert score is not None
    assert score.verdict == "adequate"
    assert score.steps == ()


@pytest.mark.parametrize(("effect", "seed"), ONE)
def test_one_effect_is_in_the_first_set(effect: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("single", 3.0, (effect,), small=True), tmp_path)
    assert score is not None
    assert score.verdict == "explained"
    assert effect in score.steps[0]
    assert len(score.steps) == 1


@pytest.mark.parametrize(("kind", "seed"), STRANGE)
def test_what_no_effect_explains_gets_no_name(kind: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("outside", 3.0, (kind,), small=True), tmp_path)
    assert score is not None
    assert score.verdict in {"unknown", "partly"}
    assert score.steps == ()


@pytest.mark.parametrize(("kind", "seed"), NAMED_SINCE)
def test_what_the_catalogue_has_got_since_is_named(kind: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("outside", 3.0, (kind,), small=True), tmp_path)
    assert score is not None
    assert score.verdict == "explained"
    assert score.found == len(score.steps) == 1


@pytest.mark.parametrize(
    ("kind", "effects", "drawn", "seed"),
    [
        # The delay shows in few blocks, but in every group of runs.
        pytest.param("pair", (), 42, 2300010, id="few blocks"),
        # An offset stands for both until the second is there.
        pytest.param("pair", (), 42, 2300004, id="one for two", marks=CAMPAIGN),
        # Creep with a tenth of the speed does nearly what a creep and an offset do.
        pytest.param("pair", (), 44, 12800032, id="slower", marks=CAMPAIGN),
        # Coulomb's friction does so for a Stribeck curve and grease, each at another shape.
        pytest.param(
            "pair",
            (),
            44,
            12700028,
            id="other shape",
            marks=[
                CAMPAIGN,
                pytest.mark.xfail(
                    reason="since the torque's low-pass follows the data the viscous part is not "
                    "found"
                ),
            ],
        ),
        # Without the loop its rounding is fitted beyond all measure, and the loop from there.
        pytest.param(
            "single", ("cell-hysteresis",), 44, 12700062, id="wild rounding", marks=CAMPAIGN
        ),
        # What an engaging tooth leaves is taken for more than the small loss beside it.
        pytest.param("pair", (), 44, 12700044, id="teeth", marks=CAMPAIGN),
        # Its transients of a load exceed its other contribution.
        pytest.param("single", ("gear-backlash",), 44, 13100008, id="jerk", marks=CAMPAIGN),
    ],
)
def test_what_searches_once_missed(
    kind: str,
    effects: tuple[str, ...],
    drawn: int,
    seed: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # A seed means the same effects only while as many are drawn from.
    monkeypatch.setattr("campaign.case.CATALOGUE", CATALOGUE[:drawn])
    score = run_case(seed, Plan(kind, 1.0, effects, small=True), tmp_path)
    assert score is not None
    assert score.verdict == "explained"
    assert score.found == len(score.truth) == len(score.steps)


@pytest.mark.parametrize(
    ("fault", "seed", "snr", "hidden"),
    [
        # Rounded to several times the noise: the error follows the signal, as repeats do.
        ("quantised", 90300004, 0.0, ""),
        pytest.param("quantised", 90300014, 3.0, "frame-compliance", marks=CAMPAIGN),
        # One direction at one speed: no run alone separates its weight from friction.
        ("wrong-unit", 90300019, 10.0, "cell-nonlinearity"),
        pytest.param("wrong-unit", 90300013, 1.0, "pulley-capstan", marks=CAMPAIGN),
        ("excerpts", 90400000, 0.0, ""),
        ("gappy", 90400002, 3.0, "motor-coulomb"),
        ("spikes", 90400003, 10.0, "drum-winding-tension"),
    ],
)
def test_runs_of_a_logger_with_a_fault(
    fault: str, seed: int, snr: float, hidden: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Fault and effect are drawn, from as many effects as when the seed was first drawn.
    monkeypatch.setattr("campaign.logger_case.RECENT", RECENT[:8])
    case = make_logger_case(seed, LoggerPlan(snr, small=True), tmp_path)
    assert case is not None
    score = answer(case)
    assert (score.fault, "".join(score.hidden)) == (fault, hidden)
    assert score.identifiable == bool(snr and not score.misread)
    assert score.ok
