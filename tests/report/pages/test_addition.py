"""The page of an addition: what was added, what it bought, and what it did not."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from report_answers import AT_NOISE, FRICTIONAL, NOISY, recorded
from report_parsed import HOSTILE, Page
from winchkit.catalog import find
from winchkit.diagnosis.add import Addition, FittedAddition, add, fitted_addition
from winchkit.diagnosis.results import Estimate, OutputFit
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term
from winchkit.report.pages.addition import addition_sentence
from winchkit.report.pages.pages import addition_html
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile

ELASTIC = "cable-elongation-linear"


def profile() -> WinchProfile:
    return read_profile(find("profiles", "bench-spiral"))


@cache
def grown(effect: str = ELASTIC) -> FittedAddition:
    return fitted_addition(effect, recorded("demo-elastic-rope"), profile())


@cache
def page() -> Page:
    return Page(addition_html(grown(), "x", "nominal.toml", "my better.toml"))


def told(**outputs: OutputFit) -> str:
    term = Term(load_catalogue()[ELASTIC], {"axial_stiffness": 249_900.0})
    values = {"axial_stiffness": Estimate(249_900.0, 7_000.0, "N")}
    return addition_sentence(Addition(outputs, ((term, values),)))


def test_the_page_belongs_to_the_figures_of_the_addition() -> None:
    known = grown().addition
    assert known.to_json() == add(ELASTIC, recorded("demo-elastic-rope"), profile()).to_json()
    raw = next(word for word in page().words if word.startswith("{"))
    assert json.loads(raw) == json.loads(json.dumps(known.to_json()))
    assert addition_sentence(known) in page().text


def test_the_page_is_whole_and_needs_nothing_else() -> None:
    page().require_whole()
    assert page().count("table") == 3


def test_before_and_after_are_drawn_where_the_effect_acts_and_nowhere_else() -> None:
    heads = page().figures["time-cable_length"]["head"]
    assert heads[-2:] == ["residual, present model [mm]", f"residual, with {ELASTIC} [mm]"]
    unchanged = page().figures["time-tension"]["head"]
    assert unchanged[-1] == "residual [N]", "a longer cable weighs the same"
    before, after = (
        np.array([v for v in page().column("time-cable_length", name) if v is not None])
        for name in ("residual, present model", f"residual, with {ELASTIC}")
    )
    fitted = grown().addition.outputs["cable_length"]
    fall = np.sqrt(np.mean(before**2) / np.mean(after**2))
    assert fall == pytest.approx(fitted.rms_before / fitted.rms_after, rel=0.15)


def test_the_commands_make_the_profile_and_go_on_with_it() -> None:
    runs = " ".join(run.path or run.name for run in recorded("demo-elastic-rope"))
    for command in (
        f"winchkit add {ELASTIC} --profile nominal.toml --fit {runs} -o 'my better.toml'",
        f"winchkit compare {runs} --profile 'my better.toml'",
        f"winchkit diagnose {runs} --profile 'my better.toml' --html report.html",
    ):
        assert command in page().text


def test_values_of_all_effects_are_reported() -> None:
    known = grown()
    ((term, values),) = known.addition.terms
    friction = Term(load_catalogue()["pulley-coulomb"], {"friction": 0.015})
    rubbing = (friction, {"friction": Estimate(0.015, 0.0001, "1")})
    both = replace(known.addition, terms=(rubbing, (term, values)))
    text = Page(addition_html(replace(known, addition=both), "x")).text
    row = "pulley-coulombrefittedthe pulleys have Coulomb frictionfriction = 0.01500 ± 0.00010"
    assert row in text
    assert "Added cable-elongation-linear to the profile" in text


def test_the_change_of_the_held_out_error_in_words() -> None:
    assert told(cable_length=NOISY, tension=AT_NOISE) == (
        "Added cable-elongation-linear to the profile: the cable is elastic, "
        "EA = 249.9 ± 7.0 kN. With it, the cable length error falls from 1.63 mm to 0.360 mm "
        "(noise 0.300 mm)."
    )


def test_an_addition_without_a_smaller_error_is_reported_so() -> None:
    assert told(tension=AT_NOISE).endswith("It does not change the held-out errors.")
    harmed = replace(FRICTIONAL, heldout_rms_before=3.0e-3, heldout_rms_after=3.6e-3)
    text = told(cable_length=NOISY, motor_torque=harmed)
    assert text.endswith(
        "It raises the held-out error of the motor torque from 3.00 mN m to 3.60 mN m."
    )
    assert "falls from 1.63 mm" in text
    assert "does not change" not in told(motor_torque=harmed)
    known = grown()
    for outputs, chip in (
        ({"tension": AT_NOISE}, "Added without gain"),
        ({"motor_torque": harmed}, "Added, with larger errors"),
    ):
        said = replace(known, addition=replace(known.addition, outputs=outputs))
        assert chip in Page(addition_html(said, "x")).text


def test_an_effect_of_the_user_is_reported_by_its_name() -> None:
    own = replace(load_catalogue()[ELASTIC], id="my-spring", what="A spring of mine.")
    term = Term(own, {"axial_stiffness": 1.0})
    said = replace(
        grown(), addition=Addition({"tension": AT_NOISE}, ((term, {}),), notes=(HOSTILE,))
    )
    page = Page(addition_html(said, HOSTILE, HOSTILE, HOSTILE))
    assert "Added my-spring to the profile. It does not change" in page.text
    assert "A spring of mine." in page.text
    assert page.count("script") == 2
    assert page.count("img") == 0
    assert HOSTILE in "".join(page.words)
