"""The cable sample by sample against the same effects over whole runs, and against a simulation."""

from __future__ import annotations

from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest

from winchkit.effects import Effect, Term, load_catalogue
from winchkit.effects.reference_motion import STANDARD_PROFILE
from winchkit.estimation.cable_state import CableEstimator, CableState, Sample
from winchkit.model.line import Line
from winchkit.model.stages import Signals, Stage

CATALOGUE = load_catalogue()
SIZES = {
    "gear-backlash": {"gap": 0.01},
    "cable-creep": {"creep_stiffness": 3e5, "time_constant": 4.0},
    "cable-hysteresis": {"fraction": 0.1},
    "pulley-dahl": {"friction": 0.03, "stiffness": 2e3},
    "cell-creep": {"fraction": 0.02, "time_constant": 6.0},
    "cell-hysteresis": {"fraction": 0.02},
    "cable-sag": {"mass_per_length": 0.5},
    "load-friction-at-place": {"force": 20.0, "place": 5.85, "width": 0.05},
    "guide-offset": {"offset": 0.02, "mismatch": 1e-4},
    "cable-elongation-quartic": {"k1": 1e5, "b2": 10.0, "b3": 0.0, "b4": 0.0},
    "cable-elongation-exponential": {"strain_scale": 1e-3, "force_scale": 100.0},
}
LIVE = [e for e in CATALOGUE if not e.not_in_control]
ON_LENGTH = [e for e in LIVE if e.stage <= Stage.FRAME]
ON_TENSION = [e for e in LIVE if e.stage > Stage.FRAME]


def term_of(effect: Effect) -> Term:
    own = SIZES.get(effect.id) or {
        p.name: p.typical for p in effect.parameters if p.role == "amplitude"
    }
    # A machine at rest under its load: CableState assumes it, a run declares it.
    rested = {"start": effect.rested} if effect.memory else {}
    return Term(effect, {**effect.null, **own, **rested})


def run() -> Signals:
    """To and fro with a reversal and a rest, the load changed slowly at a rest; 50 Hz."""
    time = np.arange(0.0, 40.0, 0.02)
    moves = np.interp(time, [0, 2, 8, 10, 16, 28, 34, 40], [0, 0, 60, 60, 20, 20, 50, 50])
    kernel = np.hanning(51) / np.hanning(51).sum()
    angle = np.convolve(np.pad(moves, 25, mode="edge"), kernel, mode="valid")
    load = np.interp(time, [0, 18, 26, 40], [200, 200, 320, 320])
    return Signals(time, angle, load=load, temperature=np.interp(time, [0, 40], [20, 32]))


def steady(signals: Signals) -> np.ndarray:
    """Where the load has not changed for a second."""
    return (signals.time < 18) | (signals.time > 27)


def followed(term: Term, signals: Signals, **given: np.ndarray) -> list[CableState]:
    """What CableEstimator makes of a run; ``given`` are the channels of its samples."""
    line = Line(STANDARD_PROFILE)
    rate = line.motion(signals).at.motor_rate
    now = CableEstimator(STANDARD_PROFILE, [term])
    columns = {"temperature": signals.temperature, **given}
    return [
        now.update(
            Sample(
                float(signals.time[k]),
                float(signals.motor_angle[k]),
                float(rate[k]),
                **{name: float(values[k]) for name, values in columns.items()},
            )
        )
        for k in range(len(signals.time))
    ]


@pytest.mark.slow
@pytest.mark.parametrize("effect", ON_LENGTH, ids=lambda e: e.id)
def test_the_length_is_that_of_the_whole_run(effect: Effect) -> None:
    signals, term = run(), term_of(effect)
    motion = Line(STANDARD_PROFILE).motion(signals)
    bare = Line(STANDARD_PROFILE).predict(motion)["cable_length"]
    whole = Line(STANDARD_PROFILE, (term.modifier(),)).predict(motion)["cable_length"]
    size = float(np.max(np.abs(whole - bare)))
    assert size > 1e-5
    length = np.array([s.length for s in followed(term, signals, load=signals.load)])
    # The load is smoothed and held to 0.3 % before it strains the cable, which explains the whole
    # difference.
    missed = np.abs(length - whole)
    assert np.max(missed[steady(signals)]) < 0.03 * size + 1e-6
    assert np.max(missed) < 0.06 * size + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("effect", ON_TENSION, ids=lambda e: e.id)
def test_the_tension_is_the_load_that_the_whole_run_had(effect: Effect) -> None:
    signals, term = run(), term_of(effect)
    line = Line(STANDARD_PROFILE, (term.modifier(),))
    cell = line.predict(line.motion(signals))["tension"]
    assert signals.load is not None
    size = float(np.max(np.abs(cell - signals.load)))
    assert size > 0.3
    states = followed(term, signals, cell=cell)
    tension = cell + np.array([s.correction for s in states])
    missed = np.abs(tension - signals.load)
    assert np.quantile(missed[steady(signals)], 0.95) < 0.02 * size
    # Friction lets the reading jump where the cable starts and stops: the run's direction is as
    # sharp as its noise permits, the estimator's is smooth below 1 mm/s.
    speed = np.abs(line.motion(signals).at.speed)
    known = (speed > 3e-3) | (speed < 1e-9)
    assert np.mean(known) > 0.9
    assert np.max(missed[known]) < 0.15 * size


def test_effects_of_one_chain_are_undone_together() -> None:
    names = ("cell-gain", "cell-offset", "pulley-dahl", "cable-weight")
    terms = [term_of(CATALOGUE[name]) for name in names]
    signals = run()
    line = Line(STANDARD_PROFILE, tuple(t.modifier() for t in terms))
    motion = line.motion(signals)
    cell = line.predict(motion)["tension"]
    now = CableEstimator(STANDARD_PROFILE, terms)
    assert signals.load is not None
    for k, time in enumerate(signals.time):
        rate = float(motion.at.motor_rate[k])
        sample = Sample(float(time), float(signals.motor_angle[k]), rate, cell=float(cell[k]))
        state = now.update(sample)
        if k > 5:
            assert cell[k] + state.correction == pytest.approx(signals.load[k], abs=0.6)
    assert np.max(np.abs(cell - signals.load)) > 10.0


def test_noise_of_the_cell_does_not_wear_a_loop_of_friction_away() -> None:
    """At rest a Dahl loop keeps its place, however long the cell's reading trembles."""
    effect = CATALOGUE["cable-hysteresis"]
    now = CableEstimator(STANDARD_PROFILE, [term_of(effect)])
    noise = np.random.default_rng(1).normal(0.0, 0.4, 3000)
    ramp = np.interp(np.arange(3000), [0, 200, 500], [100, 100, 200])
    lengths = [
        now.update(Sample(0.02 * k, 0.0, 0.0, cell=float(ramp[k] + noise[k]))).length
        for k in range(3000)
    ]
    held = np.array(lengths[700:])
    loop = STANDARD_PROFILE.cable.dead_length + (STANDARD_PROFILE.reference.cable_length or 0.0)
    assert abs(held[-1] - held[0]) < 0.1 * loop * 0.1 * 200 / 2e5


def test_what_is_not_measured_falls_back() -> None:
    terms = [term_of(CATALOGUE["cable-elongation-linear"]), term_of(CATALOGUE["cable-thermal"])]
    stiffness = terms[0].values["axial_stiffness"]
    stressed = 4.0 + STANDARD_PROFILE.cable.dead_length
    profile = replace(
        STANDARD_PROFILE, reference=replace(STANDARD_PROFILE.reference, cable_length=4.0)
    )
    angle = profile.reference.motor_angle
    blind = CableEstimator(profile, terms, weight=100.0).update(Sample(0.0, angle, 0.0))
    assert blind.length == pytest.approx(4.0 + stressed * 100.0 / stiffness, rel=1e-9)
    now = CableEstimator(profile, terms)
    assert now.update(Sample(0.0, angle, 0.0)).length == pytest.approx(4.0)
    seen = now.update(Sample(0.02, angle, 0.0, cell=200.0)).length
    # A cell that fell silent leaves the last tension standing.
    assert now.update(Sample(0.04, angle, 0.0, cell=nan)).length == seen > 4.0


def test_a_new_zero_is_no_motion() -> None:
    """A homing lets the motor angle jump; play and friction stay as they were."""
    backlash = term_of(CATALOGUE["gear-backlash"])
    now = CableEstimator(STANDARD_PROFILE, [backlash])
    bare = CableEstimator(STANDARD_PROFILE, [])
    for k in range(100):
        now.update(Sample(0.02 * k, 0.2 * k, 10.0))
    jumped = Sample(2.0, -300.0, 0.0)
    play = now.update(jumped).length - bare.update(jumped).length
    again = replace(jumped, time=2.02)
    assert now.update(again).length - bare.update(again).length == pytest.approx(play)
    turned = STANDARD_PROFILE.drum.winding_radius * backlash.values["gap"] / 2
    assert play == pytest.approx(turned, rel=0.2)


def test_what_control_leaves_out_has_a_reason_and_no_influence() -> None:
    reasons = {e.id: e.not_in_control for e in CATALOGUE if e.not_in_control}
    expected = {"encoder-slip", "drum-winding-tension", "cell-drift", "cell-lag", "pulley-inertia"}
    assert expected <= set(reasons)
    assert "length-time-offset" in reasons
    assert "motor-coulomb" in reasons
    assert not {"cable-creep", "pulley-dahl", "drum-radius", "cell-gain"} & set(reasons)
    terms = [term_of(CATALOGUE[name]) for name in expected]
    now = CableEstimator(STANDARD_PROFILE, terms)
    assert now.trivial
    state = now.update(Sample(1.0, 30.0, 5.0, cell=150.0))
    assert state == CableEstimator(STANDARD_PROFILE, []).update(Sample(1.0, 30.0, 5.0, cell=150.0))


def test_an_effect_of_ones_own_with_a_memory_takes_part_once_it_says_what_it_carries() -> None:
    own = replace(CATALOGUE["cable-creep"], id="mine", carry=None)
    assert "memory" in own.not_in_control
    assert not CATALOGUE["cable-creep"].not_in_control
    assert not isnan(
        CableEstimator(STANDARD_PROFILE, [term_of(own)]).update(Sample(0, 0, 0)).length
    )
