"""Detectable sizes, and programmes that separate effects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy.stats import f, norm, t

from diagnosis_runs import CATALOGUE, GROOVED, NOISE, Array, Ride, made, term, white, with_channel
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.design.detectability import DetectionThreshold, detectable
from winchkit.diagnosis.design.discrimination import (
    information_of,
    next_runs,
    power_of,
    separation,
    weights_of,
)
from winchkit.diagnosis.design.plan import _fewest_runs, inseparable
from winchkit.diagnosis.design.plan import offers as plan_offers
from winchkit.diagnosis.design.programmes import CANDIDATE_PROGRAMMES, candidates, range_of_runs
from winchkit.diagnosis.plan import WinchPlan
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.results import Detectable, NextRun
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.scores import null_maxima
from winchkit.report.words.sentence import plan_texts

RIDE = Ride(samples=400)
ROPE = term("cable-elongation-linear", axial_stiffness=3e5)
FRAME = term("frame-compliance", stiffness=1.2e5)
BAR = DetectionThreshold(penalty_per_parameter=9.0, score_threshold=3.0)
NAMES = {kind.name for kind in CANDIDATE_PROGRAMMES}


@cache
def dataset(masses: tuple[float, ...] = (10.0,), warm: bool = False) -> Dataset:
    runs = [
        made(int(mass) + seed, GROOVED, load_mass=mass, ride=RIDE)
        for mass in masses
        for seed in range(2)
    ]
    if warm:
        degrees = np.linspace(20, 22, RIDE.samples)
        runs = [with_channel(run, "temperature", degrees, "degC") for run in runs]
    return prepare(runs, GROOVED)


def offers(first: str, second: str, noise: float = 1.0, warm: bool = False) -> tuple[NextRun, ...]:
    terms = {"cable-elongation-linear": ROPE, "frame-compliance": FRAME}
    pair = tuple(terms.get(name) or _usual(name) for name in (first, second))
    sizes = {output: noise * size for output, size in NOISE.items()}
    return next_runs(TimeSeriesRegression(dataset(warm=warm)), [(pair[0], pair[1])], white(sizes))


def _usual(effect_id: str) -> object:
    parameters = CATALOGUE[effect_id].parameters
    return term(effect_id, **{p.name: p.typical for p in parameters if p.role == "amplitude"})


def test_a_further_run_has_the_noise_of_the_diagnosis_per_frequency() -> None:
    """Of half the rate a coefficient has half the variance; few degrees of freedom weigh less."""
    fast, slow = (
        TimeSeriesRegression(prepare([made(ride=Ride(400, rate))], GROOVED)) for rate in (50, 25)
    )
    count = len(fast.bands)
    for dof, limit in ((np.inf, 9.0), (4.0, t.ppf(739 / 740, 4.0) ** 2)):
        noise = BandNoise(np.full(count, 0.04), np.full(count, dof), {}, from_repeats=True)
        weights = weights_of(fast, noise)
        assert weights(fast) == pytest.approx(5 * np.sqrt(9 / limit), rel=1e-3)
        assert weights(slow) == pytest.approx(5 * np.sqrt(2 * 9 / limit), rel=1e-3)


def test_the_first_run_belongs_to_the_shortest_set_that_separates_all_pairs() -> None:
    """Two pairs: one programme shows the first at once, the other both within two runs."""
    strengths, alike = np.array([[1000.0, 0.0], [9.2, 9.2]]), np.array([5.0, 5.0])
    assert _fewest_runs(strengths, alike) == pytest.approx([0.0, 2.0], abs=0.02)
    assert _fewest_runs(strengths[:, :1], alike) == pytest.approx([1.0, 0.0])
    assert not _fewest_runs(np.full((2, 1), 0.1), alike).any()


def test_nothing_to_separate_needs_no_run() -> None:
    assert next_runs(TimeSeriesRegression(dataset()), [], white(NOISE)) == ()


def test_cable_and_frame_are_distinguished_by_loads_over_the_stroke() -> None:
    found = offers("cable-elongation-linear", "frame-compliance")
    assert found
    for offer in found:
        assert offer.separates == ("cable-elongation-linear", "frame-compliance")
        assert offer.programme in NAMES
        assert 0.2 <= offer.power <= 1.0
    assert found[0].power == max(offer.power for offer in found)
    assert found[0].power > 0.9


def test_a_plan_offers_what_a_diagnosis_could_not_name_yet() -> None:
    """λ of 16 is no chance, but too little to be named among forty: twice the load shows more."""
    regression = TimeSeriesRegression(dataset())
    frame = [CATALOGUE["frame-compliance"]]
    strength = separation(regression, _usual("frame-compliance"), None, white(NOISE))
    noise = {output: size * np.sqrt(strength / 16) for output, size in NOISE.items()}
    for threshold, shown in ((BAR, ("frame-compliance",)), (DetectionThreshold(0.0, 3.84), ())):
        shows = {
            o.kind.name: o.shows
            for o in plan_offers(regression, [], white(noise), frame, threshold=threshold)
        }
        assert shows["full stroke, twice the load"] == shown
    assert BAR.power((np.sqrt(BAR.required_ss(1)) + norm.ppf(0.9)) ** 2, 1) == pytest.approx(
        0.9, 0.01
    )


def test_less_noise_is_more_power() -> None:
    best = [
        max(o.power for o in offers("cable-elongation-linear", "frame-compliance", noise))
        for noise in (0.3, 1.0, 3.0, 9.0)
    ]
    assert best[0] == pytest.approx(1.0)
    assert best == sorted(best, reverse=True)
    assert best[-1] < 0.9


def test_warmth_is_distinguished_by_warming_up_and_by_waiting() -> None:
    sizes = {output: 0.05 * size for output, size in NOISE.items()}
    pair = _usual("cable-thermal"), _usual("cable-creep")
    regression = TimeSeriesRegression(dataset(warm=True))
    power = {
        o.kind.name: o.powers[0]
        for o in plan_offers(regression, [pair], white(sizes), [], threshold=BAR)
    }
    assert power["five lengths with holds"] > 0.9
    alone = {
        kind.name: separation(run, pair[0], None, white(sizes))
        for kind, run in candidates(regression.dataset, range_of_runs(regression.dataset))
    }
    assert alone["full stroke, warmed up by 15 K"] > 10 * alone["full stroke"]


@pytest.mark.parametrize(
    ("first", "second"),
    [("drum-radius", "length-time-offset"), ("cable-elongation-linear", "frame-compliance")],
)
def test_runs_so_far_and_runs_to_come_say_what_both_say_at_once(first: str, second: str) -> None:
    """λ of all runs is that of the first ones and what the others add: nothing else is shared."""
    pair = [{"cable-elongation-linear": ROPE, "frame-compliance": FRAME}.get(e) or _usual(e)
            for e in (first, second)]  # fmt: skip
    sizes = {"cable_length": NOISE["cable_length"]}
    weights = white(sizes)
    runs = [made(int(m), noise=sizes, load_mass=m, ride=RIDE) for m in (10.0, 20.0, 35.0)]
    past, coming, both = (
        TimeSeriesRegression(prepare(part, GROOVED)) for part in (runs[:1], runs[1:], runs)
    )
    known = information_of(past, *pair, weights)
    assert known is not None
    assert known.residual_ss == pytest.approx(separation(past, *pair, weights))
    grown = separation(coming, *pair, weights, known=known)
    assert known.residual_ss + grown == pytest.approx(separation(both, *pair, weights), rel=1e-3)
    assert (
        known.residual_ss + grown >= known.residual_ss + separation(coming, *pair, weights) - 1e-6
    )


def test_a_run_that_shows_nothing_of_a_rival_distinguishes_it_too() -> None:
    """What was taken for creep must creep again: by itself such a run could be without it."""
    time = np.arange(0.0, 60.0, 0.1)
    drift = np.linspace(20.0, 26.0, len(time))

    @dataclass(frozen=True)
    class Wait(Ride):
        @property
        def angle(self) -> Array:
            return np.asarray(np.clip(self.time, 0.0, 2.0) * 20.0)

    ride = Wait(samples=len(time), rate=10.0)
    thermal = term("cable-thermal", expansion=2e-5)
    creep = term("cable-creep", creep_stiffness=2e5, time_constant=60.0)
    warming = with_channel(made(ride=ride), "temperature", drift, "degC")
    steady = with_channel(made(ride=ride), "temperature", 20.0 + 0 * drift, "degC")
    past, coming = (TimeSeriesRegression(prepare([run], GROOVED)) for run in (warming, steady))
    alone = power_of(separation(coming, thermal, creep, white(NOISE)))
    known = information_of(past, thermal, creep, white(NOISE))
    assert alone < 0.1
    assert power_of(separation(coming, thermal, creep, white(NOISE), known=known)) > 0.9


def test_what_no_motion_separates_is_left_to_the_card() -> None:
    """On a grooved drum a radius and a ratio are the same at every angle."""
    (offer,) = offers("drum-radius", "gear-ratio")
    assert offer.programme == CATALOGUE["drum-radius"].told_apart
    assert np.isnan(offer.power)


def test_the_plan_says_what_no_motion_separates() -> None:
    grooved = dataset()
    radius, ratio = _usual("drum-radius"), _usual("gear-ratio")
    regression = selection_engine(grooved, CATALOGUE).regression
    pairs = [(radius, ratio), (ROPE, FRAME)]
    found = plan_offers(regression, pairs, white(NOISE), [], threshold=BAR)
    assert inseparable(found, pairs) == [(radius, ratio)]
    # The best is the one that separates the other pair.
    assert found[0].powers[1] > 0.9
    plan = WinchPlan(tuple(pairs), grooved, range_of_runs(grooved), tuple(found), 2)
    lines = plan_texts(plan)
    assert lines[0].startswith("No motion within")
    assert "decides between drum-radius and gear-ratio. What does: " in lines[0]
    assert lines[0].endswith(CATALOGUE["drum-radius"].told_apart[1:])
    assert len(lines) == 1


@cache
def smallest(noise: float, masses: tuple[float, ...] = (10.0,)) -> dict[str, Detectable]:
    sizes = {output: noise * size for output, size in NOISE.items()}
    runs = [
        made(int(mass) + seed, GROOVED, noise=sizes, load_mass=mass, ride=RIDE)
        for mass in masses
        for seed in range(2)
    ]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    present, known = engine.fit_with_noise(engine.initial_model)
    scores = tuple(engine.scores(present, known))
    chance = null_maxima(engine.projected(present, known), engine.regression.n_rows)
    threshold = float(np.quantile(chance, 0.99))
    return {
        d.effect: d
        for d in detectable(scores, DetectionThreshold(engine.penalty_per_parameter, threshold))
    }


def test_half_the_noise_shows_half_the_size() -> None:
    loud, calm = smallest(1.0), smallest(0.5)
    for effect in ("cell-gain", "motor-coulomb", "drum-radius"):
        assert calm[effect].smallest == pytest.approx(loud[effect].smallest / 2, rel=0.1)
    stiffness = "cable-elongation-linear"
    assert calm[stiffness].smallest == pytest.approx(2 * loud[stiffness].smallest, rel=0.1)


@pytest.mark.parametrize("effect", ["cell-gain", "motor-coulomb", "drum-radius"])
def test_the_smallest_size_is_what_matched_filters_say(effect: str) -> None:
    """λ of the smallest size by its own signature in the noise that is there.

    The level is that of the largest score or, where lower, F of this signature alone: one over all
    candidates, with Satterthwaite's degrees of freedom.
    """
    engine = selection_engine(dataset(), CATALOGUE)
    item = smallest(1.0)[effect]
    regression = engine.regression
    shown = regression.change(
        engine.initial_model.with_term(
            term(effect, **{item.parameter: item.smallest}), regression.n_runs
        )
    )
    present, known = engine.fit_with_noise(engine.initial_model)
    inverse_sigma = known.inverse_sigma(regression)
    other = present.jacobian * inverse_sigma[:, None]
    left = shown * inverse_sigma
    if other.shape[1]:
        left = left - other @ np.linalg.lstsq(other, left, rcond=None)[0]
    chance = null_maxima(engine.projected(present, known), regression.n_rows)
    information = np.bincount(regression.band_of_row, weights=left**2, minlength=len(known.dof))
    dof = np.sum(information) ** 2 / np.sum(information**2 / known.dof)
    alone = f.isf(0.01 / len(engine.signatures.candidates), 1, dof)
    largest = float(np.quantile(chance, 0.99)) + engine.penalty_per_parameter
    needed = max(engine.penalty_per_parameter, min(largest, alone))
    assert np.sqrt(left @ left) == pytest.approx(np.sqrt(needed) + norm.ppf(0.9), rel=0.02)


@pytest.mark.parametrize(
    "encoder", [1e-4, 0.0], ids=["a noisy encoder", "an encoder that is still at rest"]
)
def test_chance_stays_what_chance_can_reach(encoder: float) -> None:
    """Of 40 candidates with one to three unknowns: decreases of χ² less their penalty."""
    runs = [made(seed, ride=RIDE, encoder=encoder) for seed in range(2)]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    present, noise = engine.fit_with_noise(engine.initial_model)
    chance = null_maxima(engine.projected(present, noise), engine.regression.n_rows)
    assert np.all(np.diff(chance) >= 0)
    assert np.median(chance) < 10
    assert np.quantile(chance, 0.99) < 100


def test_a_size_that_is_said_to_show_is_found() -> None:
    """In most of ten cases: 90 % is promised, eight of ten leaves room for chance."""
    size = smallest(1.0)["motor-coulomb"].smallest
    found = 0
    for case in range(10):
        runs = [
            made(100 + 2 * case + seed, GROOVED, [term("motor-coulomb", torque=size)], ride=RIDE)
            for seed in range(2)
        ]
        engine = selection_engine(prepare(runs, GROOVED), CATALOGUE, [CATALOGUE["motor-coulomb"]])
        present, noise = engine.fit_with_noise(engine.initial_model)
        found += engine.scores(present, noise)[0].net_gain > 0
    assert found >= 8
