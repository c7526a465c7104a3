"""A step in words: effect, values, the error that it lowers most, share and doubts."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import pytest

from report_answers import AT_NOISE, ELASTIC, FRICTION, NOISY, OPEN, REFITTED, diagnosis_of
from winchkit.diagnosis.results import Doubt, Estimate, Place, Step
from winchkit.report.text import step_lines
from winchkit.report.words.sentence import changes_text, headline, sentence
from winchkit.report.words.steps import (
    alike,
    cause,
    doubt_texts,
    lowered_most,
    named_only,
    reported_steps,
    step_text,
    step_title,
)

OUTPUTS = {"cable_length": NOISY, "tension": AT_NOISE}


def test_a_step_has_value_error_without_and_with_it_and_share() -> None:
    after = {"cable_length": 0.36e-3, "tension": 1.0}
    fall = {"cable_length": 1.5e-3, "tension": 1.0}, after
    text = step_text(replace(ELASTIC, share=0.99), OUTPUTS, fall)
    assert text == (
        "the cable is elastic: EA = 249.9 ± 7.0 kN; cable length 1.50 → 0.360 mm; explains 99 %"
    )


def test_beside_an_output_far_off_the_share_of_the_one_that_falls_is_given() -> None:
    outputs = OUTPUTS | {"tension": replace(AT_NOISE, heldout_rms_before=5e3)}
    before = {"cable_length": NOISY.heldout_rms_before, "tension": 5e3}
    after = before | {"cable_length": NOISY.noise_rms or 0.0}
    text = step_text(replace(ELASTIC, share=1e-5), outputs, (before, after))
    assert text.endswith("explains 100 % of its excess, under 0.1 % of all")


def test_a_home_pose_that_explains_as_much_comes_before_a_law_of_the_cable() -> None:
    step = replace(ELASTIC, law="open", doubts=(Doubt("home", "alone"),))
    assert step_text(step) == (
        "the home pose of the robot is not that of the profile, or the cable is elastic"
    )
    assert changes_text(diagnosis_of("explained", step)).startswith("Calibrate the robot first")


def test_of_laws_that_overlap_the_first_explains_most_and_comes_first() -> None:
    """Friction and viscosity at one speed: each beside the other explains little."""
    first = replace(ELASTIC, share=0.03, explains=0.9)
    second = replace(FRICTION, share=0.06, explains=0.07)
    found = diagnosis_of("explained", first, second)
    assert reported_steps(found) == [0, 1]
    assert [line for line in step_lines(found) if "explains 90 %" in line]
    value = replace(REFITTED, share=0.4)
    assert reported_steps(diagnosis_of("explained", value, second, first)) == [0, 1, 2]
    assert reported_steps(diagnosis_of("explained", value, first, second)) == [1, 0, 2]


def test_a_step_that_lowers_no_error_shows_none() -> None:
    same = {name: output.heldout_rms_after for name, output in OUTPUTS.items()}
    assert lowered_most((same, same)) == ""
    assert "→" not in step_text(ELASTIC, OUTPUTS, (same, same))
    assert "explains" not in step_text(ELASTIC), "an unknown share is no figure"


@pytest.mark.parametrize("unit", ["cable_length", "tension"])
def test_the_output_is_the_one_whose_error_rises_most_without_the_step(unit: str) -> None:
    after = {name: output.heldout_rms_after for name, output in OUTPUTS.items()}
    assert lowered_most((after | {unit: 2 * after[unit]}, after)) == unit


def test_a_set_has_the_values_of_every_kind() -> None:
    assert step_text(FRICTION).startswith(
        "the pulleys have Coulomb friction (friction = 0.01500 ± 0.00010) or the cable slides "
        "around a blocked pulley (capstan friction) (friction = 0.0138)"
    )


def test_the_orders_of_a_series_have_one_unit() -> None:
    values = {
        "amplitude": Estimate(1.2413e-3, 6.8e-6, "N m"),
        "order": Estimate(12.0, 0.0, "1"),
        "amplitude_2": Estimate(0.0454e-3, 9.4e-6, "N m"),
        "order_2": Estimate(36.0, 0.0, "1"),
    }
    cogging = replace(ELASTIC, effects=("motor-cogging",), parameters={"motor-cogging": values})
    text = step_text(cogging)
    assert "1.2413 ± 0.0068 mN m at order 12, 0.0454 ± 0.0094 mN m at order 36" in text


def test_laws_of_one_kind_are_named_once() -> None:
    laws = ("cable-elongation-linear", "cable-elongation-exponential", "cable-elongation-quartic")
    doubt = Doubt("alternatives", "")
    stretch = replace(ELASTIC, effects=laws, law="open", doubts=(doubt,))
    assert step_text(stretch) == "the cable is elastic: EA = 249.9 ± 7.0 kN"
    assert doubt_texts(stretch) == [
        "these runs cannot distinguish it from exponential elongation of the cable "
        "(cable-elongation-exponential) and quartic elongation of the cable "
        "(cable-elongation-quartic)"
    ]


def test_many_kinds_are_counted() -> None:
    many = replace(
        ELASTIC,
        effects=("cable-elongation-linear", "frame-compliance", "drum-radius", "gear-ratio"),
    )
    assert step_title(many) == "one of 4 effects is missing, which these data cannot distinguish"


def test_signatures_far_apart_are_not_called_indistinguishable() -> None:
    angles = {"pulley-capstan": radians(85.3)}
    apart = replace(FRICTION, angles=angles)
    assert alike(apart) == {}
    assert alike(FRICTION) == {"pulley-capstan": 0.002}
    assert doubt_texts(apart) == [
        "these runs are explained as well by capstan friction at a pulley (pulley-capstan), in "
        "another way"
    ]


def test_a_refitted_value_has_that_of_the_file_in_the_same_unit() -> None:
    assert step_title(REFITTED) == "axial stiffness 250 kN instead of 100 kN in the profile"
    small = replace(REFITTED, file_values={"axial_stiffness": 900.0})
    assert step_text(small) == (
        "elongation of the cable: axial stiffness 249.9 ± 7.0 kN instead of 0.900 kN in the "
        "profile; explains 90 %"
    )


def test_refitted_values_are_counted_apart_from_missing_effects() -> None:
    old, new = replace(REFITTED, effects=("motor-viscous",)), FRICTION
    assert cause([new, old], {}).startswith("the pulleys have Coulomb friction or ")
    assert cause([new, old], {}).endswith("; 1 effect of the profile has other values")
    assert cause([new, new, old, old], {}).startswith(
        "2 effects are missing; first, the pulleys have"
    )


def test_what_explains_most_comes_first_in_the_headline() -> None:
    first = "axial stiffness 250 kN instead of 100 kN in the profile; the pulleys have Coulomb"
    assert cause([REFITTED, FRICTION], {}).startswith(first)


def test_values_that_print_alike_are_left_out_beside_others() -> None:
    moved = _friction_refitted(0.019996, 0.000077, 0.5)
    assert step_title(moved) == (
        "Coulomb friction of the motor: its reversal is rounded over 0.199 rad/s "
        "instead of sharp in the profile"
    )


def test_many_refitted_values_are_counted() -> None:
    assert cause([REFITTED, REFITTED], {}) == (
        "2 effects of the profile have other values; first, axial stiffness 250 kN instead of 100 "
        "kN in the profile"
    )


def test_an_open_law_has_its_place_and_the_closest_law() -> None:
    assert step_title(OPEN) == (
        "the cable changes the cable length over the load by an unknown law; closest: the cable is "
        "elastic"
    )
    assert doubt_texts(OPEN) == [OPEN.doubts[0].text]


def test_a_geometry_is_one_step_without_values() -> None:
    values = {"exit-point": {"x": Estimate(0.1, 0.01, "m")}}
    whole = Step(("exit-point", "anchor-point"), values, 0.9, whole=True)
    assert step_text(whole) == "the geometry of the robot differs as a whole"
    assert alike(whole) == {}


def _friction_refitted(torque: float, std: float, share: float) -> Step:
    """A refit of a Coulomb friction of 20 mN m, whose reversal is rounded in the runs."""
    values = {"torque": Estimate(torque, std, "N m"), "transition": Estimate(0.199, 0.010, "rad/s")}
    old = {"torque": 0.020, "transition": 0.0}
    name = "motor-coulomb"
    return Step((name,), {name: values}, 0.5, share=share, refitted=True, file_values=old)


def test_steps_are_reported_in_the_order_of_what_they_explain() -> None:
    small, large = replace(FRICTION, share=0.2), replace(ELASTIC, share=0.7)
    diagnosis = diagnosis_of("explained", small, large)
    assert reported_steps(diagnosis) == [1, 0]
    assert [step["share"] for step in diagnosis.to_json()["steps"]] == [0.2, 0.7], (
        "the JSON has the order in which the model grew"
    )
    assert "\n".join(step_lines(diagnosis)).index("elastic") < 40
    assert headline(diagnosis).startswith("2 effects are missing; first, the cable is elastic")


def test_a_refit_that_agrees_with_the_file_and_explains_nothing_is_not_reported() -> None:
    same = _friction_refitted(0.019996, 0.000077, 0.0005)
    diagnosis = diagnosis_of("explained", same, replace(ELASTIC, share=0.98))
    assert headline(diagnosis) == "The cable is elastic"
    assert len(step_lines(diagnosis)) == 1 + (len(step_lines(diagnosis)[0]) > 76)
    assert len(diagnosis.to_json()["steps"]) == 2


@pytest.mark.parametrize(
    ("torque", "share"), [(0.0207, 0.0005), (0.019996, 0.02), (0.019996, float("nan"))]
)
def test_a_refit_that_differs_or_explains_something_is_reported(
    torque: float, share: float
) -> None:
    step = _friction_refitted(torque, 0.000077, share)
    diagnosis = diagnosis_of("explained", step, replace(ELASTIC, share=0.98))
    assert sorted(reported_steps(diagnosis)) == [0, 1]
    first = diagnosis.steps[reported_steps(diagnosis)[0]]
    said = "instead of" if first.refitted else "; 1 effect of the profile has other values"
    assert said in headline(diagnosis)


def test_a_refit_alone_is_reported_where_it_makes_the_verdict() -> None:
    same = _friction_refitted(0.019996, 0.000077, 0.0005)
    assert reported_steps(diagnosis_of("explained", same)) == [0]
    unknown = diagnosis_of("unknown", same)
    assert reported_steps(unknown) == []
    assert headline(unknown).startswith("No known effect explains")


@pytest.mark.parametrize(("share", "count"), [(0.97, 1), (0.03, 0)])
def test_small_doubtful_effects_are_named_only_beside_what_explains_nearly_all(
    share: float, count: int
) -> None:
    """Laws that overlap have small shares each, and together explain all."""
    main = replace(FRICTION, certain=True, share=share)
    small = replace(ELASTIC, certain=False, share=0.002)
    assert len(named_only([main, small], {})) == count
    assert ("2 effects" in cause([main, small], {})) == (count == 0)


@pytest.mark.parametrize(("before", "count"), [(0.1, 0), (0.003, 1)])
def test_a_small_effect_that_explains_more_than_all_that_is_left_is_reported(
    before: float, count: int
) -> None:
    """Friction beside a weight: 0.2 % of the excess, and twice the noise."""
    outputs = {"cable_length": replace(NOISY, heldout_rms_before=before, heldout_rms_after=3e-4)}
    main = replace(FRICTION, certain=True, share=0.97)
    place = (Place("cable", "cable_length", "tension"),)
    small = replace(ELASTIC, certain=False, share=0.002, place=place)
    assert len(named_only([main, small], outputs)) == count
    text = sentence(diagnosis_of("explained", main, small, outputs=outputs))
    assert ("2 effects are missing" in text) == (count == 0)
    assert ("With either and 1 smaller effect, " in text) == (count == 1)
