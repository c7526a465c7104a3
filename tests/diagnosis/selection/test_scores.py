"""Thresholds of a score where the noise is known well in some bands and hardly in others.

Two runs of a joint, one in either direction: friction is an offset of each run, cogging has one
phase in both. In the lowest band nearly every row is explained by some candidate.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.noise import satterthwaite_dof
from winchkit.diagnosis.results import Diagnosis
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.scores import score_by_chance
from winchkit.diagnosis.selection.stepwise import initial_result
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

CATALOGUE = load_catalogue()
JOINT = AxisProfile(name="joint")
RATE, SECONDS = 100.0, 30.0
FRICTION, NOISE = 3.6e-3, 5e-4
COGGING = {24: 4e-3, 48: 1e-3}
"""Amplitudes by order, N m."""
RIPPLE = 0.3
"""Share of the friction that varies 24 times per turn."""


def move(direction: float, seed: int, *, hidden: bool) -> Run:
    """One move in one direction at a speed that varies."""
    time = np.arange(0.0, SECONDS, 1 / RATE)
    speed = direction * (0.5 + 0.2 * np.sin(2 * np.pi * time / 7.3 + seed))
    angle = np.cumsum(speed) / RATE
    torque = NOISE * np.random.default_rng(seed).standard_normal(len(time))
    if hidden:
        torque += direction * FRICTION * (1 + RIPPLE * np.sin(24 * angle + 0.4))
        torque += sum(size * np.cos(order * angle + 1.0) for order, size in COGGING.items())
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run(f"{direction:g}", time, channels, {})


def moves(seed: int, *, hidden: bool) -> Diagnosis:
    runs = [move(1.0, seed, hidden=hidden), move(-1.0, seed + 1, hidden=hidden)]
    return diagnose(runs, JOINT).diagnosis


def test_cogging_is_named_from_one_run_in_either_direction() -> None:
    found = moves(1, hidden=True)
    assert found.verdict == "explained"
    step = next(step for step in found.steps if step.effects == ("motor-cogging",))
    sizes = {one["order"]: one["amplitude"]["value"] for one in step.to_json()["orders"]}
    for order, size in COGGING.items():
        assert sizes[order] == pytest.approx(size, rel=0.05)
    named = {effect for step in found.steps for effect in step.effects}
    assert named & {"motor-coulomb", "motor-dahl"}
    assert found.outputs["motor_torque"].heldout_rms_after < NOISE


def test_a_candidate_of_well_known_bands_is_held_to_its_own_quantile() -> None:
    runs = [move(1.0, 1, hidden=True), move(-1.0, 2, hidden=True)]
    engine = selection_engine(prepare(runs, JOINT, fast=True), CATALOGUE)
    first = initial_result(engine)
    by_effect = {
        (item.candidate.effect.id, item.candidate.shape.get("order")): item
        for item in engine.scores_at_all_points(first.initial_model, first.initial_noise)
    }
    assert first.threshold < 100.0
    assert by_effect["motor-cogging", 24].by_chance < 30.0
    assert by_effect["motor-coulomb", None].by_chance < 100.0


@pytest.mark.parametrize(("size", "steps"), [(0.1, 0), (0.2, 1)])
def test_without_repeats_evidence_counts_where_an_error_falls(size: float, steps: int) -> None:
    runs = [move(direction, seed, hidden=False) for seed, direction in enumerate((1.0, -1.0))]
    with_cogging = []
    for run in runs:
        torque = run["motor_torque"] + size * NOISE * np.cos(24 * run["motor_angle"] + 1.0)
        channels = {**run.channels, "motor_torque": Channel(torque, "N m")}
        with_cogging.append(replace(run, channels=channels))
    answer = diagnose(with_cogging, JOINT)
    found = answer.diagnosis
    assert answer.result.lack_of_fit_at_start
    assert len(found.steps) == steps
    # White noise of an output that varies by nothing else measures nothing.
    assert found.verdict == "undecided"


def test_noise_alone_names_nothing() -> None:
    found = [moves(seed, hidden=False) for seed in range(10, 40, 2)]
    assert sum(bool(one.steps) for one in found) <= 1
    assert {one.verdict for one in found if not one.steps} == {"undecided"}


def test_degrees_of_freedom_add_where_the_bands_have_equal_shares() -> None:
    dof = np.full(4, 12.0)
    assert satterthwaite_dof(np.full(4, 0.25), dof) == pytest.approx(48.0)
    assert satterthwaite_dof(np.array([0.0, 1.0, 0.0, 0.0]), dof) == pytest.approx(12.0)
    shares = np.array([[0.5, 0.9], [0.5, 0.1]])
    expected = [1 / (0.25 / 1 + 0.25 / 300), 1 / (0.81 / 1 + 0.01 / 300)]
    assert satterthwaite_dof(shares, np.array([[1.0], [300.0]])) == pytest.approx(expected)


@pytest.mark.parametrize(("columns", "dof"), [(1, 1.0), (2, 5.0), (2, 400.0)])
def test_a_score_by_chance_is_a_quantile_of_f(columns: int, dof: float) -> None:
    quantile = columns * stats.f.isf(0.01 / 50, columns, dof)
    assert score_by_chance(0.0, columns, dof, 50) == pytest.approx(quantile, rel=1e-6)
    assert score_by_chance(7.0, columns, dof, 50) == pytest.approx(max(0.0, quantile - 7.0))


def test_noise_of_unknown_variance_exceeds_it_at_its_level() -> None:
    random = np.random.default_rng(3)
    explained = random.chisquare(2, 200_000) / (random.chisquare(6, 200_000) / 6)
    share = np.mean(explained > score_by_chance(0.0, 2, 6.0, 1))
    assert share == pytest.approx(0.01, abs=3 * np.sqrt(0.01 / 200_000))
