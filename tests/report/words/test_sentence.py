"""The verdict in words, for every kind of verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from report_answers import CALM, FIVE_CORNERS, FRICTION, NOISY, RUBBING, STRETCH, told
from winchkit.diagnosis.results import Estimate, Step, Where
from winchkit.effects.catalogue import load_catalogue
from winchkit.report.words.sentence import main_patterns, sentence, where_text
from winchkit.report.words.vocabulary import clause, estimate_text, kind, listed


def test_one_effect_is_told_with_its_value_and_what_it_buys() -> None:
    assert sentence(told("explained", STRETCH)) == (
        "Your rope stretches: EA = 249.9 ± 7.0 kN. Add it and the held-out error of the cable "
        "length falls from 1.63 mm to 0.360 mm; the instruments' noise is 0.300 mm."
    )


def test_a_confusion_set_is_told_as_one_and_no_name_is_chosen() -> None:
    outputs = {"cable_length": NOISY, "motor_torque": RUBBING}
    text = sentence(told("explained", FRICTION, outputs=outputs))
    assert text.startswith(
        "Your pulleys rub (friction = 0.01500 ± 0.00010) or your rope drags around a stuck pulley "
        "(friction = 0.0138) – these runs cannot tell which. Add one of them"
    )
    assert "motor torque falls from 16.5 mN m to 3.04 mN m (noise 2.88 mN m)" in text
    assert text.index("motor torque") < text.index("cable length"), "the largest fall comes first"


def test_laws_of_one_kind_are_told_once() -> None:
    laws = ("cable-elongation-linear", "cable-elongation-exponential", "cable-elongation-quartic")
    stretch = replace(STRETCH, effects=laws)
    text = sentence(told("explained", stretch))
    assert text.startswith(
        "Your rope stretches: EA = 249.9 ± 7.0 kN; these runs cannot tell it from "
        "cable-elongation-exponential and cable-elongation-quartic. Add it and the held-out"
    )
    both = sentence(told("explained", stretch, FRICTION))
    assert "your rope stretches (EA = 249.9 ± 7.0 kN; these runs cannot tell it from" in both


def test_kinds_that_cannot_be_told_apart_stand_beside_each_other() -> None:
    mixed = Step(
        ("cable-elongation-linear", "frame-compliance", "cable-elongation-quartic"),
        STRETCH.parameters,
        0.95,
    )
    assert sentence(told("explained", mixed)).startswith(
        "Your rope stretches (EA = 249.9 ± 7.0 kN, or as cable-elongation-quartic) or your frame "
        "gives way to the load – these runs cannot tell which. Add one of them"
    )


def test_variants_without_the_plain_one_are_still_of_one_kind() -> None:
    curved = kind("cable-elongation-quartic")
    assert curved == kind("cable-elongation-exponential") == kind("cable-elongation-linear")
    assert kind("motor-stribeck") == kind("motor-coulomb") != kind("pulley-coulomb")
    assert kind("my-spring") == clause("my-spring")


def test_several_effects_are_counted() -> None:
    text = sentence(told("explained", STRETCH, FRICTION))
    first = "(1) your rope stretches (EA = 249.9 ± 7.0 kN)"
    assert text.startswith(f"Two effects are missing: {first}; (2) your pulleys rub (")
    assert "Add them" in text


def test_without_repeats_the_noise_is_called_what_it_is() -> None:
    unsure = replace(NOISY, noise_source="saturated fit")
    text = sentence(told("explained", STRETCH, outputs={"cable_length": unsure}))
    assert "what no known effect explains is 0.300 mm" in text
    assert "instruments" not in text
    adequate = sentence(told("adequate", outputs={"cable_length": unsure}))
    assert "without a repeated run an unknown one cannot be excluded" in adequate


def test_adequate_gives_errors_beside_the_noise() -> None:
    assert sentence(told("adequate", outputs={"tension": CALM})) == (
        "Nothing is missing above the noise. Held-out error against noise: tension 0.753 N "
        "against 0.742 N."
    )


def test_no_noise_is_no_figure() -> None:
    silent = replace(NOISY, noise_rms=None)
    text = sentence(told("explained", STRETCH, outputs={"cable_length": silent}))
    assert text.endswith("falls from 1.63 mm to 0.360 mm.")
    both = {"cable_length": silent, "motor_torque": replace(RUBBING, noise_rms=None)}
    assert "noise" not in sentence(told("explained", STRETCH, outputs=both))
    assert (
        "against" not in sentence(told("adequate", outputs={"cable_length": silent})).split(":")[1]
    )


def test_an_effect_that_buys_nothing_is_not_sold() -> None:
    text = sentence(told("explained", STRETCH, outputs={"tension": CALM}))
    assert text.endswith("leaves the held-out errors as they are.")


def test_unknown_says_where_and_names_nothing() -> None:
    text = sentence(told("unknown", unexplained_share=0.99, where=FIVE_CORNERS))
    assert text.startswith("Something is missing that no known effect explains: 99 % of what stood")
    assert "It lives in the tension, 5 times per drum turn (44 % of its error)" in text
    assert "motor torque, following the drum angle" in text
    assert not any(clause(effect.id) in text for effect in load_catalogue())


def test_partly_tells_both_the_name_and_the_rest() -> None:
    text = sentence(told("partly", STRETCH, unexplained_share=0.08, where=FIVE_CORNERS))
    assert text.startswith("Your rope stretches")
    assert "Something else is still missing: 8.0 % of what stood above the noise is left" in text


def test_partly_without_a_name_gives_none() -> None:
    text = sentence(told("partly", unexplained_share=0.3))
    assert text == (
        "Something is missing, and known effects explain only part of it: "
        "30 % of what stood above the noise is left."
    )


def test_no_outputs_at_all_still_make_a_sentence() -> None:
    assert sentence(told("adequate", outputs={})) == "Nothing is missing above the noise."


def test_an_effect_of_the_user_keeps_its_name() -> None:
    mine = Step(("my-spring",), {"my-spring": {"rate": Estimate(3.0, 0.1, "furlong")}}, 0.5)
    text = sentence(told("explained", mine))
    assert text.startswith("The effect my-spring is missing: rate = 3.00 ± 0.10 furlong.")


def test_every_effect_of_the_catalogue_has_its_own_words() -> None:
    clauses = [clause(effect.id) for effect in load_catalogue()]
    assert all(text.startswith("your ") for text in clauses)
    assert len(set(clauses)) == len(clauses)


@pytest.mark.parametrize(
    ("where", "text"),
    [
        (Where("tension", "drum_angle", 0.5, order=1), "tension, once per drum turn (50 % of its"),
        (
            Where("cable_length", "motor_angle", 0.3, order=4),
            "cable length, 4 times per motor turn",
        ),
        (Where("tension", "reversal_distance", 0.2), "following the distance since reversal"),
        (Where("tension", "time", 0.2, frequency=0.314), "tension, around 0.31 Hz"),
        (Where("sag", "moon_phase", 0.2), "sag, following the moon_phase"),
    ],
)
def test_places_are_named_as_the_field_names_them(where: Where, text: str) -> None:
    assert text in where_text(where)


def test_a_clear_order_tells_more_than_a_larger_trend() -> None:
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


def test_an_error_that_stays_above_the_noise_is_not_hidden() -> None:
    high = replace(RUBBING, heldout_rms_after=15.6e-3, heldout_rms_before=0.763)
    text = sentence(told("explained", STRETCH, outputs={"motor_torque": high, "tension": CALM}))
    assert text.endswith("That leaves the motor torque at 5.4 times its noise.")
    assert "That leaves" not in sentence(told("explained", STRETCH))
