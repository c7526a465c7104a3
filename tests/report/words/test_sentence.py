"""The verdict in words, for every kind of verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from report_answers import (
    AT_NOISE,
    ELASTIC,
    FIVE_CORNERS,
    FRICTION,
    FRICTIONAL,
    NOISY,
    diagnosis_of,
)
from winchkit.diagnosis.results import Attribution, Estimate, Step
from winchkit.effects.catalogue import load_catalogue
from winchkit.report.words.sentence import main_patterns, sentence, where_text
from winchkit.report.words.vocabulary import clause, estimate_text, kind, listed


def test_one_effect_has_its_value_and_the_change_of_the_held_out_error() -> None:
    assert sentence(diagnosis_of("explained", ELASTIC)) == (
        "The cable is elastic: EA = 249.9 ± 7.0 kN. With it, the held-out error of the cable "
        "length falls from 1.63 mm to 0.360 mm; the noise floor is 0.300 mm."
    )


def test_an_equivalence_set_is_one_sentence_with_all_its_effects() -> None:
    outputs = {"cable_length": NOISY, "motor_torque": FRICTIONAL}
    text = sentence(diagnosis_of("explained", FRICTION, outputs=outputs))
    assert text.startswith(
        "The pulleys have Coulomb friction (friction = 0.01500 ± 0.00010) or the cable slides "
        "around a blocked pulley (capstan friction) (friction = 0.0138) – these runs cannot "
        "distinguish them. With one of them"
    )
    assert "motor torque falls from 16.5 mN m to 3.04 mN m (noise 2.88 mN m)" in text
    assert text.index("motor torque") < text.index("cable length"), "the largest fall comes first"


def test_laws_of_one_kind_are_named_once() -> None:
    laws = ("cable-elongation-linear", "cable-elongation-exponential", "cable-elongation-quartic")
    stretch = replace(ELASTIC, effects=laws)
    text = sentence(diagnosis_of("explained", stretch))
    assert text.startswith(
        "The cable is elastic: EA = 249.9 ± 7.0 kN; these runs cannot distinguish it from "
        "cable-elongation-exponential and cable-elongation-quartic. With it, the held-out"
    )
    both = sentence(diagnosis_of("explained", stretch, FRICTION))
    assert "the cable is elastic (EA = 249.9 ± 7.0 kN; these runs cannot distinguish it" in both


def test_kinds_that_cannot_be_distinguished_are_joined_by_or() -> None:
    mixed = Step(
        ("cable-elongation-linear", "frame-compliance", "cable-elongation-quartic"),
        ELASTIC.parameters,
        0.95,
    )
    assert sentence(diagnosis_of("explained", mixed)).startswith(
        "The cable is elastic (EA = 249.9 ± 7.0 kN, or as cable-elongation-quartic) or the frame "
        "is compliant – these runs cannot distinguish them. With one of them"
    )


def test_variants_without_the_plain_one_are_still_of_one_kind() -> None:
    curved = kind("cable-elongation-quartic")
    assert curved == kind("cable-elongation-exponential") == kind("cable-elongation-linear")
    assert kind("motor-stribeck") == kind("motor-coulomb") != kind("pulley-coulomb")
    assert kind("my-spring") == clause("my-spring")


def test_several_effects_are_counted() -> None:
    text = sentence(diagnosis_of("explained", ELASTIC, FRICTION))
    first = "(1) the cable is elastic (EA = 249.9 ± 7.0 kN)"
    second = "(2) the pulleys have Coulomb friction ("
    assert text.startswith(f"Two effects are missing: {first}; {second}")
    assert "With them" in text


def test_without_repeats_the_noise_is_a_residual() -> None:
    unsure = replace(NOISY, noise_source="saturated fit")
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"cable_length": unsure}))
    assert "the residual that no known effect explains is 0.300 mm" in text
    assert "noise floor" not in text
    adequate = sentence(diagnosis_of("adequate", outputs={"cable_length": unsure}))
    assert "an unknown effect cannot be excluded without repeats" in adequate
    assert "too few or too short" not in adequate
    far = replace(unsure, heldout_rms_after=2.5 * 0.3e-3)
    adequate = sentence(diagnosis_of("adequate", outputs={"cable_length": far}))
    assert "(cable length by a factor of 2.5): these runs are too few or too short" in adequate


def test_adequate_has_errors_with_the_noise() -> None:
    assert sentence(diagnosis_of("adequate", outputs={"tension": AT_NOISE})) == (
        "No effect is missing: the residual is at the noise floor. Held-out error: tension "
        "0.753 N (noise 0.742 N)."
    )


def test_no_noise_is_no_figure() -> None:
    silent = replace(NOISY, noise_rms=None)
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"cable_length": silent}))
    assert text.endswith("falls from 1.63 mm to 0.360 mm.")
    both = {"cable_length": silent, "motor_torque": replace(FRICTIONAL, noise_rms=None)}
    assert "noise" not in sentence(diagnosis_of("explained", ELASTIC, outputs=both))
    adequate = sentence(diagnosis_of("adequate", outputs={"cable_length": silent}))
    assert adequate.endswith("Held-out error: cable length 0.360 mm.")


def test_an_effect_without_a_fall_of_the_error_is_reported_so() -> None:
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"tension": AT_NOISE}))
    assert text.endswith("does not change the held-out errors.")


def test_unknown_has_the_patterns_and_no_name() -> None:
    text = sentence(diagnosis_of("unknown", unexplained_share=0.99, where=FIVE_CORNERS))
    assert text.startswith("Unexplained by any known effect: 99 % of the residual variance above")
    pattern = "tension, 5 periods per drum turn (44 % of its residual variance)"
    assert f"Main patterns: {pattern}; " in text
    assert "motor torque, as a function of drum angle" in text
    assert not any(clause(effect.id) in text for effect in load_catalogue())


def test_partly_has_both_the_name_and_the_unexplained_share() -> None:
    text = sentence(diagnosis_of("partly", ELASTIC, unexplained_share=0.08, where=FIVE_CORNERS))
    assert text.startswith("The cable is elastic")
    assert "Partly unexplained: 8.0 % of the residual variance above the noise floor" in text


def test_partly_without_a_name_gives_none() -> None:
    text = sentence(diagnosis_of("partly", unexplained_share=0.3))
    assert text == (
        "Partly explained by known effects, none of which is named: "
        "30 % of the residual variance above the noise floor remains."
    )


def test_no_outputs_at_all_still_make_a_sentence() -> None:
    assert sentence(diagnosis_of("adequate", outputs={})) == (
        "No effect is missing: the residual is at the noise floor."
    )


def test_an_effect_of_the_user_keeps_its_name() -> None:
    mine = Step(("my-spring",), {"my-spring": {"rate": Estimate(3.0, 0.1, "furlong")}}, 0.5)
    text = sentence(diagnosis_of("explained", mine))
    assert text.startswith("The effect my-spring is missing: rate = 3.00 ± 0.10 furlong.")


def test_every_effect_of_the_catalogue_has_its_own_words() -> None:
    clauses = [clause(effect.id) for effect in load_catalogue()]
    assert all(text.startswith("the ") for text in clauses)
    assert len(set(clauses)) == len(clauses)


@pytest.mark.parametrize(
    ("where", "text"),
    [
        (
            Attribution("tension", "drum_angle", 0.5, order=1),
            "tension, 1 period per drum turn (50 % of",
        ),
        (
            Attribution("cable_length", "motor_angle", 0.3, order=4),
            "cable length, 4 periods per motor turn",
        ),
        (Attribution("tension", "reversal_distance", 0.2), "a function of distance since reversal"),
        (Attribution("tension", "time", 0.2, frequency=0.314), "tension, around 0.31 Hz"),
        (Attribution("sag", "moon_phase", 0.2), "sag, as a function of moon_phase"),
    ],
)
def test_attributions_in_words(where: Attribution, text: str) -> None:
    assert text in where_text(where)


def test_a_clear_order_precedes_a_larger_trend() -> None:
    first = main_patterns(FIVE_CORNERS)
    assert [(place.output, place.order) for place in first] == [
        ("tension", 5),
        ("motor_torque", None),
    ]


def test_orders_are_whole_and_shares_are_per_cent() -> None:
    assert estimate_text("order", Estimate(5.0, 0.0, "1")) == "order 5"
    assert (
        estimate_text("gain_error", Estimate(0.0196, 0.0003, "1")) == "gain error = 1.960 ± 0.030 %"
    )


def test_lists_read_as_sentences() -> None:
    assert [listed([]), listed(["a"]), listed(["a", "b", "c"], "or")] == ["", "a", "a, b or c"]


def test_an_error_that_remains_above_the_noise_is_reported() -> None:
    high = replace(FRICTIONAL, heldout_rms_after=15.6e-3, heldout_rms_before=0.763)
    text = sentence(
        diagnosis_of("explained", ELASTIC, outputs={"motor_torque": high, "tension": AT_NOISE})
    )
    assert text.endswith("Still above the noise floor: motor torque by a factor of 5.4.")
    assert "Still above" not in sentence(diagnosis_of("explained", ELASTIC))
