"""Fits of one set of effects to sessions of the blind simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from winchkit.catalog import find
from winchkit.effects.catalogue import load_catalogue
from winchkit.fleet.diagnosis.sessions import SessionEstimate, fit_session, null_term
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import EffectTable, WinchProfile
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.record import simulate

CATALOGUE = load_catalogue()
SET = ("cell-gain", "cable-elongation-linear", "drum-eccentricity")


@pytest.fixture(scope="module")
def recorded() -> tuple[list[Run], WinchProfile]:
    hidden = ["stretched cell, gain_error=0.01", "elastic rope, axial_stiffness=300 kN"]
    bench = hiding(read_simbench(find("sim", "demo-adequate")), hidden)
    profiles = profiles_of(bench)
    programme = read_programme(programme_path("programme-demo"))
    return list(simulate(bench, profiles, programme, seed=3, rate=25.0)), profiles["A"]


@pytest.fixture(scope="module")
def estimates(recorded: tuple[list[Run], WinchProfile]) -> dict[str, SessionEstimate]:
    runs, profile = recorded
    terms = [null_term(CATALOGUE[effect]) for effect in SET]
    found = fit_session(runs, profile, terms, winch="A", time=0.0, catalogue=CATALOGUE)
    return {each.parameter: each for each in found}


@pytest.mark.parametrize(
    ("parameter", "truth"), [("gain_error", 0.01), ("1/axial_stiffness", 1 / 300e3)]
)
def test_hidden_values_are_within_their_uncertainty(
    estimates: dict[str, SessionEstimate], parameter: str, truth: float
) -> None:
    found = estimates[parameter]
    assert abs(found.value - truth) < 4 * found.std
    assert found.std < 0.1 * truth


def test_an_effect_that_the_profile_has_is_estimated_as_a_whole(
    recorded: tuple[list[Run], WinchProfile], estimates: dict[str, SessionEstimate]
) -> None:
    runs, profile = recorded
    known = replace(profile, effect=(EffectTable("cell-gain", {"gain_error": "0.4 %"}),))
    terms = [null_term(CATALOGUE[effect]) for effect in SET]
    (found, *_) = fit_session(runs, known, terms, winch="A", time=0.0, catalogue=CATALOGUE)
    assert found.effect == "cell-gain"
    assert found.value == pytest.approx(estimates["gain_error"].value, rel=1e-3)
    assert found.std == pytest.approx(estimates["gain_error"].std, rel=1e-2)


def test_an_absent_amplitude_with_a_phase_is_normal_about_zero(
    estimates: dict[str, SessionEstimate],
) -> None:
    parts = [each for each in estimates.values() if each.effect == "drum-eccentricity"]
    assert len(parts) == 2
    assert all(abs(each.value) < 4 * each.std for each in parts)


def test_covariances_are_of_the_whole_fit_and_positive_definite(
    estimates: dict[str, SessionEstimate],
) -> None:
    matrix = np.array([each.covariance for each in estimates.values()])
    assert matrix.shape == (len(estimates),) * 2
    std = np.sqrt(np.diag(matrix))
    assert std == pytest.approx([each.std for each in estimates.values()])
    assert np.linalg.eigvalsh(matrix / np.outer(std, std)).min() > 0.0


def test_the_cost_of_a_gain_is_the_rms_of_the_tension(
    estimates: dict[str, SessionEstimate],
) -> None:
    # Weights of 10 kg and 20 kg behind pulleys without friction.
    rms = np.sqrt((98.07**2 + 196.13**2) / 2)
    assert estimates["gain_error"].rms_per_unit["tension"] == pytest.approx(rms, rel=0.05)
    assert estimates["gain_error"].rms_per_unit["cable_length"] == pytest.approx(0.0, abs=1e-9)
