"""Samples near backlash impacts are excluded once backlash is in the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, Ride, made, term, with_channel
from winchkit.diagnosis.add import add
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.exclusion import without_impacts
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.search import selection_engine

RIDE = Ride(samples=600, stroke=400.0, period=6.0)
PLAY = term("gear-backlash", gap=0.02, held=0.0)


def dataset_of(load_mass: float | None) -> Dataset:
    runs = [made(seed, load_mass=10.0, ride=RIDE) for seed in range(2)]
    if load_mass is None:
        force = np.full(RIDE.samples, 98.0665)
        runs = [with_channel(run, "load", force) for run in runs]
        runs = [type(run)(run.name, run.time, run.channels, {}) for run in runs]
    return prepare(runs, GROOVED)


def with_play(dataset: Dataset) -> Hypothesis:
    engine = selection_engine(dataset, CATALOGUE)
    return engine.initial_model.with_term(PLAY, engine.regression.n_runs)


@pytest.mark.parametrize("load_mass", [10.0, None], ids=["weight", "measured"])
def test_impacts_exclude_torque_and_under_a_known_weight_tension(load_mass: float | None) -> None:
    dataset = dataset_of(load_mass)
    calm = without_impacts(dataset, with_play(dataset))
    assert calm is not None
    for before, after in zip(dataset.recordings, calm.recordings, strict=True):
        left = {name: before.valid[name] & ~after.valid[name] for name in before.valid}
        assert not left["cable_length"].any()
        assert left["tension"].any() == (load_mass is not None)
        assert 0.005 < left["motor_torque"].mean() < 0.2
        # The motor turns back every half period: the teeth part there, and meet soon after.
        turned = before.raw.at.motor_rate
        backs = np.flatnonzero(np.diff(np.sign(np.where(np.abs(turned) > 5.0, turned, 0.0))) != 0)
        for index in np.flatnonzero(left["motor_torque"]):
            assert np.min(np.abs(backs - index)) < 60
    assert any("impacts of gear-backlash" in note for note in calm.notes)


def test_impacts_of_uneven_samples_exclude_what_the_spline_takes_from_them() -> None:
    """The spline through a noiseless angle oscillates over five samples to either side."""
    kept = np.random.default_rng(5).random(RIDE.samples) > 0.05
    run = made(0, load_mass=10.0, ride=RIDE)
    channels = {
        name: replace(channel, values=channel.values[kept])
        for name, channel in run.channels.items()
    }
    uneven = prepare([replace(run, time=run.time[kept], channels=channels)], GROOVED)
    calm = without_impacts(uneven, with_play(uneven))
    assert calm is not None
    before, after = uneven.recordings[0], calm.recordings[0]
    assert before.raw.clock.support >= 5
    left = before.valid["motor_torque"] & ~after.valid["motor_torque"]
    widths = np.diff(np.flatnonzero(np.diff(left.astype(int), prepend=0, append=0)))[::2]
    assert min(widths[1:-1]) >= 2 * (before.raw.clock.support + 2) + 1


def test_without_backlash_no_sample_is_excluded() -> None:
    dataset = dataset_of(10.0)
    rubbing = Hypothesis().with_term(term("pulley-coulomb", friction=0.1), 2)
    assert without_impacts(dataset, Hypothesis()) is None
    assert without_impacts(dataset, rubbing) is None
    none = Hypothesis().with_term(term("gear-backlash", gap=0.0), 2)
    assert without_impacts(dataset, none) is None


def test_permanent_impacts_exclude_no_sample() -> None:
    """Backlash below the encoder's noise gives impacts at standstill throughout."""
    standing = Ride(samples=600, stroke=1e-5)
    dataset = prepare([made(seed, load_mass=10.0, ride=standing) for seed in range(2)], GROOVED)
    tiny = Hypothesis().with_term(term("gear-backlash", gap=5e-6), 2)
    assert without_impacts(dataset, tiny) is None


@pytest.mark.slow
def test_backlash_is_found_and_fitted_without_its_impacts() -> None:
    runs = [
        made(int(mass) + seed, GROOVED, (PLAY,), load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    found = diagnose(runs, GROOVED).diagnosis
    assert [step.effects for step in found.steps] == [("gear-backlash",)]
    assert found.steps[0].parameters["gear-backlash"]["gap"].value == pytest.approx(0.02, rel=0.02)
    assert any("impacts of gear-backlash" in note for note in found.notes)
    added = add("gear-backlash", runs, GROOVED)
    assert any("impacts of gear-backlash" in note for note in added.notes)
