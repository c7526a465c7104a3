"""Decimation of long runs: kept and removed power, and the same verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED
from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Filtering, assemble
from winchkit.diagnosis.data.decimation import Decimation, decimation_for
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import spread_of
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.runs.run import Channel, Run

RATE = 1000.0
TENTH = Decimation(10, 25.0)
NOISE = {"cable_length": 3e-4, "tension": 0.8, "motor_torque": 5e-3}


def run_of(time: Array, **channels: Array) -> Run:
    return Run("long", time, {name: Channel(values, "") for name, values in channels.items()})


def sine(frequency: float, seconds: float = 8.0) -> tuple[Array, Array]:
    time = np.arange(round(seconds * RATE)) / RATE
    return time, np.sin(2 * np.pi * frequency * time + 0.3)


@pytest.mark.parametrize("frequency", [0.2, 3.0, 11.0, 25.0])
def test_what_lies_below_the_cut_off_stays_as_it_is(frequency: float) -> None:
    time, values = sine(frequency)
    decimated = TENTH.run(run_of(time, tension=values))
    inner = slice(10, -10)
    np.testing.assert_allclose(decimated["tension"][inner], values[::10][inner], atol=2e-3)


@pytest.mark.parametrize("frequency", [75.0, 90.0, 100.0, 180.0, 333.0])
def test_what_would_fold_back_below_it_is_gone(frequency: float) -> None:
    time, values = sine(frequency)
    decimated = TENTH.run(run_of(time, tension=values))
    assert np.max(np.abs(decimated["tension"][10:-10])) < 2e-3


def test_times_are_every_so_many_and_a_ramp_stays_a_ramp_to_its_ends() -> None:
    time = np.arange(5003) / RATE
    decimated = TENTH.run(run_of(time, motor_angle=7 * time + 2))
    np.testing.assert_array_equal(decimated.time, time[::10])
    np.testing.assert_allclose(decimated["motor_angle"], 7 * decimated.time + 2, rtol=1e-9)


def test_nothing_is_smeared_over_a_gap_in_time() -> None:
    time = np.concatenate([np.arange(2005) / RATE, 5 + np.arange(2000) / RATE])
    values = np.where(time < 3, 1.0, -4.0)
    decimated = TENTH.run(run_of(time, load=values))
    np.testing.assert_allclose(
        decimated["load"], np.where(decimated.time < 3, 1.0, -4.0), rtol=1e-9
    )


def test_a_sample_is_missing_where_most_of_what_it_stands_for_is() -> None:
    time = np.arange(3000) / RATE
    values = np.ones_like(time)
    values[1000:1500] = np.nan
    values[2002:2004] = np.nan
    missing = np.isnan(TENTH.run(run_of(time, tension=values))["tension"])
    assert missing[102:148].all()
    assert not missing[:99].any()
    assert not missing[152:].any()


def test_a_channel_without_any_value_stays_without() -> None:
    time = np.arange(3000) / RATE
    decimated = TENTH.run(run_of(time, temperature=np.full_like(time, np.nan)))
    assert np.isnan(decimated["temperature"]).all()


def test_short_runs_are_not_decimated_and_fast_signals_keep_their_band() -> None:
    random = np.random.default_rng(3)
    time = np.arange(300_000) / RATE
    slow = np.sin(2 * np.pi * 0.2 * time) + 1e-3 * random.standard_normal(len(time))
    quick = slow + 0.5 * np.sin(2 * np.pi * 110.0 * time)
    assert decimation_for([run_of(time[:100_000], motor_angle=slow[:100_000])]) is None
    chosen = decimation_for([run_of(time, motor_angle=slow)])
    assert chosen is not None
    assert chosen.factor == 4
    assert chosen.cut_off == pytest.approx(RATE / 16)
    held = decimation_for([run_of(time, motor_angle=slow, motor_torque=quick)])
    assert held is not None
    assert held.factor == 2
    assert held.cut_off > 110.0


def long_run() -> Run:
    """Two minutes at 1 kHz with an elastic cable and Coulomb friction of the motor."""
    random = np.random.default_rng(5)
    time = np.arange(0.0, 120.0, 1 / RATE)
    angle = 150 * np.sin(2 * np.pi * time / 9.0) + 60 * np.sin(2 * np.pi * time / 3.7)
    load = np.where(time < 60.0, 150.0, 320.0) + 20 * np.sin(2 * np.pi * time / 11.0)
    terms = true_terms()
    line = Line(GROOVED, modifiers_of(terms))
    shown = line.predict(line.motion(Signals(time, angle, load=load)))
    noisy = {
        name: values + NOISE[name] * random.standard_normal(len(time))
        for name, values in shown.items()
    }
    return run_of(time, motor_angle=angle, load=load, **noisy)


def true_terms() -> tuple[Term, ...]:
    return (
        Term(CATALOGUE["cable-elongation-linear"], {"axial_stiffness": 2e5}),
        Term(CATALOGUE["motor-coulomb"], {"torque": 0.1}),
    )


def test_decimated_by_twenty_the_same_values_are_found() -> None:
    """The torque's sign turns within milliseconds: taken after thinning it would be off."""
    run = long_run()
    dataset = assemble([run], GROOVED, Filtering(decimation=Decimation(20, 12.5)))
    assert len(dataset.recordings[0].signals.time) == len(run) // 20
    regression = TimeSeriesRegression(dataset)
    candidates = [term.effect for term in true_terms()]
    engine = TimeSeriesSelection(regression, Hypothesis(), candidates)
    begun = Hypothesis()
    for effect in candidates:
        begun = begun.with_term(Term(effect, effect.null), regression.n_runs)
    fitted, noise = engine.fit_with_noise(begun)
    std = spread_of(regression, fitted, noise, engine.regression.blocks).std
    for index, term in enumerate(true_terms(), start=1):
        name, true = next(iter(term.values.items()))
        found = fitted.hypothesis.terms[index - 1].values[name]
        scale = found / abs(fitted.vector[index])
        assert abs(found - true) < 4 * std[index] * scale, (name, found, true)
        assert found == pytest.approx(true, rel=0.02)
    # White noise of which a fortieth of the band is left, and nothing but it.
    for output, rms in noise.rms.items():
        left = np.sqrt(2 * 12.5 / RATE) * NOISE[output]
        assert rms == pytest.approx(left, rel=0.15), output


def test_a_short_run_is_prepared_alike_with_and_without_leave_to_thin() -> None:
    run = long_run()
    cut = replace(
        run,
        time=run.time[:5000],
        channels={n: replace(c, values=c.values[:5000]) for n, c in run.channels.items()},
    )
    free, held = (prepare([cut], GROOVED, decimate=decimate) for decimate in (True, False))
    assert free.notes == held.notes
    for output, values in free.recordings[0].nominal.items():
        np.testing.assert_array_equal(values, held.recordings[0].nominal[output])
