"""How sure fitted values are: intervals that hold the truth as often as they say."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from diagnosis_runs import GROOVED, Array, Ride, made, term

from winchkit.diagnosis.dataset import prepare
from winchkit.diagnosis.fit import fit
from winchkit.diagnosis.gate import blocks_of
from winchkit.diagnosis.noise import noise_from_repeats
from winchkit.diagnosis.problem import Hypothesis, Problem
from winchkit.diagnosis.uncertainty import estimates, unknown_std

RIDE = Ride(samples=400)
GAIN = term("cell-gain", gain_error=0.01)
CASES = 150
REPEATS = 6


def white(random: np.random.Generator, count: int) -> Array:
    return np.asarray(random.standard_normal(count))


def coloured(random: np.random.Generator, count: int) -> Array:
    """First-order noise of the same size, correlated over ten samples."""
    out, state = np.empty(count), random.standard_normal()
    for index, kick in enumerate(random.standard_normal(count)):
        state = 0.9 * state + np.sqrt(1 - 0.9**2) * kick
        out[index] = state
    return out


@pytest.mark.parametrize("kind", [white, coloured])
def test_two_deviations_hold_the_truth_in_95_of_100_cases(
    kind: Callable[[np.random.Generator, int], Array],
) -> None:
    """A linear toy: the gain of a cell, on repeats enough to know the noise."""
    runs = [made(seed, GROOVED, (GAIN,), {"tension": 0.0}, ride=RIDE) for seed in range(REPEATS)]
    problem = Problem(prepare(runs, GROOVED))
    clean = problem.base.copy()
    start = Hypothesis().with_term(term("cell-gain"), REPEATS)
    blocks = blocks_of(problem)
    off, said = [], []
    for seed in range(CASES):
        random = np.random.default_rng(seed)
        problem.base = clean + np.concatenate(
            [problem._masked(s, 0.8 * kind(random, s.band.count)) for s in problem.segments]
        )
        first = fit(problem, start, np.ones(problem.rows))
        noise = noise_from_repeats(problem, first.residual, np.zeros((problem.rows, 0)))
        found = fit(problem, start, noise.weight(problem))
        std = unknown_std(problem, found, noise, blocks)
        ((_, values),) = estimates(problem, found, std)
        off.append(values["gain_error"].value - 0.01)
        said.append(values["gain_error"].std)
    ratio = np.array(off) / np.array(said)
    # The larger of two estimates is on the safe side: from 95 % of 150, less three deviations.
    assert np.mean(np.abs(ratio) < 2) > 0.90
    # And no more than twice too wide.
    assert 0.5 < np.sqrt(np.mean(ratio**2)) < 1.2
    assert abs(np.mean(off)) < 4 * np.std(off) / np.sqrt(CASES)


def test_estimates_have_values_units_and_deviations_in_files_terms() -> None:
    terms = (term("cable-elongation-linear", axial_stiffness=2e5), GAIN)
    runs = [
        made(int(mass) + seed, GROOVED, terms, load_mass=mass, ride=RIDE)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    problem = Problem(prepare(runs, GROOVED))
    start = Hypothesis()
    for item in terms:
        start = start.with_term(item, 4)
    first = fit(problem, start, np.ones(problem.rows))
    noise = noise_from_repeats(problem, first.residual, np.zeros((problem.rows, 0)))
    found = fit(problem, start, noise.weight(problem))
    std = unknown_std(problem, found, noise, blocks_of(problem))
    (rope, stretch), (cell, gain) = estimates(problem, found, std)
    assert (rope.effect.id, cell.effect.id) == ("cable-elongation-linear", "cell-gain")
    stiffness = stretch["axial_stiffness"]
    assert (stiffness.unit, gain["gain_error"].unit) == ("N", "1")
    # A compliance of relative deviation s is a stiffness of the same.
    coordinate = problem.nuisance_columns.shape[1]
    assert stiffness.std / stiffness.value == pytest.approx(
        float(std[coordinate] / found.vector[coordinate]), rel=0.01
    )
    assert abs(stiffness.value - 2e5) < 4 * stiffness.std
    assert abs(gain["gain_error"].value - 0.01) < 4 * gain["gain_error"].std
