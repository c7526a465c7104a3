"""The design of benchmarks/constant_screening.py: levels, constants, associations; and the rules of
benchmarks/ablation.py."""

from __future__ import annotations

import pkgutil

import numpy as np
import pytest

from ablation import HOUSE, RULES
from constant_screening import associations, rules_of_thumb, scaled, set_constants, value_of
from winchkit.diagnosis.selection import acceptance
from winchkit.diagnosis.verdict import laws

RELEVANT = ("selection/acceptance.py", "RELEVANT_RATIO")


@pytest.mark.parametrize(
    ("value", "up", "down"),
    [
        (0.02, 0.03, 0.02 / 1.5),
        (40.0, 60.0, 40 / 1.5),
        (0.98, 0.97, 1 - 0.02 / 1.5),
        (1.1, 1.15, 1 + 0.1 / 1.5),
        (8, 12, 5),
        (1, 2, 1),
        ((6, 12), (9, 18), (4, 8)),
    ],
)
def test_levels_lie_to_both_sides_of_a_value(value: object, up: object, down: object) -> None:
    assert scaled(value, 1.5) == pytest.approx(up)
    assert scaled(value, 1 / 1.5) == pytest.approx(down)


def test_the_constants_are_found_and_set_wherever_they_are_imported() -> None:
    names = rules_of_thumb()
    assert len(names) > 30
    assert RELEVANT in names
    usual = {name: value_of(name) for name in names}
    try:
        set_constants({RELEVANT: 0.5})
        assert acceptance.RELEVANT_RATIO == 0.5
        assert laws.RELEVANT_RATIO == 0.5
    finally:
        set_constants(usual)
    assert value_of(RELEVANT) == usual[RELEVANT]


def test_the_constant_that_changes_answers_comes_first() -> None:
    chance = np.random.default_rng(7)
    names = [("a.py", f"_C{n}") for n in range(30)]
    levels = [chance.random(30) < 0.5 for _ in range(12)]
    found = associations(names, levels, [0.4 if upper[17] else 0.05 for upper in levels])
    assert found[0]["constant"] == "a.py _C17"
    assert found[0]["difference"] == pytest.approx(0.35)


@pytest.mark.parametrize("rule", RULES)
def test_every_rule_of_the_ablation_is_a_part_of_the_diagnosis(rule: str) -> None:
    assert all(callable(pkgutil.resolve_name(f"{HOUSE}.{target}")) for target in RULES[rule])
