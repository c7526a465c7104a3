"""Instruments that were zeroed anew: found between repeats, fitted per run, never on clean runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from diagnosis_runs import GROOVED, SPIRAL, Ride, made, recorded, term, with_channel
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.zeroing import is_random_walk, zeroed_anew
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.runs.run import ANGLE_INTEGRATED, Run


def shifted(run: Run, name: str, offset: float) -> Run:
    return with_channel(run, name, run[name] + offset, run.channels[name].unit)


def test_white_noise_is_flagged_at_the_level_of_the_test() -> None:
    """2000 draws of the null at a level of 10⁻⁴: more than two occur in 1 of 900 cases."""
    random = np.random.default_rng(4)
    found = [zeroed_anew("tension", [random.normal(0, 1, 400)]) for _ in range(2000)]
    assert sum(one is not None for one in found) <= 2


def test_one_difference_is_a_t_test_of_batch_means() -> None:
    random = np.random.default_rng(1)
    values = 0.5 + random.normal(0, 1, 800)
    found = zeroed_anew("tension", [values])
    assert found is not None
    p_value = ttest_1samp(values.reshape(8, 100).mean(axis=1), 0).pvalue
    assert f"p = {p_value:.1g}" in found.text


def test_a_wander_is_no_new_zero() -> None:
    """200 recordings of two walks at a level of 1 %: more than eight are 1 in 1000."""
    walks = np.random.default_rng(2).normal(0, 1, (200, 2, 400)).cumsum(axis=2)
    found = [zeroed_anew("cable_length", list(pair)) for pair in walks]
    assert sum(one is not None for one in found) <= 8


@pytest.mark.slow
@pytest.mark.parametrize("walk", [0.0, 0.3, 1.0, np.inf])
def test_a_level_beside_a_walk_is_taken_for_one_in_a_hundredth_of_cases(walk: float) -> None:
    """400 recordings of three runs, white noise and a walk: more than eleven are 1 in 1000."""
    random = np.random.default_rng(5)
    steps = random.normal(0, 1, (400, 3, 8 * 20)).cumsum(axis=2).reshape(400, 3, 8, 20)
    white, walked = random.normal(0, 1, (400, 3, 8)), steps.mean(axis=3) / np.sqrt(20)
    means = walked if np.isinf(walk) else white + np.sqrt(walk) * walked
    assert sum(not is_random_walk(one) for one in means) <= 11


def test_levels_of_white_block_means_are_no_wander() -> None:
    """Levels of two standard deviations of a block, of both signs: all blocks show them."""
    random = np.random.default_rng(6)
    levels = 2.0 * np.array([[1.0], [-1.0], [1.0], [-1.0], [1.0], [-1.0]])
    drawn = [is_random_walk(levels + random.normal(0, 1, (6, 8))) for _ in range(100)]
    assert sum(drawn) <= 5


def test_a_new_zero_is_found_beside_what_the_temperature_does_and_not_instead() -> None:
    """Six differences of repeats at other temperatures: elongation by these, then new zeros too."""
    random = np.random.default_rng(7)
    warmer = random.normal(0, 3, 6)
    length = np.linspace(-1, 1, 400)
    thermal = [np.stack([np.full(400, w), w * length]) for w in warmer]
    noise = [random.normal(0, 0.1, 400) + 2.0 * w + 0.5 * w * length for w in warmer]
    assert zeroed_anew("cable_length", noise) is not None
    assert zeroed_anew("cable_length", noise, thermal) is None
    moved = [x + random.normal(0, 1) for x in noise]
    found = zeroed_anew("cable_length", moved, thermal)
    assert found is not None
    assert 0.3 < found.value < 2.0
    # With as many temperatures as differences nothing is left to test.
    assert zeroed_anew("cable_length", moved[:1], thermal[:1]) is None


@pytest.mark.slow
@pytest.mark.parametrize(("name", "size"), [("cable_length", 0.002), ("tension", 3.0)])
def test_an_offset_per_run_does_not_hide_an_effect(name: str, size: float) -> None:
    """A larger drum is named with and without offsets, with the same radius."""
    hidden = [term("drum-radius", radius_error=0.3e-3)]
    clean = [
        made(10 * i + k, GROOVED, hidden, load_mass=mass, ride=Ride(samples=800))
        for i, mass in enumerate((10.0, 25.0))
        for k in range(2)
    ]
    random = np.random.default_rng(5)
    moved = [shifted(run, name, size * random.normal()) for run in clean]
    before, after = compare(clean, GROOVED), compare(moved, GROOVED)
    assert [f.code for f in before.sanity] == []
    assert [(f.code, f.channel) for f in after.sanity] == [("zeroed-anew", name)]
    assert after.outputs[name].rms == pytest.approx(before.outputs[name].rms, rel=0.05)
    found = diagnose(moved, GROOVED).diagnosis
    assert found.verdict == "explained"
    values = {n: v for step in found.steps for n, v in step.parameters.items()}
    assert values["drum-radius"]["radius_error"].value == pytest.approx(0.3e-3, abs=0.02e-3)


@pytest.mark.parametrize("repeats", [1, 2])
def test_the_tension_of_another_load_is_no_zero(repeats: int) -> None:
    """A wrong zero of hundreds of newtons would leave no error, whatever was measured."""
    runs = [
        made(10 * i + k, GROOVED, load_mass=mass, ride=Ride(samples=800))
        for i, mass in enumerate((10.0, 25.0, 40.0))
        for k in range(repeats)
    ]
    turned = runs[1:] + runs[:1]
    mixed = [with_channel(a, "tension", b["tension"]) for a, b in zip(runs, turned, strict=True)]
    found = diagnose(mixed, GROOVED).diagnosis
    assert found.verdict in {"unknown", "undecided"}
    assert not any(f.code == "zeroed-anew" and f.channel == "tension" for f in found.sanity)
    assert not any(step.certain for step in found.steps)


def test_every_run_has_a_column_of_its_own() -> None:
    runs = [made(k, load_mass=10.0) for k in range(3)]
    runs = [shifted(run, "cable_length", 0.01 * k) for k, run in enumerate(runs)]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    assert (regression.n_run_offsets, regression.fits_offset) == (3, False)
    offsets, *_ = np.linalg.lstsq(
        regression.nuisance_columns, regression.nominal_residual, rcond=None
    )
    assert np.diff(offsets[:3]) == pytest.approx([0.01, 0.01], abs=1e-4)


def test_an_angle_that_counts_from_each_runs_start_has_an_offset_per_run() -> None:
    """Loads differ as well: without the metadata the difference of the offsets may be theirs."""
    runs = [made(k, GROOVED, load_mass=mass) for k, mass in enumerate((10.0, 25.0))]
    at = [0.0, 2.0]
    moved = [shifted(run, "motor_angle", angle) for run, angle in zip(runs, at, strict=True)]
    stated = [
        replace(run, metadata={**run.metadata, "motor_angle": ANGLE_INTEGRATED}) for run in moved
    ]
    known, wrong, right = (compare(own, GROOVED) for own in (runs, moved, stated))
    length = "cable_length"
    assert wrong.outputs[length].rms > 5 * known.outputs[length].rms
    assert right.outputs[length].rms == pytest.approx(known.outputs[length].rms, rel=0.1)
    assert [(f.code, f.channel) for f in right.sanity] == [("zeroed-anew", length)]
    # One run has the offset that every set of runs has.
    assert compare(stated[1:], GROOVED).sanity == ()


def test_recorded_repeats_share_one_zero() -> None:
    assert compare(recorded(), replace(SPIRAL, name="bench-spiral")).sanity == ()
