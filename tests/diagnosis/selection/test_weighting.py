"""Weights for runs without repeats: inverse noise variance, or equal."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE as EVERY
from diagnosis_runs import GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.add import add
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.selection.weighting import reweighted
from winchkit.effects.catalogue import Catalogue
from winchkit.runs.run import Run

CATALOGUE = Catalogue(effect for effect in EVERY if effect.id != "motor-dahl")
"""Without presliding friction, which takes part of a friction that fades."""
RIDE = Ride(samples=3000, rate=50.0, period=12.0)
FRICTION = 0.05
RATE = np.gradient(RIDE.angle, RIDE.time)


def wander(seed: int) -> Array:
    """Slow noise of unit size: each value is nearly the one before."""
    kicks = np.random.default_rng(seed).standard_normal(RIDE.samples)
    out = np.zeros(RIDE.samples)
    for index in range(1, RIDE.samples):
        out[index] = 0.98 * out[index - 1] + kicks[index]
    return np.asarray(out / out.std())


def rides(added: list[Array], **friction: float) -> list[Run]:
    """One run per load, none repeated, with something added to the torque of each."""
    hidden = [term("motor-coulomb", **friction)] if friction else []
    runs = [
        made(seed, GROOVED, hidden, load_mass=mass, ride=RIDE)
        for seed, mass in enumerate((10.0, 25.0))
    ]
    return [
        with_channel(run, "motor_torque", run["motor_torque"] + extra, "N m")
        for run, extra in zip(runs, added, strict=True)
    ]


def with_friction(runs: list[Run]) -> tuple[TimeSeriesSelection, Fit, BandNoise]:
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    start = engine.initial_model.with_term(
        term("motor-coulomb", torque=FRICTION), engine.regression.n_runs
    )
    return engine, *engine.fit_with_noise(start)


@pytest.mark.parametrize("size", [0.0, 0.005, 0.02])
def test_slow_noise_keeps_its_inverse_variance_weights(size: float) -> None:
    runs = rides([size * wander(seed) for seed in (1, 2)], torque=FRICTION)
    engine, present, noise = with_friction(runs)
    best = reweighted(engine, present, noise)
    assert best.fit is present
    assert best.noise is noise
    assert not best.notes


def warming_up() -> Array:
    """A friction three times as large when the run begins, which no Coulomb friction is."""
    return np.asarray(FRICTION * np.tanh(RATE / 5) * (1 + 2 * np.exp(-RIDE.time / 8)))


def least_squares() -> float:
    """Coulomb friction with the least squared error of the torque in time, all samples alike."""
    sign = np.tanh(RATE / 0.5)
    return float(sign @ warming_up() / (sign @ sign))


def test_a_missing_effect_gets_equal_weights() -> None:
    """Fast reversals alone would underestimate the friction."""
    engine, present, noise = with_friction(rides([warming_up(), warming_up()]))
    best = reweighted(engine, present, noise)
    by_noise, evenly = (f.hypothesis.terms[0].values["torque"] for f in (present, best.fit))
    assert evenly == pytest.approx(least_squares(), rel=0.01)
    assert by_noise < 0.97 * least_squares()
    assert best.noise.rms == noise.rms
    (note,) = best.notes
    assert "the same weight" in note


def test_add_fits_a_transition_of_a_rounded_reversal() -> None:
    addition = add("motor-coulomb", rides([warming_up(), warming_up()]), GROOVED, CATALOGUE)
    values = addition.added[1]
    assert values["transition"].value > 0.0
    assert values["torque"].value > least_squares()
