"""A miniature of benchmarks/diagnosis_campaign.py: cases made by another physics than the model."""

from pathlib import Path

import pytest

from campaign.case import Plan
from campaign.logger_case import LoggerPlan, answer, make_logger_case
from campaign.run import run_case
from campaign.sizes import CATALOGUE, RECENT

NOTHING = (101, 102, 103, 104, 105, 106)
ONE = {
    "layer-thickness": 201,
    "drum-eccentricity": 202,
    "frame-compliance": 203,
    "length-time-offset": 204,
    "pulley-coulomb": 205,
    "cell-gain": 206,
    "cell-drift": 207,
    "torque-constant": 208,
    "motor-coulomb": 209,
    "cable-elongation-linear": 210,
}
STRANGE = {"outside-harmonic": 301, "outside-sticky-place": 302, "outside-wander": 303}
NAMED_SINCE = {"outside-crosstalk": 303, "outside-clipping": 304}


@pytest.mark.parametrize("seed", NOTHING)
def test_nothing_hidden_nothing_named(seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("none", 3.0, small=True), tmp_path)
    assert score is not None
    assert score.verdict == "adequate"
    assert score.steps == ()


@pytest.mark.parametrize(("effect", "seed"), ONE.items())
def test_one_effect_is_in_the_first_set(effect: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("single", 3.0, (effect,), small=True), tmp_path)
    assert score is not None
    assert score.verdict == "explained"
    assert effect in score.steps[0]
    assert len(score.steps) == 1


@pytest.mark.parametrize(("kind", "seed"), STRANGE.items())
def test_what_no_effect_explains_gets_no_name(kind: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("outside", 3.0, (kind,), small=True), tmp_path)
    assert score is not None
    assert score.verdict in {"unknown", "partly"}
    assert score.steps == ()


@pytest.mark.parametrize(("kind", "seed"), NAMED_SINCE.items())
def test_what_the_catalogue_has_got_since_is_named(kind: str, seed: int, tmp_path: Path) -> None:
    score = run_case(seed, Plan("outside", 3.0, (kind,), small=True), tmp_path)
    assert score is not None
    assert score.verdict == "explained"
    assert score.found == len(score.steps) == 1


@pytest.mark.parametrize(
    ("kind", "effects", "drawn", "seed"),
    [
        # Its lag is so long that five terms of the wrong sign imitate it better.
        ("single", ("torque-lag",), 42, 2100082),
        # The delay shows in few blocks, but in every group of runs.
        ("pair", (), 42, 2300010),
        # An offset stands for both until the second is there.
        ("pair", (), 42, 2300004),
        # Creep with a tenth of the speed does nearly what a creep and an offset do.
        ("pair", (), 44, 12800032),
        # Coulomb's friction does so for a Stribeck curve and grease, each at another shape.
        ("pair", (), 44, 12700028),
        # Without the loop its rounding is fitted beyond all measure, and the loop from there.
        ("single", ("cell-hysteresis",), 44, 12700062),
        # What an engaging tooth leaves is taken for more than the small loss beside it.
        ("pair", (), 44, 12700044),
        # Its transients of a load exceed its other contribution.
        ("single", ("gear-backlash",), 44, 13100008),
    ],
    ids=[
        "wrong signs",
        "few blocks",
        "one for two",
        "slower",
        "other shape",
        "wild rounding",
        "teeth",
        "jerk",
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
        ("quantised", 90300014, 3.0, "frame-compliance"),
        # One direction at one speed: no run alone separates its weight from friction.
        ("wrong-unit", 90300019, 10.0, "cell-nonlinearity"),
        ("wrong-unit", 90300013, 1.0, "pulley-capstan"),
        ("excerpts", 90400000, 0.0, ""),
        ("gappy", 90400002, 3.0, "motor-coulomb"),
        ("spikes", 90400003, 10.0, "drum-winding-tension"),
    ],
)
def test_runs_of_a_logger_with_a_fault(
    fault: str,
    seed: int,
    snr: float,
    hidden: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Fault and effect are drawn, from as many effects as when the seed was first drawn.
    monkeypatch.setattr("campaign.logger_case.RECENT", RECENT[:8])
    case = make_logger_case(seed, LoggerPlan(snr, small=True), tmp_path)
    assert case is not None
    score = answer(case)
    assert (score.fault, "".join(score.hidden)) == (fault, hidden)
    assert score.identifiable == bool(snr and not score.misread)
    assert score.ok
