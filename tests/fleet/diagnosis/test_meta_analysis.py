"""What several winches have in common: means, agreement, and who has an effect alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest

from diagnosis_runs import CATALOGUE
from winchkit.diagnosis.results import Detectable, Diagnosis, Estimate, Place, Step
from winchkit.fleet.diagnosis.meta_analysis import alarms, pooled, shared_effects
from winchkit.fleet.report.comparison import effect_text, shared_effects_text

NAMES = "ABCDEFGH"
RUBS = "motor-coulomb"
STRETCHES = "cable-elongation-linear"
Sizes = Mapping[str, tuple[float, float]]


def step(effects: Sequence[str], **values: tuple[float, float]) -> Step:
    parameters = {n: Estimate(v, s, "N m") for n, (v, s) in values.items()}
    return Step(tuple(effects), {effects[0]: parameters}, 0.5)


def said(*steps: Step, verdict: str = "", smallest: float = 0.01) -> Diagnosis:
    shown = (Detectable(RUBS, "torque", smallest, "N m"),)
    told = verdict or ("explained" if steps else "adequate")
    return Diagnosis(told, {}, steps, (), shown, 0.0, (), ())  # type: ignore[arg-type]


def of(sizes: Sequence[float], std: float = 0.01) -> dict[str, tuple[float, float]]:
    return {name: (size, std) for name, size in zip(NAMES, sizes, strict=False)}


def test_the_mean_weighs_by_uncertainty() -> None:
    one = pooled({"A": (1.0, 0.1), "B": (1.2, 0.2)}, "N", reciprocal=False)
    assert one.value == pytest.approx((1.0 * 100 + 1.2 * 25) / 125)
    assert one.std == pytest.approx(1 / np.sqrt(125))
    assert one.chi_square == pytest.approx(0.2**2 / (0.1**2 + 0.2**2))
    assert one.spread == 0.0
    assert one.homogeneous


def test_stiffnesses_are_pooled_as_compliances() -> None:
    one = pooled({"A": (100.0, 1.0), "B": (200.0, 4.0)}, "N", reciprocal=True)
    same = pooled({"A": (0.01, 1e-4), "B": (0.005, 1e-4)}, "1/N", reciprocal=False)
    assert one.value == pytest.approx(1 / same.value)
    assert one.std == pytest.approx(same.std / same.value**2)


def test_winches_of_one_size_differ_as_often_as_is_said() -> None:
    random = np.random.default_rng(3)
    stds = np.array([0.1, 0.2, 0.3, 0.1, 0.4, 0.2, 0.1, 0.2])
    chances = []
    for _ in range(1500):
        values = 5 + stds * random.standard_normal(8)
        told = dict(zip(NAMES, zip(values, stds, strict=True), strict=True))
        chances.append(pooled(told, "N", reciprocal=False).p_value)
    assert kstest(chances, "uniform").pvalue > 0.01


def test_the_spread_between_winches_is_found() -> None:
    random = np.random.default_rng(4)
    found = []
    for _ in range(400):
        values = 5 + np.hypot(0.5, 0.02) * random.standard_normal(8)
        found.append(pooled(of(values, 0.02), "N", reciprocal=False))
    # Seven of eight seldom agree by chance where all differ.
    assert np.mean([bool(one.outlying) for one in found]) < 0.01
    assert not any(one.homogeneous for one in found)
    assert np.mean([one.spread**2 for one in found]) == pytest.approx(0.5**2, rel=0.1)
    # The mean is as sure as the spread lets it be; Student's seven degrees of freedom make
    # 8.6 % lie beyond two deviations.
    off = np.array([(one.value - 5) / one.std for one in found])
    assert np.mean(np.abs(off) > 2) == pytest.approx(0.086, abs=0.04)


@pytest.mark.parametrize(
    ("sizes", "outlying", "homogeneous"),
    [
        ((1.0, 1.01, 0.99, 1.0, 1.0, 1.01, 0.99, 1.0), (), True),
        ((1.0, 1.01, 0.99, 1.0, 1.0, 1.01, 0.99, 2.0), ("H",), False),
        ((1.0, 1.5, 0.99, 1.0, 1.01, 1.01, 0.99, 2.0), ("B", "H"), False),
        ((1.0, 1.5, 0.99, 1.0, 0.2, 1.01, 0.99, 2.0), (), False),
        ((1.0, 2.0, 0.99), ("B",), False),
        ((1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0), (), False),
        ((1.0, 2.0), (), False),
        ((1.0,), (), True),
    ],
    ids=["alike", "one", "two of eight", "three of eight", "one of three", "all", "two", "single"],
)
def test_outlying_winches_are_named(
    sizes: Sequence[float], outlying: tuple[str, ...], homogeneous: bool
) -> None:
    one = pooled(of(sizes), "N", reciprocal=False)
    assert one.outlying == outlying
    assert one.homogeneous is homogeneous
    if outlying:
        assert one.value == pytest.approx(1.0, abs=0.02)
        assert one.std < 0.01


@given(
    st.lists(
        st.tuples(st.floats(-5, 5), st.floats(0.01, 2.0)), min_size=1, max_size=8, unique=True
    ),
    st.floats(0.1, 100),
)
def test_units_change_nothing(told: list[tuple[float, float]], scale: float) -> None:
    one = pooled(dict(zip(NAMES, told, strict=False)), "m", reciprocal=False)
    finer = {n: (v * scale, s * scale) for n, (v, s) in zip(NAMES, told, strict=False)}
    other = pooled(finer, "mm", reciprocal=False)
    assert min(v for v, _ in told) - 1e-9 <= one.value <= max(v for v, _ in told) + 1e-9
    if one.outlying == other.outlying:  # but for a tie that rounding decides
        assert other.value == pytest.approx(one.value * scale, rel=1e-6, abs=1e-6 * scale)
        assert other.chi_square == pytest.approx(one.chi_square, rel=1e-6, abs=1e-9)


def test_one_alone_is_named_with_who_would_have_shown_it() -> None:
    rubs = step([RUBS], torque=(0.08, 0.001))
    found = {
        "A": said(),
        "B": said(smallest=0.2),
        "C": said(smallest=float("nan")),
        "D": said(verdict="unknown"),
        "H": said(rubs),
    }
    (one,) = shared_effects(found, CATALOGUE)
    assert one.effects == (RUBS,)
    assert one.winches == ("H",)
    assert one.without == ("A",)
    assert one.unsure == ("B", "C", "D")
    assert one.parameters["torque"].value == 0.08
    assert "at least in H: torque = 80.0 ± 1.0 mN m" in effect_text(one)
    assert "not decidable in B, C and D with these runs" in effect_text(one)


def test_a_weaker_stiffness_is_the_larger_effect() -> None:
    found = {
        "A": said(step([STRETCHES], axial_stiffness=(1e5, 1e3))),
        "B": Diagnosis(
            "adequate", {}, (), (), (Detectable(STRETCHES, "axial_stiffness", 1e6, "N"),),
            0.0, (), (),
        ),
        "C": Diagnosis(
            "adequate", {}, (), (), (Detectable(STRETCHES, "axial_stiffness", 1e4, "N"),),
            0.0, (), (),
        ),
    }  # fmt: skip
    (one,) = shared_effects(found, CATALOGUE)
    assert one.without == ("B",)
    assert one.unsure == ("C",)


def test_who_has_it_by_another_law_is_not_without_it() -> None:
    shown = (Detectable(STRETCHES, "axial_stiffness", 1e6, "N"),)
    bends = step(["cable-elongation-exponential"], strain_scale=(1e-3, 1e-5))
    found = {
        "A": said(step([STRETCHES], axial_stiffness=(1e5, 1e3))),
        "B": Diagnosis("explained", {}, (bends,), (), shown, 0.0, (), ()),
        "C": Diagnosis("adequate", {}, (), (), shown, 0.0, (), ()),
    }
    one = next(e for e in shared_effects(found, CATALOGUE) if e.effects == (STRETCHES,))
    assert one.without == ("C",)
    assert one.unsure == ("B",)


def test_a_common_effect_narrows_each_equivalence_set() -> None:
    found = {
        "A": said(step(["drum-radius", "gear-ratio"], radius_error=(1e-3, 1e-5))),
        "B": said(step(["gear-ratio"], ratio_error=(0.02, 1e-4))),
        "C": said(step(["drum-radius", "gear-ratio"], radius_error=(1e-3, 1e-5))),
    }
    (one,) = shared_effects(found, CATALOGUE)
    assert one.effects == ("gear-ratio",)
    assert one.winches == ("A", "B", "C")
    # Only B knows its size.
    assert one.parameters["ratio_error"].degrees_of_freedom == 0


def test_cogging_of_two_orders_is_two_effects() -> None:
    def cogs(order: float) -> Step:
        return step(
            ["motor-cogging"], amplitude=(0.02, 0.001), phase=(1.0, 0.1), order=(order, 0.0)
        )

    found = {"A": said(cogs(4.0), cogs(12.0)), "B": said(cogs(12.0))}
    both, alone = shared_effects(found, CATALOGUE)
    assert both.winches == ("A", "B")
    assert both.parameters["order"].value == 12.0
    assert alone.winches == ("A",)
    assert alone.parameters["order"].value == 4.0
    assert set(both.parameters) == {"amplitude", "order"}
    assert "order 12" in effect_text(both)


def test_text_reports_each_winch_in_a_line_and_then_what_is_common() -> None:
    found = {name: said(step([RUBS], torque=(0.08 + 0.02 * (name == "H"), 1e-4))) for name in NAMES}
    text = shared_effects_text(found, shared_effects(found, CATALOGUE), {})
    lines = text.splitlines()
    assert lines[0] == "all 8 winches"
    assert [line.split()[0] for line in lines[1:9]] == list(NAMES)
    assert "in all 8, equal in size except H" in " ".join(text.split())
    assert max(map(len, lines)) <= 80


def test_nothing_is_shared_where_nothing_was_found() -> None:
    found = {name: said() for name in NAMES}
    assert shared_effects(found, CATALOGUE) == ()
    assert "residual at the noise floor" in shared_effects_text(found, (), {})


def test_as_json() -> None:
    (one,) = shared_effects({"A": said(step([RUBS], torque=(0.08, 0.001)))}, CATALOGUE)
    told = one.to_json()
    assert set(told) == {
        "effects", "place", "by_place", "winches", "without", "unsure", "parameters",
    }  # fmt: skip
    keys = {"apart" if name == "outlying" else name for name in vars(one.parameters["torque"])}
    assert set(told["parameters"]["torque"]) == keys


def test_an_alarm_of_one_of_eight_is_eight_times_as_likely() -> None:
    found = {name: said() for name in NAMES} | {"E": said(verdict="unknown")}
    random = np.random.default_rng(5)
    chances = dict.fromkeys(NAMES, 0.5) | {"E": 0.01}
    told = alarms(found, chances)
    noise = random.uniform(size=(20_000, len(NAMES))).min(axis=1)
    assert told == {"E": pytest.approx(np.mean(noise < 0.01), abs=0.006)}
    lines = shared_effects_text(found, (), told).splitlines()
    assert "false alarm of one in 8 winches: 7.7 % of recordings" in " ".join(
        " ".join(lines).split()
    )
    # A named effect is not an alarm, and without repeats there is no probability.
    named = said(step([RUBS], torque=(0.08, 0.001)), verdict="partly")
    assert alarms({"A": named, "B": said(verdict="unknown")}, {"A": 0.01, "B": np.nan}) == {}


def at_motor(effect: str, *, certain: bool) -> Step:
    place = (Place("motor", "motor_torque", "direction"),)
    return replace(step([effect], torque=(0.08, 0.001)), place=place, certain=certain)


def test_steps_that_are_not_certain_are_followed_by_place() -> None:
    found = {
        "A": said(at_motor(RUBS, certain=False)),
        "B": said(at_motor("motor-dahl", certain=False)),
        "C": said(at_motor("motor-dahl", certain=False)),
    }
    (one,) = shared_effects(found, CATALOGUE)
    assert one.winches == ("A", "B", "C")
    assert one.by_place
    assert one.effects == ("motor-dahl",), "the most frequent name"
    assert effect_text(one).startswith(
        "effects of the motor on the motor torque over the direction, most often motor-dahl: "
    )


def test_certain_steps_are_followed_by_name() -> None:
    found = {
        "A": said(at_motor(RUBS, certain=True)),
        "B": said(at_motor("motor-dahl", certain=True)),
    }
    named = shared_effects(found, CATALOGUE)
    assert sorted((one.effects, one.winches) for one in named) == [
        ((RUBS,), ("A",)), (("motor-dahl",), ("B",)),
    ]  # fmt: skip


def test_a_set_that_allows_a_certain_name_joins_it() -> None:
    either = replace(at_motor("motor-dahl", certain=False), effects=("motor-dahl", RUBS))
    either = replace(either, parameters={RUBS: {"torque": Estimate(0.08, 0.001, "N m")}})
    found = {name: said(at_motor(RUBS, certain=True)) for name in "AB"} | {"C": said(either)}
    (one,) = shared_effects(found, CATALOGUE)
    assert (one.effects, one.winches, one.by_place) == ((RUBS,), ("A", "B", "C"), False)


@pytest.mark.parametrize("verdict", ["partly", "unknown", "undecided"])
def test_only_a_decided_verdict_excludes_an_effect(verdict: str) -> None:
    found = {"A": said(at_motor(RUBS, certain=True)), "B": said(verdict=verdict)}
    (one,) = shared_effects(found, CATALOGUE)
    assert (one.without, one.unsure) == ((), ("B",))
    assert set(alarms(found, {"A": 0.01, "B": 0.02})) == {"B"}
