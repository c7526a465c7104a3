"""A miniature of benchmarks/diagnosis_campaign.py --winches: several winches in one recording."""

from pathlib import Path

from campaign.case import Plan
from campaign.several_score import SeveralScore, answer_several, make_several, several_summary

WINCHES = 2


def answered(extent: str, effect: str, seed: int, folder: Path) -> SeveralScore:
    case = make_several(seed, extent, Plan("single", 3.0, (effect,), small=True), WINCHES, folder)
    assert case is not None
    return answer_several(case)


def test_what_one_winch_hides_is_named_there_and_alone(tmp_path: Path) -> None:
    score = answered("one", "motor-coulomb", 417, tmp_path)
    assert len(score.there) == 1
    assert score.found == score.there
    assert score.alarms == score.wrong == []
    (shared,) = score.shared
    assert shared["winches"] == score.there
    assert sorted(shared["without"]) == score.elsewhere


def test_what_all_winches_hide_is_common_and_alike(tmp_path: Path) -> None:
    score = answered("all", "cable-elongation-linear", 434, tmp_path)
    assert len(score.there) == WINCHES
    assert score.found == score.there
    (shared,) = score.shared
    assert shared["winches"] == score.there
    assert shared["parameters"]["axial_stiffness"]["p_value"] > 0.01
    assert score.shared_right
    group = several_summary([score])["groups"]["all snr 3"]
    assert group["right"] == group["shared_right"] == group["found_there"] == 1.0
    assert group["alarm_elsewhere"] is None


def test_where_none_hides_anything_nothing_is_shared(tmp_path: Path) -> None:
    score = answered("none", "", 454, tmp_path)
    assert set(score.verdicts.values()) == {"adequate"}
    assert score.shared == ()
    assert score.ok
    assert score.shared_right
