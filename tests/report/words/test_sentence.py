"""The verdict in words, for every kind of verdict, and the words of caveats and columns."""

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
    REFITTED,
    diagnosis_of,
)
from winchkit.diagnosis.results import Attribution, Estimate, NextRun, OutputFit, Step
from winchkit.effects.catalogue import load_catalogue
from winchkit.fit_statistics import FitStatistics, FittedParameter
from winchkit.quantity_text import significant
from winchkit.report.words.caveats import caveat_text, finding_texts
from winchkit.report.words.effect_names import EFFECTS
from winchkit.report.words.sentence import (
    changes_text,
    headline,
    main_patterns,
    remaining_patterns,
    remaining_text,
    sentence,
    where_text,
)
from winchkit.report.words.vocabulary import clause, error_scale, estimate_text, kind, listed
from winchkit.runs.sanity.finding import Finding


def test_one_effect_has_the_change_of_the_error_that_falls_most() -> None:
    assert sentence(diagnosis_of("explained", ELASTIC)) == (
        "The cable is elastic. With it, the cable length error falls from 1.63 mm to 0.360 mm "
        "(noise 0.300 mm)."
    )
    outputs = {"cable_length": NOISY, "motor_torque": FRICTIONAL}
    text = sentence(diagnosis_of("explained", FRICTION, outputs=outputs))
    assert text.startswith(
        "The pulleys have Coulomb friction or the cable slides around a blocked pulley (capstan "
        "friction). With either, the motor torque error falls from 16.5 mN m to 3.04 mN m"
    )
    assert "cable length" not in text, "another one falls more"


@pytest.mark.parametrize(
    ("laws", "opening"),
    [
        (("cable-elongation-linear", "cable-elongation-quartic"), "With it, "),
        (("cable-elongation-linear", "frame-compliance"), "With either, "),
        (("cable-elongation-linear", "frame-compliance", "cable-creep"), "With any of them, "),
        (("drum-radius", "gear-ratio"), "With either corrected, "),
    ],
)
def test_the_error_falls_with_one_of_as_many_as_are_named(
    laws: tuple[str, ...], opening: str
) -> None:
    step = replace(ELASTIC, effects=laws, doubts=())
    assert f" {opening}the cable length error falls" in sentence(diagnosis_of("explained", step))


def test_variants_without_the_plain_one_are_still_of_one_kind() -> None:
    curved = kind("cable-elongation-quartic")
    assert curved == kind("cable-elongation-exponential") == kind("cable-elongation-linear")
    assert kind("pulley-stribeck") == kind("pulley-coulomb") != kind("motor-coulomb")
    assert kind("my-spring") == clause("my-spring")


def test_several_effects_are_counted() -> None:
    text = sentence(diagnosis_of("explained", ELASTIC, FRICTION))
    assert text.startswith("2 effects are missing; first, the cable is elastic. With them, the")


def test_a_value_of_the_profile_that_was_refitted_has_that_of_the_file_beside() -> None:
    assert sentence(diagnosis_of("explained", REFITTED)) == (
        "Axial stiffness 250 kN instead of 100 kN in the profile. Corrected, the cable length "
        "error falls from 1.63 mm to 0.360 mm (noise 0.300 mm)."
    )


def test_without_repeats_the_noise_has_two_bounds() -> None:
    unsure = replace(NOISY, noise_source="white noise", noise_upper=0.36e-3)
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"cable_length": unsure}))
    assert text.endswith("to 0.360 mm (noise 0.300 to 0.360 mm).")
    calm = replace(unsure, heldout_rms_before=0.36e-3)
    adequate = sentence(diagnosis_of("adequate", outputs={"cable_length": calm}))
    assert adequate.startswith(
        "No known effect is missing. The cable length error is 0.360 mm rms, noise"
    )


def test_adequate_has_the_largest_error_with_the_noise() -> None:
    assert sentence(diagnosis_of("adequate", outputs={"tension": AT_NOISE})) == (
        "No effect is missing. The tension error is 0.753 N rms, about its noise of 0.742 N."
    )


def test_no_noise_is_no_figure() -> None:
    silent = replace(NOISY, noise_rms=None)
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"cable_length": silent}))
    assert text.endswith("falls from 1.63 mm to 0.360 mm (noise unknown).")


def test_an_effect_without_a_fall_of_the_error_is_reported_so() -> None:
    text = sentence(diagnosis_of("explained", ELASTIC, outputs={"tension": AT_NOISE}))
    assert text.endswith("No held-out error changes.")


def test_unknown_has_the_patterns_and_no_name() -> None:
    text = sentence(diagnosis_of("unknown", unexplained_share=0.99, where=FIVE_CORNERS))
    assert text.startswith("No known effect explains the cable length error. It is ")
    assert "99 % of the error above the noise remains. Main patterns: " in text
    assert "tension, 5 periods per drum turn (44 % of its residual variance)" in text
    assert "motor torque, as a function of drum angle" in text
    assert not any(clause(effect.id) in text for effect in load_catalogue())


def test_unknown_with_steps_does_not_hide_them_behind_no_effect() -> None:
    text = headline(diagnosis_of("unknown", ELASTIC, unexplained_share=0.7))
    assert text == "Known effects explain little of the cable length error"
    whole = sentence(diagnosis_of("unknown", ELASTIC, unexplained_share=0.7))
    assert "With the effect found, the cable length error falls" in whole
    assert "70 % of the error" in whole


def test_partly_has_both_the_effect_and_what_remains() -> None:
    text = sentence(diagnosis_of("partly", ELASTIC, unexplained_share=0.2, where=FIVE_CORNERS))
    assert text.startswith("The cable is elastic. With it,")
    assert "20 % of the error above the noise remains." in text


def test_undecided_blames_the_unknown_noise_and_asks_for_a_repeat() -> None:
    again = NextRun((), "record the same motion again: without repeats the noise is not known")
    unsure = replace(NOISY, noise_upper=1.63e-3, heldout_rms_after=1.63e-3)
    more = {"outputs": {"cable_length": unsure}, "next_runs": (again,), "unexplained_share": 0.6}
    alone = diagnosis_of("undecided", **more)
    assert headline(alone) == "The cable length error may be noise: these runs cannot decide"
    assert "remains" not in sentence(alone), "a share of an unknown excess is no number"
    assert "noise 0.300 to 1.63 mm" in sentence(alone)
    with_step = diagnosis_of("undecided", ELASTIC, **more)
    assert headline(with_step).startswith("What remains of the cable length error may be noise")
    assert "At most 60 % of the error above the noise remains." in sentence(with_step)
    assert changes_text(alone).startswith("To decide: record the same motion again")


def test_patterns_of_outputs_at_their_noise_are_not_main() -> None:
    above = replace(FRICTIONAL, heldout_rms_after=9e-3)
    outputs = {"tension": AT_NOISE, "motor_torque": above}
    found = diagnosis_of("partly", ELASTIC, outputs=outputs, where=FIVE_CORNERS)
    assert [place.output for place in remaining_patterns(found)] == ["motor_torque"]


@pytest.mark.parametrize(
    ("verdict", "text"),
    [
        ("adequate", "To check: record other loads, strokes, speeds or temperatures."),
        ("explained", "To check: record another load, stroke or speed."),
        ("partly", "To explain the rest: write an effect of your own"),
    ],
)
def test_what_would_change_the_verdict(verdict: str, text: str) -> None:
    steps = () if verdict == "adequate" else (ELASTIC,)
    assert changes_text(diagnosis_of(verdict, *steps)).startswith(text)


@pytest.mark.parametrize("verdict", ["explained", "partly", "unknown"])
def test_a_geometry_that_differs_as_a_whole_is_calibrated_first(verdict: str) -> None:
    moved = {"exit-point": {"x": Estimate(0.1, 0.01, "m")}}
    whole = Step(("exit-point", "anchor-point"), moved, 0.9, whole=True)
    run = NextRun(("exit-point", "anchor-point"), "poses farther out", 0.9)
    told = changes_text(diagnosis_of(verdict, whole, next_runs=(run,)))
    assert told.startswith("Calibrate the robot first")


def test_a_run_that_decides_comes_with_its_power() -> None:
    run = NextRun(("pulley-coulomb", "pulley-capstan"), "full stroke, twice the load", 0.93)
    assert changes_text(diagnosis_of("explained", FRICTION, next_runs=(run,))) == (
        "To decide between pulley-coulomb and pulley-capstan: full stroke, twice the load "
        "(power 93 %)."
    )


def test_a_wrong_channel_precedes_everything() -> None:
    found = Finding("inverted-sign", "run", "tension", -1.0, "its sign is inverted")
    told = diagnosis_of("unknown", sanity=(found,), unexplained_share=1.0, where=FIVE_CORNERS)
    assert sentence(told) == (
        "A channel looks wrong: no effect was looked for. tension of run: its sign is inverted."
    )
    assert "confirm that it is right" in changes_text(told)


def test_no_outputs_at_all_still_make_a_sentence() -> None:
    assert sentence(diagnosis_of("adequate", outputs={})) == "No effect is missing."


def test_an_effect_of_the_user_keeps_its_name() -> None:
    mine = Step(("my-spring",), {"my-spring": {"rate": Estimate(3.0, 0.1, "furlong")}}, 0.5)
    assert headline(diagnosis_of("explained", mine)) == "The effect my-spring is missing"


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
        (Attribution("sag", "moon_phase", 0.2), "sag, as a function of moon phase"),
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
    assert text.endswith("Still above the noise: motor torque by a factor of 5.4.")
    assert "Still above" not in sentence(diagnosis_of("explained", ELASTIC))


def test_an_output_that_does_not_follow_the_motion_is_named() -> None:
    lost = Finding("unrelated", "", "tension", float("nan"), "")
    diagnosis = diagnosis_of("unknown", outputs={"tension": AT_NOISE}, sanity=(lost,))
    assert sentence(diagnosis) == (
        "The tension does not follow the motion. Repeats of the same motion differ by 0.742 N rms, "
        "as much as it varies."
    )
    assert changes_text(diagnosis).startswith("Check the instrument of the tension")
    both = {"tension": AT_NOISE, "cable_length": NOISY}
    beside = diagnosis_of("unknown", outputs=both, sanity=(lost,), unexplained_share=1.0)
    assert "100 % of the error above the noise remains" in sentence(beside), "of the length"


def test_what_refitted_values_take_is_reported_where_no_step_does() -> None:
    values = [
        FittedParameter("motor-coulomb.torque", 0.02240, 3.6e-4, "N m", 0.020, (0.0216, 0.0231)),
        FittedParameter("rotor-inertia.inertia", 1.21e-4, 3e-6, "kg m^2", 1.2e-4, (1.1e-4, 1.3e-4)),
        FittedParameter("length offset", 1e-3, 1e-6, "m", 0.0, (0.9e-3, 1.1e-3)),
    ]
    fit = FitStatistics((), 1.0, parameters=tuple(values))
    diagnosis = diagnosis_of("unknown", unexplained_share=0.81, fit=fit)
    assert remaining_text(diagnosis) == (
        "81 % of the error above the noise remains; refitted values of the profile take 19 %: "
        "motor-coulomb torque 22.4 mN m instead of 20.0 mN m."
    )
    assert "take" not in remaining_text(replace(diagnosis, unexplained_share=0.999))
    assert "take" not in remaining_text(replace(diagnosis, steps=(ELASTIC,)))


def test_an_order_of_a_bend_does_not_precede_the_bend() -> None:
    """A cubic spring over half a metre has a fifth of its variance in a sine of a quarter."""
    wave, bend = (
        Attribution("force", "position", 0.22, order=25),
        Attribution("force", "position", 0.8),
    )
    assert main_patterns([bend, wave]) == [bend]
    assert main_patterns([replace(bend, share=0.4), wave]) == [wave]


def test_steps_beside_an_output_that_does_not_follow_the_motion_do_not_hide_it() -> None:
    lost = Finding("unrelated", "", "tension", float("nan"), "")
    assert headline(diagnosis_of("unknown", ELASTIC, sanity=(lost,))) == (
        "The tension does not follow the motion"
    )


def test_every_effect_of_the_catalogue_has_words() -> None:
    assert not [one.id for one in load_catalogue() if one.id not in EFFECTS]


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [(1.84, 7e-4, "1840 0.700 mm"), (3.93e-3, 3.16e-4, "3.93 0.316 mm"), (0.0, 0.0, "0 0 m")],
)
def test_both_errors_of_an_output_are_readable_in_one_unit(
    before: float, after: float, text: str
) -> None:
    fit = OutputFit("m", None, 1.0, before, after, before, after, None)
    scale = error_scale(fit)
    assert f"{significant(before / scale.worth)} {scale.text(after)}" == text


def jitter(run: str, share: int) -> Finding:
    return Finding("jitter", run, "time", share / 100, f"intervals vary by {share} %")


def test_equal_findings_of_several_runs_are_one_line() -> None:
    found = [jitter("a", 50), jitter("b", 50), jitter("c", 20)]
    assert finding_texts(found) == [
        "time of a, b: intervals vary by 50 %",
        "time of c: intervals vary by 20 %",
    ]


def test_alike_findings_of_many_runs_are_shortened() -> None:
    found = [jitter(f"run-{number}", 40 + number) for number in range(14)]
    others = [Finding("gap", "run-0", "time", 1.0, "1 gap")]
    assert finding_texts([*found, *others]) == [
        "time of run-0: intervals vary by 40 %",
        "time of run-1: intervals vary by 41 %",
        "time of run-2: intervals vary by 42 %",
        "time of 11 runs, run-3 to run-13: the same with other numbers, listed by --json",
        "time of run-0: 1 gap",
    ]


def test_the_short_text_has_one_line_per_kind_of_finding() -> None:
    assert finding_texts([jitter("a", 50), jitter("b", 20), jitter("c", 30)], most=1) == [
        "time of a: intervals vary by 50 %",
        "time of b, c: the same with other numbers, listed by --json",
    ]


def test_an_inverted_sign_says_what_to_do() -> None:
    assert "--column CHANNEL=-COLUMN" in caveat_text("inverted-sign")
