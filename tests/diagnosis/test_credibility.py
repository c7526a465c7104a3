"""What an effect implies must be of the size of what was measured, on a joint of known motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import SPIRAL, Ride, engine_for, made, term
from winchkit.diagnosis.credibility import (
    asymmetric_friction,
    miscounted_turns,
    oversized,
    short_record,
    unresolved_order,
)
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.search import selection_engine
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
INERTIA, STIFFNESS = 2.0, -310.0
RATE, SECONDS = 100.0, 40.0


def joint(half_range: float, seed: int = 1) -> Run:
    """Two harmonics within ± half_range, rad; inertia, a slope over the angle and white noise."""
    time = np.arange(0.0, SECONDS, 1 / RATE)
    angle, acceleration = np.zeros(len(time)), np.zeros(len(time))
    for amplitude, frequency in ((0.7 * half_range, 0.4), (0.3 * half_range, 0.91)):
        wave = amplitude * np.sin(2 * np.pi * frequency * time)
        angle, acceleration = angle + wave, acceleration - (2 * np.pi * frequency) ** 2 * wave
    torque = INERTIA * acceleration + STIFFNESS * angle
    torque += 0.1 * np.random.default_rng(seed).standard_normal(len(time))
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run("joint", time, channels, {})


@pytest.mark.parametrize(("inertia", "too_large"), [(INERTIA, False), (1420.0, True)])
def test_an_inertia_is_bounded_by_torque_and_acceleration(inertia: float, too_large: bool) -> None:
    engine = selection_engine(prepare([joint(0.5)], JOINT), load_catalogue())
    noise = engine.fit_with_noise(engine.initial_model)[1]
    hypothesis = engine.initial_model.with_term(term("rotor-inertia", inertia=inertia), 1)
    reason = oversized(engine.regression, engine.fixed(hypothesis, noise), 0)
    assert (reason is not None) == too_large
    assert reason is None or "other effects cancel it" in reason


@pytest.mark.parametrize(("share", "cancelled"), [(0.0, False), (0.97, True)])
def test_a_gain_that_a_share_of_the_torque_cancels_is_not_certain(
    share: float, cancelled: bool
) -> None:
    """A gain and a share of the torque that imitated a five-cornered drum were ± 90 N of 100 N."""
    engine = engine_for([], Ride(samples=600, rate=10.0), (10.0, 25.0))
    noise = engine.fit_with_noise(engine.initial_model)[1]
    tension, torque = (
        np.concatenate([v[ok] for v, ok in engine.regression.measured_samples(output)])
        for output in ("tension", "motor_torque")
    )
    per_torque = 0.3 * float(np.mean(tension) / np.mean(torque))
    hypothesis = engine.initial_model.with_term(term("cell-gain", gain_error=-0.3), 4)
    crosstalk = term("cell-crosstalk", share=share * per_torque)
    fitted = engine.fixed(hypothesis.with_term(crosstalk, 4), noise)
    reason = oversized(engine.regression, fitted, 0)
    assert (reason is not None) == cancelled
    assert reason is None or "most of it is cancelled" in reason


@pytest.mark.parametrize(("half_range", "short"), [(np.radians(1.3), True), (0.5, False)])
def test_a_law_over_a_degree_of_travel_is_not_certain(half_range: float, short: bool) -> None:
    engine = selection_engine(prepare([joint(half_range)], JOINT), load_catalogue())
    noise = engine.fit_with_noise(engine.initial_model)[1]
    spring = term("spring-balancer", stiffness=STIFFNESS, torque=0.0)
    fitted = engine.fixed(engine.initial_model.with_term(spring, 1), noise)
    assert (short_record(engine.regression, fitted, 0) is not None) == short


@pytest.mark.parametrize(("time_constant", "short"), [(20.0, False), (448.0, True)])
def test_a_memory_longer_than_the_runs_is_not_certain(time_constant: float, short: bool) -> None:
    """A joint that opens above a load was a certain creep of 448 s in runs of 90 s."""
    engine = engine_for([], Ride(samples=600, rate=10.0))
    noise = engine.fit_with_noise(engine.initial_model)[1]
    creep = term("cable-creep", creep_stiffness=6e5, time_constant=time_constant)
    runs = engine.regression.n_runs
    fitted = engine.fixed(engine.initial_model.with_term(creep, runs), noise)
    reason = short_record(engine.regression, fitted, 0)
    assert (reason is not None) == short
    assert reason is None or "448 s, and the longest run lasts 59.9 s" in reason


@pytest.mark.parametrize(("order", "unresolved"), [(4, False), (27, True)])
def test_an_order_above_the_band_most_of_the_time_is_not_certain(
    order: int, unresolved: bool
) -> None:
    """The motor turns at 4 rad/s on average, so that 27 periods a turn are about 18 Hz."""
    rate = 20.0
    time = np.arange(0.0, SECONDS, 1 / rate)
    angle = 4.0 * time - np.sin(2 * np.pi * 0.1 * time)
    torque = 0.1 * np.sin(order * angle) + 0.01 * np.random.default_rng(1).standard_normal(
        len(time)
    )
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    engine = selection_engine(prepare([Run("joint", time, channels, {})], JOINT), load_catalogue())
    noise = engine.fit_with_noise(engine.initial_model)[1]
    cogging = term("motor-cogging", amplitude=0.1, phase=0.0, order=float(order))
    fitted = engine.fixed(engine.initial_model.with_term(cogging, 1), noise)
    assert (unresolved_order(engine.regression, fitted, 0) is not None) == unresolved


def test_a_slope_over_a_degree_is_a_step_with_a_doubt() -> None:
    found = diagnose([joint(np.radians(1.3))], JOINT).diagnosis
    smooth = [s for s in found.steps if {"spring-balancer", "joint-gravity"} & set(s.effects)]
    assert smooth
    assert not any(step.certain for step in smooth)
    assert all("short-record" in [doubt.code for doubt in step.doubts] for step in smooth)


@pytest.mark.parametrize(
    ("gain", "friction", "doubted"),
    [
        ("load-gain", "pulley-capstan", True),
        ("torque-constant", "gear-efficiency", True),
        ("torque-constant", "pulley-capstan", False),
        ("cell-gain", "pulley-capstan", False),
    ],
)
def test_a_gain_beside_friction_of_the_load_may_be_its_asymmetry(
    gain: str, friction: str, doubted: bool
) -> None:
    """Unless another output, which the friction changes too, separates them, or it is larger."""
    other = {"friction": 0.05} if friction == "pulley-capstan" else {"efficiency": 0.9}
    for size, small in ((0.02, True), (0.5, False)):
        terms = [term(gain, gain_error=size), term(friction, **other)]
        engine = engine_for(terms, Ride(samples=600))
        present, noise = engine.fit_with_noise(engine.initial_model)
        hypothesis = present.hypothesis
        for own in terms:
            hypothesis = hypothesis.with_term(own, engine.regression.n_runs)
        reason = asymmetric_friction(engine.regression, engine.fixed(hypothesis, noise), 0)
        assert (reason is not None) == (doubted and small)


@pytest.mark.parametrize(("turns", "counted"), [(3.0, "3 turns on the drum"), (0.2, ""), (8.0, "")])
def test_a_radius_wrong_by_whole_layers_may_be_turns_that_were_not_counted(
    turns: float, counted: str
) -> None:
    """The same closed form: r + n g is the radius with n turns below; more than 6 are not there."""
    drum = replace(SPIRAL.drum, kind="archimedean", layer_growth=0.003)
    profile = replace(SPIRAL, drum=drum, reference=replace(SPIRAL.reference, wound_turns=6.0))
    engine = selection_engine(prepare([made(profile=profile)], profile), load_catalogue())
    noise = engine.fit_with_noise(engine.initial_model)[1]
    error = term("drum-radius", radius_error=-0.003 * turns)
    reason = miscounted_turns(
        engine.regression, engine.fixed(engine.initial_model.with_term(error, 1), noise), 0
    )
    assert (reason or "")[: len(counted)] == counted
    assert bool(reason) == bool(counted)
