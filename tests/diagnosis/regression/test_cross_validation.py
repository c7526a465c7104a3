"""Cross-validation against fits that leave the data out."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, NOISE, Array, Ride, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.cross_validation import (
    Folds,
    extrapolation,
    held_out,
    held_out_rms,
    left_out_steps,
    signed_rank_p_value,
)
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.term import Term

RIDE = Ride(samples=300)
GAIN = term("cell-gain", gain_error=0.02)
DRAG = term("motor-coulomb", torque=0.03)
"""Both linear in their unknown."""


def problem_of(
    terms: tuple[Term, ...], masses: tuple[float, ...] = (10.0, 20.0, 30.0), ride: Ride = RIDE
) -> TimeSeriesRegression:
    runs = [
        made(int(10 * mass) + seed, GROOVED, terms, load_mass=mass, ride=ride)
        for mass in masses
        for seed in range(2)
    ]
    return TimeSeriesRegression(prepare(runs, GROOVED))


def even(regression: TimeSeriesRegression) -> BandNoise:
    """The true noise."""
    power = np.array([NOISE[output] ** 2 for output, _, _ in regression.bands])
    return BandNoise(power, np.full(len(power), 1e9), dict(NOISE), from_repeats=True)


def fitted(regression: TimeSeriesRegression, *terms: Term) -> Fit:
    start = Hypothesis()
    for item in terms:
        start = start.with_term(item, regression.n_runs)
    return fit(regression, start, even(regression).inverse_sigma(regression))


def in_time(regression: TimeSeriesRegression, rows: Array) -> Array:
    return np.concatenate(regression.in_time(rows))


def left_out(
    regression: TimeSeriesRegression, found: Fit, folds: Folds
) -> list[tuple[Array, Array]]:
    """Per fold its whitened residual under unknowns solved from the other folds, and their step."""
    inverse_sigma = even(regression).inverse_sigma(regression)
    residual = in_time(regression, found.residual * inverse_sigma)
    columns = np.column_stack([in_time(regression, c * inverse_sigma) for c in found.jacobian.T])
    fold = np.concatenate(folds.of)
    out = []
    for index in range(folds.count):
        rest = fold != index
        step = np.linalg.lstsq(columns[rest], residual[rest], rcond=None)[0]
        out.append((residual[~rest] - columns[~rest] @ step, step))
    return out


@pytest.mark.parametrize("kind", ["blocks", "groups"])
def test_held_out_predictions_are_those_of_a_fit_to_the_other_folds(kind: str) -> None:
    regression = problem_of((GAIN, DRAG))
    found = fitted(regression, GAIN, DRAG)
    folds = regression.blocks if kind == "blocks" else regression.groups
    noise = even(regression)
    expected = left_out(regression, found, folds)
    squares = held_out(regression, found, noise, folds)
    assert squares == pytest.approx([float(left @ left) for left, _ in expected], rel=1e-6)
    steps = left_out_steps(regression, found, noise, folds)
    assert np.allclose(steps, [step for _, step in expected], rtol=1e-5, atol=1e-8)


def test_the_held_out_error_is_that_of_the_same_fits_in_the_outputs_units() -> None:
    regression = problem_of((GAIN,))
    found, folds = fitted(regression, GAIN), regression.groups
    steps = left_out(regression, found, folds)
    plain = in_time(regression, found.residual)
    columns = np.column_stack([in_time(regression, c) for c in found.jacobian.T])
    fold = np.concatenate(folds.of)
    left = plain - np.einsum("ij,ij->i", columns, np.array([s for _, s in steps])[fold])
    of = np.concatenate([[s.output] * s.band.count for s in regression.segments])
    for output, rms in held_out_rms(regression, found, even(regression), folds).items():
        compared = sum(np.count_nonzero(r.valid[output]) for r in regression.dataset.recordings)
        squares = float(np.sum(left[of == output] ** 2))
        assert rms == pytest.approx(np.sqrt(squares / compared), rel=1e-6)
        # Of the torque's noise what a Butterworth filter passes twice, up to 5 Hz of 25.
        passed = 1 / (1 + np.linspace(0, 1, 1000) ** 8)
        kept = np.mean(passed**2) * 5 / 25 if output == "motor_torque" else 1.0
        assert rms == pytest.approx(NOISE[output] * np.sqrt(kept), rel=0.15)


def test_an_unknown_at_its_bound_stays_there_whatever_is_held_out() -> None:
    """A friction that would have to drive: the model is the one without it, in every fold."""
    regression = problem_of((term("motor-coulomb", torque=-0.03),))
    noise, folds = even(regression), regression.groups
    found = fitted(regression, DRAG)
    assert found.hypothesis.terms[0].values["torque"] == 0.0
    none = held_out(regression, fitted(regression), noise, folds)
    assert held_out(regression, found, noise, folds) == pytest.approx(none)


def test_held_out_errors_are_larger_than_fitted_ones() -> None:
    regression = problem_of(())
    found, noise = fitted(regression, GAIN, DRAG), even(regression)
    inverse_sigma = noise.inverse_sigma(regression)
    assert held_out(regression, found, noise, regression.blocks).sum() > found.chi_square
    assert found.chi_square == pytest.approx(float(np.sum((found.residual * inverse_sigma) ** 2)))


def test_a_true_effect_is_accepted_and_a_false_one_is_not() -> None:
    regression = problem_of((GAIN,))
    noise, folds = even(regression), regression.blocks
    before, true, false = (
        held_out(regression, fitted(regression, *terms), noise, folds)
        for terms in ((), (GAIN,), (DRAG,))
    )
    assert true.sum() < before.sum()
    assert signed_rank_p_value(before, true) < 1e-6
    assert signed_rank_p_value(before, false) > 0.02


def test_folds_are_partitions() -> None:
    regression = problem_of(())
    for folds, count in ((regression.blocks, 48), (regression.groups, 3)):
        assert folds.count == count
        assert np.array_equal(np.unique(np.concatenate(folds.of)), np.arange(count))
    by_run = {}
    for segment, fold in zip(regression.segments, regression.blocks.of, strict=True):
        assert np.all(np.diff(fold) >= 0)
        assert np.array_equal(by_run.setdefault(segment.run, fold), fold)
    for segment, fold in zip(regression.segments, regression.groups.of, strict=True):
        assert np.all(fold == segment.run // 2)


def test_a_single_group_is_split_into_five_blocks_of_time() -> None:
    regression = problem_of((), masses=(10.0,))
    folds = regression.groups
    assert folds.count == 5
    assert np.array_equal(np.concatenate(folds.of), np.concatenate(regression.five_blocks.of))
    share = np.bincount(np.concatenate(folds.of)) / sum(len(fold) for fold in folds.of)
    assert np.allclose(share, 0.2, atol=0.03)


def test_unknowns_determined_by_one_fold_are_extrapolated() -> None:
    """An offset beside a gain of the cell needs both loads; the gain alone needs only one."""
    gentle = Ride(samples=300, stroke=40.0)  # so that its acceleration is no second load
    regression = problem_of((), (10.0, 20.0), gentle)
    noise = even(regression)
    groups = regression.groups
    assert groups.count == 2
    offset = term("cell-offset", force=1.0)
    alone = extrapolation(regression, fitted(regression, GAIN), noise, groups)
    both = extrapolation(regression, fitted(regression, GAIN, offset), noise, groups)
    assert alone < 0.1
    assert both > 10 * alone


class TestConfidence:
    """The chance that squares fell by luck."""

    def test_of_no_change_is_one(self) -> None:
        same = np.arange(1.0, 21.0)
        assert signed_rank_p_value(same, same) == 1.0

    def test_of_few_blocks_is_never_small(self) -> None:
        before, after = np.full(4, 10.0), np.full(4, 1.0)
        assert signed_rank_p_value(before, after) == 1.0
        assert signed_rank_p_value(after, before) == 1.0
