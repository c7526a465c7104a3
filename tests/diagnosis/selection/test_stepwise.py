"""Candidates that selection may try, and which of nested ones enters first."""

from __future__ import annotations

import numpy as np

from diagnosis_runs import CATALOGUE, GROOVED, Ride, engine_for, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.stepwise import stepwise_selection
from winchkit.effects.catalogue import Catalogue

RIDE = Ride(samples=400)
NEIGHBOURS = ("rotor-inertia", "motor-viscous", "motor-coulomb", "torque-constant", "torque-lag")


def test_a_candidate_with_infeasible_sign_scores_zero() -> None:
    """A rotor of negative inertia is made; nothing that exists does that."""
    impossible = term("rotor-inertia", inertia=-2e-3)
    runs = [
        made(int(mass) + seed, GROOVED, (impossible,), load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    present, noise = engine.fit_with_noise(engine.initial_model)
    told = {score.candidate.effect.id: score for score in engine.scores(present, noise)}
    rotor = told["rotor-inertia"]
    assert rotor.explained_ss == 0.0
    assert rotor.net_gain < 0.0
    assert not rotor.amplitudes.any()
    # It is still listed, and the list is still sorted.
    values = [score.net_gain for score in engine.scores(present, noise)]
    assert values == sorted(values, reverse=True)
    neighbours = Catalogue(CATALOGUE[name] for name in NEIGHBOURS)
    found = diagnose(runs, GROOVED, neighbours).diagnosis
    assert found.verdict in {"unknown", "partly"}
    assert all("rotor-inertia" not in step.effects for step in found.steps)


def test_a_candidate_with_feasible_sign_scores() -> None:
    real = term("rotor-inertia", inertia=2e-3)
    runs = [
        made(int(mass) + seed, GROOVED, (real,), load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    present, noise = engine.fit_with_noise(engine.initial_model)
    best = engine.scores(present, noise)[0]
    assert best.candidate.effect.id == "rotor-inertia"
    assert np.all(best.amplitudes > 0.0)


def test_of_nested_laws_the_simplest_enters_first() -> None:
    """Creep over half a minute with one reversal takes a part of the friction for a wrong gain."""
    hidden = (term("pulley-coulomb", friction=0.0085), term("cell-gain", gain_error=-0.028))
    engine = engine_for(hidden, Ride(samples=1500, period=50.0), (57.0, 20.0))
    assert set(stepwise_selection(engine).final.labels) == {"pulley-coulomb", "cell-gain"}
