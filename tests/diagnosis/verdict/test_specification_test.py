"""Curves without a name: what they take, and when they take a name away."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ks_2samp

from diagnosis_runs import CATALOGUE, GROOVED, NOISE, Array, Ride, made, term, with_channel
from winchkit.diagnosis.data.dataset import prepare
from winchkit.diagnosis.diagnose import diagnose, selection_engine
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.prediction_cache import masked
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.stepwise import SelectionResult, stepwise_selection
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.curve_fits import (
    BasisProducts,
    PartialRegression,
    explained_by,
    ranked_curves,
)
from winchkit.diagnosis.verdict.specification_null import Named, null_excess
from winchkit.diagnosis.verdict.specification_test import (
    SpecificationTest,
    judge_with_specification_test,
)
from winchkit.diagnosis.verdict.spline_alternatives import (
    CurveFamily,
    curves,
    laws_over,
    linear_splines,
)
from winchkit.effects.term import Term
from winchkit.runs.run import Run

OUTPUTS = ("cable_length", "tension", "motor_torque")
RIDES = (Ride(samples=600, stroke=400.0), Ride(samples=600, stroke=150.0))


def speed_of(run: Run) -> Array:
    """Of the cable paid out, m/s, of a grooved drum of 60 mm behind 20.4 turns."""
    return np.asarray(-np.gradient(run["motor_angle"], run.time) / 20.4 * 0.06)


def driven(hidden: tuple[Term, ...] = (), drag: float = 0.0) -> list[Run]:
    """Fast and slow under two loads, twice; ``drag``: N per (m/s)² on the cable, in the cell."""
    out = []
    for i, (ride, mass) in enumerate((r, m) for r in RIDES for m in (10.0, 20.0)):
        for repeat in range(2):
            run = made(10 * i + repeat, GROOVED, hidden, load_mass=mass, ride=ride, encoder=0.0)
            v = speed_of(run)
            run = with_channel(run, "tension", run["tension"] + drag * v * np.abs(v))
            out.append(run)
    return out


@given(seed=st.integers(0, 999), free=st.integers(0, 4), width=st.integers(1, 5))
def test_a_gain_is_what_least_squares_takes(seed: int, free: int, width: int) -> None:
    random = np.random.default_rng(seed)
    jacobian, basis = random.standard_normal((60, free)), random.standard_normal((20, 60))
    residual, inverse_sigma = random.standard_normal(60), np.exp(random.standard_normal(60))
    law = random.standard_normal((20, width))
    partial = PartialRegression(residual, jacobian, inverse_sigma)
    whitened = basis * inverse_sigma
    left = whitened - (whitened @ partial.explained) @ partial.explained.T
    products = BasisProducts(whitened @ whitened.T, left @ left.T)
    gain = products.explained_ss(law, left @ partial.residual)

    def squares(columns: Array) -> float:
        columns = columns * inverse_sigma[:, None]
        result = np.linalg.lstsq(columns, residual * inverse_sigma, rcond=None)[0]
        return float(np.sum((residual * inverse_sigma - columns @ result) ** 2))

    assert partial.chi_square == pytest.approx(squares(jacobian))
    together = squares(np.hstack([jacobian, basis.T @ law]))
    assert gain == pytest.approx(squares(jacobian) - together, rel=1e-6, abs=1e-9)


def test_what_the_model_explains_whole_leaves_curves_nothing() -> None:
    """Rounding of a column that is there already must not be blown up into evidence."""
    random = np.random.default_rng(1)
    basis, inverse_sigma = random.standard_normal((20, 80)), np.ones(80)
    residual = random.standard_normal(80)
    partial = PartialRegression(residual, basis[:1].T, inverse_sigma)
    left = basis - (basis @ partial.explained) @ partial.explained.T
    only = np.eye(20)[:, :1]
    products = BasisProducts(basis @ basis.T, left @ left.T)
    assert products.explained_ss(only, left @ partial.residual) == 0.0


def test_linear_splines_add_up_to_one_and_reproduce_straight_lines() -> None:
    knots = np.linspace(-2.0, 5.0, 20)
    values = np.linspace(-2.0, 5.0, 101)
    basis = linear_splines(values, knots)
    assert basis.sum(axis=0) == pytest.approx(np.ones(101))
    assert knots @ basis == pytest.approx(values)
    laws = laws_over(knots, "speed", level=False)
    assert all(law.shape[0] == 20 and n_parameters >= 1 for law, n_parameters in laws)


def test_a_curve_of_the_winding_pulls_the_torque_by_virtual_work() -> None:
    """A radius larger by a share is a straight curve over the length: both outputs follow it."""
    share = 0.01
    # Slowly: a curve does not ask how the weight's acceleration changes with it.
    slow = Ride(samples=2000, period=20.0)
    run = made(0, GROOVED, noise=dict.fromkeys(OUTPUTS, 0.0), ride=slow, encoder=0.0)
    regression = TimeSeriesRegression(prepare([run], GROOVED))
    radius = term("drum-radius", radius_error=share * 0.06)
    wrong = regression.change(Hypothesis().with_term(radius, regression.n_runs))
    lengths = [r.smooth.at.free_length for r in regression.dataset.recordings]
    knots = np.linspace(min(map(np.min, lengths)), max(map(np.max, lengths)), 20)
    basis = [linear_splines(length, knots) for length in lengths]
    curve = np.zeros(regression.n_rows)
    family = CurveFamily("winding", "cable_length", (), knots, basis)
    for own, columns in family.columns(regression):
        curve[own] = (share * (knots - 4.0)) @ columns
    for output, close in (("cable_length", 0.02), ("motor_torque", 0.02)):
        rows = np.concatenate([np.r_[s.rows] for s in regression.segments if s.output == output])
        across = wrong[rows] - wrong[rows].mean(), curve[rows] - curve[rows].mean()
        assert np.linalg.norm(across[0] - across[1]) < close * np.linalg.norm(across[0]), output


def test_a_square_drag_is_not_called_viscous() -> None:
    answer = diagnose(driven(drag=12.0), GROOVED)
    result = answer.diagnosis
    assert result.verdict in {"unknown", "partly"}
    assert not result.steps
    assert any(place.variable == "speed" for place in result.where)


def test_a_viscous_drag_keeps_its_name() -> None:
    hidden = (term("pulley-viscous", viscosity=6.0),)
    result = diagnose(driven(hidden), GROOVED).diagnosis
    assert result.verdict == "explained"
    assert [step.effects for step in result.steps] == [("pulley-viscous",)]


def ended_with(engine: TimeSeriesSelection, *added: Term) -> SelectionResult:
    """Result of a search that ended with these effects."""
    initial_model, begun_noise = engine.fit_with_noise(engine.initial_model)
    hypothesis = initial_model.hypothesis
    for one in added:
        hypothesis = hypothesis.with_term(one, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(hypothesis, begun_noise)
    left = engine.lack_of_fit_test(final, noise)
    return SelectionResult(
        initial_model,
        begun_noise,
        engine.lack_of_fit_test(initial_model, begun_noise),
        True,
        final.hypothesis,
        final,
        noise,
        left,
        left.p_value < 0.02,
        (),
        (),
        0.0,
    )


def test_a_curve_that_explains_another_part_takes_no_name_away() -> None:
    """A drift over time is larger than the cogging, of which it replaces the lesser part."""
    hidden = term("motor-cogging", amplitude=3e-3, phase=0.0, order=1.0)
    runs = []
    for place, period in enumerate((14.0, 16.0, 18.0, 20.0)):
        # The cogging is zero where the motor rests: there it is a function of time.
        ride = Ride(samples=600, stroke=38 * np.pi, period=period)
        for repeat in range(2):
            run = made(10 * place + repeat, GROOVED, (hidden,), ride=ride, encoder=0.0)
            elapsed = (run.time - run.time[0]) / np.ptp(run.time)
            drift = 0.015 * np.exp(-elapsed / 0.2)
            runs.append(with_channel(run, "motor_torque", run["motor_torque"] + drift))
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    result = ended_with(engine, hidden)
    assert result.lack_of_fit
    test, penalty = SpecificationTest(engine, result), engine.penalty_per_parameter
    own, partial = test.explained_ss([0]), test.partial([0])
    best, *_ = ranked_curves(engine.regression, partial, ["motor_torque"], penalty)
    assert best.variable == "time"
    assert best.net_gain > 1.5 * own
    beside = explained_by(engine.regression, test.partial(()), best)
    assert best.explained_ss - beside < 0.5 * own
    assert test.outperforming_curve([0]) is None


def test_an_addition_that_a_curve_beats_is_dropped_and_the_rest_keeps_its_name() -> None:
    """A faint bend of the length was fitted with a wrong ratio, beside a friction that is there."""
    runs = []
    for run in driven((term("motor-coulomb", torque=0.05),)):
        far = (run["cable_length"] - 4.0) / 0.5
        bent = run["cable_length"] + 1.5e-5 * far**3
        runs.append(with_channel(run, "cable_length", bent, "m"))
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    result = ended_with(
        engine, term("motor-coulomb", torque=0.05), term("gear-ratio", ratio_error=1e-5)
    )
    result = replace(result, lack_of_fit=False)
    judged = judge_with_specification_test(engine, result)
    assert judged.verdict == "explained"
    assert judged.reported.final.labels == ("motor-coulomb",)
    (note,) = judged.notes
    assert note.startswith("closest, but not named: gear-ratio; an unknown curve of the ")
    assert "over the cable length explains more" in note


@cache
def rubbed() -> tuple[TimeSeriesSelection, SelectionResult]:
    """A search that found dry friction of the motor."""
    engine = selection_engine(
        prepare(driven((term("motor-coulomb", torque=0.05),)), GROOVED), CATALOGUE
    )
    return engine, stepwise_selection(engine)


def test_what_is_left_beside_all_terms_is_what_the_fit_left() -> None:
    engine, result = rubbed()
    test = SpecificationTest(engine, result)
    whole = test.partial(())
    assert 0.99 * result.final.chi_square < whole.chi_square <= result.final.chi_square * (1 + 1e-9)
    without = test.partial([0])
    refitted = engine.refit(result.final.hypothesis.without(0), result.noise)
    # What sampling may have rounded is taken out of the one and not of the other.
    assert 0.95 * refitted.chi_square < without.chi_square <= refitted.chi_square * (1 + 1e-9)


def test_curves_are_searched_only_where_the_named_effects_act() -> None:
    engine, result = rubbed()
    partial = SpecificationTest(engine, result).partial([0])
    penalty = engine.penalty_per_parameter
    ranked = ranked_curves(engine.regression, partial, ["motor_torque"], penalty)
    assert {curve.place for curve in ranked} == {"motor_torque", "cable_force", "winding"}
    assert ranked[0].place in {"motor_torque", "cable_force"}
    assert ranked[0].net_gain == max(curve.net_gain for curve in ranked)
    assert ranked_curves(engine.regression, partial, [], penalty) == []


def with_residual(partial: PartialRegression, residual: Array) -> PartialRegression:
    other = copy(partial)
    other.residual = residual
    return other


def test_the_null_distribution_is_that_of_fits_to_drawn_data() -> None:
    """Every draw once more, by least squares on whole data instead of by inner products."""
    engine, result = rubbed()
    regression, noise, penalty = engine.regression, result.noise, engine.penalty_per_parameter
    test = SpecificationTest(engine, result)
    partial = test.partial([0], discretization=False)
    own = result.final.jacobian[:, regression.unknowns_of(0, result.final.hypothesis)]
    columns = own * partial.inverse_sigma[:, None]
    columns = columns / np.sqrt(np.sum(columns**2, axis=0))
    columns -= partial.explained @ (partial.explained.T @ columns)
    whole = regression.change(result.final.hypothesis)
    change = partial.projected(whole)
    places = [("motor_torque", "speed"), ("cable_force", "cable_length")]
    families = list(curves(regression, ["motor_torque"], places))
    drawn = null_excess(regression, noise, partial, Named(change, columns, 1, whole), families)
    random, redrawn = np.random.default_rng(3), []
    basis = np.linalg.qr(columns)[0]
    for _ in range(80):
        factor = np.sqrt(noise.dof / random.chisquare(noise.dof))[regression.band_of_row]
        white = random.standard_normal(regression.n_rows) * factor
        white -= partial.explained @ (partial.explained.T @ white)
        seen = change + white
        left = white - basis @ (basis.T @ white)
        gain = max(
            fitted.net_gain
            for fitted in ranked_curves(
                regression,
                with_residual(partial, seen),
                ["motor_torque"],
                penalty,
            )
            if (fitted.place, fitted.variable) in places
        )
        redrawn.append(gain - (float(seen @ seen) - float(left @ left) - penalty))
    assert ks_2samp(drawn, redrawn).pvalue > 1e-3


def test_the_null_distribution_has_the_rounding_of_the_instrument() -> None:
    """A torque in steps of ten times its noise: a curve over its rounding takes no name away.

    Simulated: the same instrument with a random zero.
    """
    step, size, gain = 0.1, 0.01, term("torque-constant", gain_error=0.05)
    noise = {**NOISE, "motor_torque": size}
    runs = [
        made(seed, GROOVED, (gain,), noise, load_mass=mass, ride=ride, encoder=0.0)
        for seed, (ride, mass) in enumerate([(r, m) for r in RIDES for m in (10.0, 20.0)] * 2)
    ]
    runs = [
        with_channel(run, "motor_torque", np.round(run["motor_torque"] / step + 0.2) * step, "N m")
        for run in runs
    ]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    regression, result, random = (
        engine.regression,
        ended_with(engine, gain),
        np.random.default_rng(5),
    )
    excess = []
    test = SpecificationTest(engine, result)
    critical = test._critical_excess([0])
    for _ in range(30):
        error, zero = np.zeros(regression.n_rows), random.random()
        for segment in regression.segments:
            recording = regression.dataset.recordings[segment.run]
            exact, white = recording.nominal_smooth[segment.output], random.standard_normal
            seen = exact + noise[segment.output] * white(len(exact))
            if segment.output == "motor_torque":
                seen = (np.round(seen / step + zero) - zero) * step
            error[segment.rows] = masked(recording, segment.output, seen - exact)
        final = replace(result.final, residual=error)
        test = SpecificationTest(engine, replace(result, final=final))
        found = test._excess([0], discretization=False)
        excess.append(0.0 if found is None else found[1])
    # Gaussian noise exceeds 15 in less than 0.5 % of cases.
    assert np.mean(np.array(excess) > 15.0) > 0.3
    assert max(excess) < critical
