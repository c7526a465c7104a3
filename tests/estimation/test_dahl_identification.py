"""Pulley groups identified from runs of the simulator's pulleys."""

from __future__ import annotations

from math import pi, sin
from typing import Any

import numpy as np
import pytest

from estimation_plant import WRAPS, cell_readings, wander
from winchkit.catalog import find
from winchkit.errors import RunError, UsageError
from winchkit.estimation import DahlEstimator, Kernels
from winchkit.estimation.dahl_identification import (
    PulleyRecord,
    correlation_time,
    covariance_of,
    identify_dahl,
    record_of,
)
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.schema.read import read_profile, read_programme, read_simbench
from winchkit.sim.record import simulate

PROFILE = WinchProfile(
    name="w",
    drum=DrumSpec("grooved", 0.06, groove_pitch=0.005),
    gearbox=GearboxSpec(ratio=20.0),
    reference=ReferenceSpec(cable_length=8.0, wound_turns=4.0),
    cable=CableSpec(diameter=0.004),
    pulley=tuple(PulleySpec(0.04, wrap) for wrap in WRAPS),
)
ARM = float(np.hypot(0.06, 0.005 / (2 * pi)))


def noisy(seed: int, noise: float = 0.5, seconds: float = 30.0, **physics: float) -> PulleyRecord:
    rng = np.random.default_rng(seed)
    _, platform, wound = wander(seconds)
    cell = cell_readings(platform, wound, **physics)  # type: ignore[arg-type]
    return PulleyRecord(cell + rng.normal(0, noise, len(cell)), platform, wound)


@pytest.mark.parametrize("shape", [1.0, 1.5])
def test_the_numbers_of_an_independent_plant_are_found(shape: float) -> None:
    found = identify_dahl([noisy(1, shape=shape)], [WRAPS])
    (group,) = found.groups
    for value, std, true in zip(
        (group.friction, group.stiffness, group.shape),
        group.std,
        (0.02, 1500.0, shape),
        strict=True,
    ):
        # Four standard deviations, and what the plant's own way of stepping differs by.
        assert value == pytest.approx(true, abs=4 * std, rel=2e-3)
        assert 0 < std < 0.02 * true
    assert found.residual_std == pytest.approx(0.5, rel=0.1)
    assert found.at_bound == ()


def test_stds_hold_what_noise_does_to_the_values(kernels: Kernels) -> None:
    records = [noisy(seed, 1.0, 12.0) for seed in range(12)]
    fits = [identify_dahl([one], [WRAPS], shape=1.0, kernels=kernels) for one in records]
    for name, index in (("friction", 0), ("stiffness", 1)):
        values = [getattr(fit.groups[0], name) for fit in fits]
        told = float(np.median([fit.groups[0].std[index] for fit in fits]))
        # A spread of 12 lies within 0.55 to 1.5 of the true one in 99 cases of a hundred.
        assert 0.5 < np.std(values, ddof=1) / told < 1.6
    assert all(fit.groups[0].std[2] == 0.0 for fit in fits)


def test_two_groups_of_different_presliding_are_distinguished(kernels: Kernels) -> None:
    _, platform, wound = wander(20.0, 25.0)
    rng = np.random.default_rng(5)
    far = cell_readings(platform, wound, (pi,), 0.02, 8000.0)
    cell = cell_readings(far, wound, (pi / 2,), 0.04, 300.0) + rng.normal(0, 0.2, len(far))
    record = PulleyRecord(cell, platform, wound)
    found = identify_dahl([record], [(pi / 2,), (pi,)], shape=1.0, kernels=kernels)
    near, other = found.groups
    assert near.friction == pytest.approx(0.04, rel=0.02)
    assert near.stiffness == pytest.approx(300.0, rel=0.03)
    assert other.friction == pytest.approx(0.02, rel=0.03)
    assert other.stiffness == pytest.approx(8000.0, rel=0.1)


def test_what_is_identified_serves_the_estimator() -> None:
    found = identify_dahl([noisy(2)], [WRAPS])
    _, platform, wound = wander(20.0)
    cell = cell_readings(platform, wound)
    estimator = DahlEstimator(found.groups, cell_std=0.5)
    rows = np.array([estimator.update(t, x) for t, x in zip(cell, wound, strict=True)])
    assert np.max(np.abs(rows[200:, 0] - platform[200:])) < 0.5
    assert np.all(rows[200:, 1] > 0.5)
    assert np.all(rows[200:, 1] < 1.0)


def test_the_friction_at_the_start_is_found() -> None:
    _, platform, wound = wander(30.0)
    cell = cell_readings(platform, wound)
    cut = 700
    record = PulleyRecord(cell[cut:], platform[cut:], wound[cut:])
    found = identify_dahl([record], [WRAPS], shape=1.0)
    # The walk starts at the cell: friction counts along paying out.
    slide = sum(0.02 * 2 * sin(wrap / 2) for wrap in WRAPS) * cell[cut]
    expected = (platform[cut] - cell[cut]) / slide
    assert found.starts[0] == pytest.approx(expected, abs=0.05)
    assert found.groups[0].friction == pytest.approx(0.02, rel=0.01)


def test_a_cable_that_never_moves_identifies_nothing() -> None:
    rng = np.random.default_rng(0)
    still = PulleyRecord(300 + rng.normal(0, 1, 200), np.full(200, 300.0), np.zeros(200))
    (group,) = identify_dahl([still], [WRAPS]).groups
    assert np.isnan(group.std[1])
    assert np.isnan(group.std[2])


def test_too_little_is_refused() -> None:
    with pytest.raises(UsageError, match="at least 20 samples"):
        identify_dahl([PulleyRecord(*np.ones((3, 5)))], [WRAPS])
    with pytest.raises(UsageError, match="0 pulley groups"):
        identify_dahl([noisy(0, seconds=2.0)], [])


def run_of(record: PulleyRecord, **extra: np.ndarray) -> Run:
    channels = {
        "motor_angle": Channel(record.wound / ARM * 20.0, "rad"),
        "tension": Channel(record.cell, "N"),
        **{name: Channel(values, "N") for name, values in extra.items()},
    }
    return Run("r", np.arange(len(record.cell)) / 50.0, channels)


def test_a_run_is_read_with_its_gaps_left_out() -> None:
    record = noisy(3, seconds=4.0)
    load = record.platform.copy()
    load[[5, 6, 90]] = np.nan
    read = record_of(run_of(record, load=load), PROFILE)
    kept = np.isfinite(load)
    assert np.array_equal(read.cell, record.cell[kept])
    assert np.array_equal(read.platform, load[kept])
    assert np.allclose(np.diff(read.wound), np.diff(record.wound[kept]), atol=1e-12)


def test_a_run_without_the_platforms_end_is_refused() -> None:
    with pytest.raises(RunError, match="load_mass"):
        record_of(run_of(noisy(3, seconds=4.0)), PROFILE)


def test_correlation_time_of_an_autoregression() -> None:
    rng = np.random.default_rng(1)
    white = rng.normal(0, 1, 100_000)
    assert correlation_time(white, [len(white)]) == pytest.approx(1.0, abs=0.1)
    red = np.zeros_like(white)
    for k in range(1, len(red)):
        red[k] = 0.8 * red[k - 1] + white[k]
    # (1 + ρ)/(1 − ρ) of a first-order autoregression.
    assert correlation_time(red, [40_000, 60_000]) == pytest.approx(9.0, rel=0.1)
    assert correlation_time(np.zeros(50), [50]) == 1.0


def test_covariance_is_that_of_linear_least_squares() -> None:
    rng = np.random.default_rng(2)
    jacobian = rng.normal(0, 1, (4000, 3)) * np.array([1.0, 1e4, 1e-3])
    residuals = rng.normal(0, 2.0, 4000)
    found = covariance_of(residuals, jacobian, [4000])
    expected = 4.0 * np.linalg.inv(jacobian.T @ jacobian)
    assert np.allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(expected)), rtol=0.1)


def test_directions_without_data_are_nan() -> None:
    rng = np.random.default_rng(2)
    one, two = rng.normal(0, 1, (2, 500))
    jacobian = np.column_stack([one, two, two, np.zeros(500)])
    found = np.diag(covariance_of(rng.normal(0, 1, 500), jacobian, [500]))
    assert np.isfinite(found).tolist() == [True, False, False, False]


@pytest.mark.slow
def test_a_simulated_bench_gives_back_what_it_hides() -> None:
    """Recorded with drive, ramp, noise and quantisation: 0.012 and 0.5 N/mm stand in its file."""
    bench = read_simbench(find("sim", "demo-presliding-pulleys"))
    profile = read_profile(find("profiles", bench.bench.winch["A"].profile))
    programme = read_programme(find("sim", "programme-demo"))
    records = [record_of(run, profile) for run in simulate(bench, {"A": profile}, programme)]
    wraps = tuple(pulley.wrap for pulley in profile.pulley)
    found = identify_dahl(records, [wraps], shape=1.0)
    (group,) = found.groups
    assert group.friction == pytest.approx(0.012, abs=4 * group.std[0])
    assert group.stiffness == pytest.approx(500.0, abs=4 * group.std[1])
    assert group.std[0] < 5e-4
    assert found.residual_std == pytest.approx(0.8, rel=0.1)


@pytest.mark.parametrize(
    ("records", "wraps", "told"),
    [
        ([], PROFILE, "wraps is a WinchProfile; pass a list of lists of wrap angles"),
        (None, [[1.0]], "records is None; pass a list of PulleyRecord"),
        ("runs.csv", [[1.0]], "records is a str"),
        ([None], [[1.0]], r"records\[0\] is None; pass a PulleyRecord: record_of"),
        ([], [["a"]], r"wraps\[0\].* is no array of real numbers"),
        ([], [], "0 samples and 0 pulley groups cannot be identified"),
    ],
)
def test_wrong_arguments_are_refused_in_one_sentence(records: Any, wraps: Any, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        identify_dahl(records, wraps)


@pytest.mark.parametrize("run", [None, "a.csv", []])
def test_a_record_is_of_a_run(run: Any) -> None:
    with pytest.raises(UsageError, match=r"run is .*; pass a Run"):
        record_of(run, PROFILE)
