"""benchmarks/robot_diagnosis.py counts what it says it counts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from robot_diagnosis import added, covered, right, wrong
from robot_poses.cases import CASES

BY_NAME = {case.name: case for case in CASES}
UNSURE = "an effect outside the catalogue cannot be excluded"


def found(verdict: str, *sets: dict[str, list[str | None]], **more: Any) -> dict[str, Any]:
    steps = [{"lines": lines, "parameters": {}, "whole": False, "certain": True} for lines in sets]
    return {"verdict": verdict, "steps": steps, "notes": [], **more}


def test_a_set_with_the_truth_is_right_and_another_certain_effect_is_wrong() -> None:
    case = BY_NAME["exit point"]
    assert right(case, found("explained", {"exit-point": ["3"]}))
    assert right(case, found("explained", {"exit-point": ["3"], "anchor-point": ["3"]}))
    other = found("explained", {"exit-point": ["4"]})
    assert not right(case, other)
    assert wrong(case, other) == ["exit-point/4"]
    other["steps"][0]["certain"] = False
    assert not right(case, other)
    assert wrong(case, other) == []
    assert not right(case, found("explained", {"exit-point": ["3"]}, {"payload-mass": [None]}))
    assert not right(case, found("unknown"))


def test_both_of_two_must_be_found_but_one_name_of_the_same_thing_is_enough() -> None:
    pair = BY_NAME["elastic, exit point"]
    rope: dict[str, list[str | None]] = {"cable-elongation-linear": [None]}
    assert not right(pair, found("explained", rope))
    assert right(pair, found("explained", rope, {"exit-point": ["3"]}))
    assert right(BY_NAME["drum radius"], found("explained", {"gear-ratio": ["2"]}))


def test_outside_the_catalogue_nothing_is_certain_and_no_finding_needs_missing_repeats() -> None:
    waves, alone = BY_NAME["outside: waves"], BY_NAME["outside: waves, no repeats"]
    assert right(waves, found("unknown"))
    assert not right(waves, found("adequate", notes=[UNSURE]))
    assert right(alone, found("adequate", notes=[UNSURE]))
    assert not right(alone, found("explained", {"exit-point": ["1"]}, notes=[UNSURE]))
    doubted = found("partly", {"exit-point": ["1"]})
    assert not right(waves, doubted)
    doubted["steps"][0]["certain"] = False
    assert right(waves, doubted)
    whole = found("explained", {"exit-point": [None], "anchor-point": [None]})
    whole["steps"][0] |= {"whole": True, "certain": False}
    assert not right(waves, whole)
    assert right(BY_NAME["outside: tracker's metre"], whole)


def test_an_interval_holds_the_truth_or_does_not() -> None:
    case = BY_NAME["payload mass"]
    step = found("explained", {"payload-mass": [None]})
    for ends, held in (((0.2, 0.3), True), ((0.26, 0.3), False)):
        step["steps"][0]["parameters"] = {"payload-mass": {"mass_error": {"interval": ends}}}
        assert covered(case, step) == {"payload-mass.mass_error": held}


@pytest.mark.campaign
def test_the_interval_of_an_addition_has_the_same_name(tmp_path: Path) -> None:
    assert set(added(BY_NAME["payload mass"], 1, tmp_path)) == {"payload-mass.mass_error"}
