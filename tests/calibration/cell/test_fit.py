"""The fit of a calibration against numpy's own, its creep, and figures of merit by hand."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from random import Random

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.stats import t as student

from winchkit.arrays import Array
from winchkit.calibration.cell.files import PointFile, read_points
from winchkit.calibration.cell.fit import WEIGHT_CLASSES, fit_cell
from winchkit.calibration.cell.static_effects import static_effects
from winchkit.calibration.cell.weighing_order import plan
from winchkit.errors import FileError, RunError, UsageError
from winchkit.schema.calibration import CalibrationPoint

LOADS = (0.0, 20.0, 50.0, 100.0, 150.0, 200.0)


def points(
    bow: float = 0.0, lag: float = 0.0, noise: float = 0.0, series: int = 3
) -> list[CalibrationPoint]:
    """True force over 1.02 and 0.5 N of zero; a bow and a lag on the way down, N."""
    random, out = Random(5), []
    for number in range(1, series + 1):
        for going, loads in (("up", LOADS), ("down", LOADS[::-1][1:])):
            for load in loads:
                shape = 4 * bow * load / 200 * (1 - load / 200)
                back = lag * math.sin(math.pi * load / 200) if going == "down" else 0.0
                shown = (load + shape + back) / 1.02 - 0.5 + random.gauss(0, noise)
                out.append(CalibrationPoint(load, shown, 0.01, going, number))  # type: ignore[arg-type]
    return out


def test_a_line_is_the_inverse_of_the_regression_of_the_reading_on_the_load() -> None:
    """Closed form: x = a + b y by least squares, c1 = 1/b, c0 = -a/b."""
    measured = points(bow=0.3, noise=0.05)
    fit = fit_cell(measured)
    x = np.array([p.indicated for p in measured])
    y = np.array([p.load for p in measured])
    (b, a), covariance = np.polyfit(y, x, 1, cov=True)
    assert fit.coefficients == pytest.approx((-a / b, 1 / b))
    slopes = np.array([[a / b**2, -1 / b], [-1 / b**2, 0]])
    assert fit.std == pytest.approx(np.sqrt(np.diag(slopes @ covariance @ slopes.T)))
    residuals = y - (x - a) / b
    assert fit.residuals == pytest.approx(residuals)
    assert fit.residual_std == pytest.approx(math.sqrt(np.sum(residuals**2) / (len(x) - 2)))


def test_a_parabola_is_that_of_scipy() -> None:
    """Least squares of the readings, by an optimiser of others."""
    measured = points(bow=0.3, noise=0.05)
    x = np.array([p.indicated for p in measured])
    y = np.array([p.load for p in measured])

    def reading(load: Array, c0: float, c1: float, c2: float) -> Array:
        return np.asarray((-c1 + np.sqrt(c1**2 - 4 * c2 * (c0 - load))) / (2 * c2))

    start = np.polyfit(x, y, 2)[::-1]
    wanted, covariance = curve_fit(reading, y, x, p0=start, xtol=1e-12, ftol=1e-12)
    fit = fit_cell(measured, "quadratic")
    squares = [np.sum((reading(y, *c) - x) ** 2) for c in (fit.coefficients, wanted)]
    assert squares[0] <= squares[1] * (1 + 1e-9)
    assert fit.coefficients == pytest.approx(wanted, rel=1e-3)
    assert fit.std == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-2)


@pytest.mark.parametrize("samples", [1, 10, 50])
def test_noise_in_the_readings_leaves_the_gain_and_its_interval_right(samples: int) -> None:
    """Noise of 8 % of the span: the regression of the load on the reading is 1 to 3 % low.

    The 95 % interval of c1 and c0 has its coverage in 400 calibrations (t of n − 2).
    """
    rng = np.random.default_rng(samples)
    loads = np.arange(48) * 0.2
    inside, gains = np.zeros(2), []
    for _ in range(400):
        readings = 10 + 7.13 * loads + rng.normal(0, 5.4, (samples, 48)).mean(axis=0)
        measured = [CalibrationPoint(a, b) for a, b in zip(loads, readings, strict=True)]
        fit = fit_cell(measured)
        error = np.array(fit.coefficients) - (-10 / 7.13, 1 / 7.13)
        inside += np.abs(error) < student.ppf(0.975, 46) * np.array(fit.std)
        gains.append(fit.coefficients[1])
    assert inside / 400 == pytest.approx(0.95, abs=0.04)
    assert np.mean(gains) == pytest.approx(1 / 7.13, abs=4 * np.std(gains) / 20 + 1e-4)


def test_a_common_error_of_the_weights_is_in_the_uncertainty() -> None:
    """True loads are off by up to the tolerance of class M3, evenly distributed."""
    rng, tolerance = np.random.default_rng(3), WEIGHT_CLASSES["M3"]
    loads, found = np.arange(20) * 10.0, []
    for error in rng.uniform(-tolerance, tolerance, 1000):
        readings = 40 + 7.13 * loads * (1 + error) + rng.normal(0, 0.02, 20)
        measured = [CalibrationPoint(a, b) for a, b in zip(loads, readings, strict=True)]
        fit = fit_cell(measured, tolerance=tolerance)
        found.append([*fit.coefficients, *fit.std])
    scatter, stated = np.std(found, axis=0)[:2], np.mean(found, axis=0)[2:]
    assert stated == pytest.approx(scatter, rel=0.08)


def test_a_moved_zero_is_no_hysteresis() -> None:
    """0.5 N less after the full load, at every load; and a closed loop, which returns."""
    shifted = [
        dataclasses.replace(p, indicated=p.indicated - (0.5 if p.going == "down" else 0.0))
        for p in points(series=1)
    ]
    fit = fit_cell(shifted)
    assert fit.zero_return.value == pytest.approx(-0.5 * 1.02 / 200, rel=0.02)
    assert fit.hysteresis.value == pytest.approx(0.0, abs=1e-12)
    closed = fit_cell(points(lag=1.0))
    assert closed.zero_return.value == pytest.approx(0.0, abs=1e-12)


def test_the_truth_is_found_within_its_uncertainty() -> None:
    fit = fit_cell(points(noise=0.05))
    assert fit.coefficients[1] == pytest.approx(1.02, abs=4 * fit.std[1])
    assert fit.coefficients[0] == pytest.approx(0.51, abs=4 * fit.std[0])


def test_hysteresis_by_hand() -> None:
    """Going down it lags by 1 N at mid span: 0.5 % of 200 N."""
    fit = fit_cell(points(lag=1.0))
    assert fit.hysteresis.value == pytest.approx(1.0 / 200, rel=0.03)
    assert fit.repeatability.value == pytest.approx(0.0, abs=1e-12)


def test_a_bow_is_non_linearity_and_a_parabola_takes_it_away() -> None:
    line, parabola = fit_cell(points(bow=1.0)), fit_cell(points(bow=1.0), "quadratic")
    assert 0.4 / 200 < line.nonlinearity.value < 1.0 / 200
    assert parabola.residual_std < 0.05 * line.residual_std
    assert parabola.nonlinearity.value == line.nonlinearity.value


def test_repeatability_is_the_spread_between_series() -> None:
    fit = fit_cell(points(noise=0.2, series=20))
    assert fit.repeatability.value == pytest.approx(0.2 * 1.02 / 200, rel=0.15)
    assert fit.repeatability.std == pytest.approx(
        fit.repeatability.value / math.sqrt(2 * 209), 0.05
    )


def test_what_is_not_known_is_not_invented_but_reported() -> None:
    once = [CalibrationPoint(load, load) for load in LOADS[:4]]
    once[1] = CalibrationPoint(20.0, 20.1)
    fit = fit_cell(once)
    assert math.isnan(fit.hysteresis.value)
    assert math.isnan(fit.repeatability.value)
    assert {"one way only", "one series only", "only 4 loads"} <= {
        word for word in ("one way only", "one series only", "only 4 loads")
        if any(word in warning for warning in fit.warnings)
    }  # fmt: skip


def test_a_wrong_weight_is_pointed_at() -> None:
    measured = points(noise=0.01)
    measured[4] = CalibrationPoint(150.0, measured[4].indicated + 5.0, 0.01, "up", 1)
    assert any("150 N" in warning and "off" in warning for warning in fit_cell(measured).warnings)


def test_a_cell_that_is_wired_the_wrong_way_round_is_reported() -> None:
    turned = [CalibrationPoint(p.load, -p.indicated, 0.0, p.going, p.series) for p in points()]
    with pytest.raises(RunError, match="turn it round"):
        fit_cell(turned)


def test_a_cell_that_does_not_carry_the_weights_is_reported() -> None:
    random = Random(8)
    elsewhere = [CalibrationPoint(p.load, 98 + random.gauss(0, 0.2)) for p in points()]
    with pytest.raises(RunError, match="does not follow the loads"):
        fit_cell(elsewhere)


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ([CalibrationPoint(0, 0), CalibrationPoint(10, 10)], "2 different loads"),
        ([CalibrationPoint(load, 5.0) for load in LOADS], "the same at every load"),
        ([CalibrationPoint(load, math.nan) for load in LOADS], "no number"),
    ],
)
def test_points_that_carry_no_calibration(measured: list[CalibrationPoint], words: str) -> None:
    with pytest.raises(RunError, match=words):
        fit_cell(measured)


def test_the_weights_go_up_and_down_without_repeating_the_top() -> None:
    steps = plan("0 2 5 kg", 2)
    kilograms = [round(step.load / 9.80665, 6) for step in steps]
    assert kilograms == [0, 2, 5, 2, 0, 2, 5, 2, 0]
    assert [step.going for step in steps] == ["up"] * 3 + ["down"] * 2 + ["up"] * 2 + ["down"] * 2
    assert [step.series for step in steps] == [1] * 5 + [2] * 4


@pytest.mark.parametrize("weights", ["", "5", "0 5 2 kg", "0 x kg", "0 1 2 m", "0 0 1 kg"])
def test_weights_that_cannot_be_meant(weights: str) -> None:
    with pytest.raises(UsageError):
        plan(weights, 1)


STEPS = (0, 40, 100, 160, 200, 160, 100, 40, 0)
SHARE, NOISE = 2e-3, 0.02
"""Of a change of load between 1 and 30 minutes; N."""


def measured(
    path: Path, *, creep: float, loop: float = 0.0, seed: int = 0, count: int = 20, head: str = "s"
) -> PointFile:
    """Readings every 20 s, each load hung 10 s before its first one and held for ``count``."""
    random, rows, changes = np.random.default_rng(seed), [], list[tuple[float, float]]()
    factor = {"s": 1.0, "min": 60.0}[head]
    for place, load in enumerate(STEPS):
        start = 20.0 * count * place
        if place:
            changes.append((start - 10.0, load - STEPS[place - 1]))
        for k in range(count):
            time = start + 20.0 * k
            past = sum(step * math.log((time - at) / 60) for at, step in changes) / math.log(30)
            lag = loop * load * (1 if place > 4 else -1)
            reading = load + creep * past + lag + random.normal(0, NOISE)
            rows.append(f"{time / factor:.9g},{load},{reading:.5f}")
    path.write_text("\n".join([f"time [{head}],load [N],reading [N]", *rows]) + "\n")
    return read_points(path)


@pytest.mark.parametrize("head", ["s", "min"])
def test_readings_at_one_load_give_the_creep_with_its_uncertainty(
    tmp_path: Path, head: str
) -> None:
    errors = []
    for seed in range(60):
        found = measured(tmp_path / "p.csv", creep=SHARE, seed=seed, head=head).creep
        errors.append((found.value - SHARE) / found.std)
    assert abs(float(np.mean(errors))) < 0.45
    assert 0.75 < float(np.std(errors)) < 1.25


@pytest.mark.parametrize(
    ("creep", "loop", "name"),
    [(SHARE, 0.0, "creep"), (0.0, 2e-3, "cell-hysteresis"), (0.0, 0.0, "")],
)
def test_creep_is_distinguished_from_hysteresis_by_the_times(
    tmp_path: Path, creep: float, loop: float, name: str
) -> None:
    found = measured(tmp_path / "p.csv", creep=creep, loop=loop)
    effects = static_effects(found.points, found.unit, found.creep_shape).effects
    assert [e.effect for e in effects if e.effect != "cell-gain"] == ([name] if name else [])
    assert all(
        e.value == pytest.approx(creep or loop, abs=4 * e.std) for e in effects if e.effect == name
    )


def test_one_reading_for_each_load_gives_no_creep_of_its_own(tmp_path: Path) -> None:
    found = measured(tmp_path / "p.csv", creep=SHARE, count=1)
    assert math.isnan(found.creep.value)
    assert len(found.creep_shape) == len(found.points) == len(STEPS)


def test_stamps_are_times_and_times_increase(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    rows = [f"2026-03-01 10:0{k}:00,{load},{load}.1" for k, load in enumerate(STEPS)]
    path.write_text("\n".join(["time,load [N],reading [N]", *rows]) + "\n")
    assert len(read_points(path).creep_shape) == len(STEPS)
    for time in ("0", "x"):
        path.write_text(f"time [s],load [N],reading [N]\n1,0,0\n{time},5,5\n")
        with pytest.raises(FileError, match=r":3: .*time"):
            read_points(path)
