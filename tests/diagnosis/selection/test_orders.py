"""The spectrum over the motor angle, and series of orders on an axis of known ripple."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.prediction_cache import masked
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.orders import periodogram
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.series import orders_of
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

CATALOGUE = load_catalogue()
COGGING = CATALOGUE["motor-cogging"]
AXIS = AxisProfile(name="motor")
RATE = 200.0
SPEED = 1.2
"""rad/s: about a thousand samples per turn, and a frequency of 14 Hz at order 70."""
NOISE = 2e-3
SIZES = {3: 0.05, 17: 0.03, 34: 0.02, 70: 0.008}


def run_of(name: str, seed: int, sizes: dict[int, float], seconds: float = 22.0) -> Run:
    """Back and forth at one speed, Coulomb friction of 0.03 N m, white noise."""
    time = np.arange(0.0, seconds, 1 / RATE)
    speed = SPEED * np.where(time < seconds / 2, 1.0, -1.0)
    angle = np.cumsum(speed) / RATE
    torque = 0.03 * np.sign(speed)
    torque += sum(size * np.cos(order * angle + order) for order, size in sizes.items())
    torque += NOISE * np.random.default_rng(seed).standard_normal(len(time))
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run(name, time, channels, {})


@pytest.fixture(scope="module")
def answer() -> object:
    return diagnose([run_of("a", 1, SIZES), run_of("b", 2, SIZES)], AXIS, CATALOGUE)


def test_a_series_of_orders_is_one_step(answer: object) -> None:
    terms = answer.result.final.hypothesis.terms
    cogging = [term for term in terms if term.effect.id == "motor-cogging"]
    assert len(cogging) == 1
    assert set(orders_of(cogging[0])) == set(SIZES)
    others = [term.effect for term in terms if term not in cogging]
    assert [effect.family for effect in others] == ["motor friction"]
    assert answer.diagnosis.verdict == "explained"


def test_amplitudes_and_phases_are_those_of_the_ripple(answer: object) -> None:
    step = next(s for s in answer.diagnosis.steps if "motor-cogging" in s.effects)
    data = step.to_json()
    found = {item["order"]: item["amplitude"] for item in data["orders"]}
    for order, size in SIZES.items():
        assert found[order]["value"] == pytest.approx(size, abs=5 * found[order]["std"])
        assert found[order]["std"] < 0.05 * size
    assert list(found) == sorted(SIZES, key=lambda order: -SIZES[order])


def test_every_order_to_half_the_samples_per_turn_is_scanned() -> None:
    regression, fitted, inverse_sigma = fitted_axis({})
    scan = periodogram(regression, fitted.hypothesis, COGGING, fitted.residual, inverse_sigma)
    per_turn = 2 * np.pi / (SPEED / RATE)
    assert scan.orders[0] == 1
    assert len(scan.orders) == pytest.approx(per_turn / 2, rel=0.02)


def test_power_of_an_order_is_the_decrease_of_chi_square() -> None:
    """Against least squares on the rows, within the approximation of the columns' lengths."""
    regression, fitted, inverse_sigma = fitted_axis({17: 0.01})
    scan = periodogram(regression, fitted.hypothesis, COGGING, fitted.residual, inverse_sigma)
    assert scan.peaks(0.0)[0] == 17
    columns = []
    for phase in (0.0, np.pi / 2):
        recording = regression.dataset.recordings[0]
        wave = np.sin(17 * recording.signals.motor_angle + phase)
        columns.append(masked(recording, "motor_torque", wave) * inverse_sigma)
    whitened = fitted.residual * inverse_sigma
    left = np.linalg.lstsq(np.array(columns).T, whitened, rcond=None)[1][0]
    exact = float(whitened @ whitened) - float(left)
    assert scan.power[16] == pytest.approx(exact, rel=0.03)


def test_noise_alone_has_no_peak() -> None:
    """1 % of scans may have one: of 100, at most five (probability of more: 5e-4)."""
    regression, fitted, inverse_sigma = fitted_axis({})
    random = np.random.default_rng(5)
    powers, alarms = [], 0
    for _ in range(100):
        residual = random.standard_normal(regression.n_rows) / inverse_sigma
        scan = periodogram(regression, fitted.hypothesis, COGGING, residual, inverse_sigma)
        powers.append(scan.power[scan.power > 0])
        alarms += bool(scan.peaks(0.0))
    assert alarms <= 5
    assert float(np.mean(np.concatenate(powers))) == pytest.approx(2.0, rel=0.1)


def scanned(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Orders and power of a motion that goes as far as 0.6 rad/s in that time."""
    short = run_of("short", 1, {17: 0.05}, seconds)
    engine = selection_engine(prepare([short], AXIS), CATALOGUE)
    measured = engine.regression.residual(engine.initial_model)
    weight = np.ones(engine.regression.n_rows)
    scan = periodogram(engine.regression, engine.initial_model, COGGING, measured, weight)
    return scan.orders, scan.power


def test_from_half_a_turn_on_orders_of_three_periods_are_scanned() -> None:
    """Of 0.38 of a turn, an order is open by two or three; 0.57 shows three periods of order 6."""
    assert not len(scanned(4.0)[0])
    orders, power = scanned(6.0)
    assert np.all(power[:5] == 0.0)
    assert power[5] > 0.0
    assert abs(int(orders[np.argmax(power)]) - 17) <= 1


@pytest.mark.slow
def test_an_order_is_named_where_the_motor_turns_less_than_once() -> None:
    runs = [run_of(name, seed, {12: 0.05}, seconds=9.0) for seed, name in enumerate("abcd")]
    found = diagnose(runs, AXIS, CATALOGUE).diagnosis
    assert found.verdict == "explained"
    (cogging,) = [step for step in found.steps if step.effects[0] == "motor-cogging"]
    values = cogging.parameters["motor-cogging"]
    assert values["order"].value == 12
    assert values["amplitude"].value == pytest.approx(0.05, rel=0.05)


def fitted_axis(sizes: dict[int, float]) -> tuple[object, object, np.ndarray]:
    engine = selection_engine(prepare([run_of("a", 3, sizes)], AXIS), CATALOGUE)
    fitted, _ = engine.fit_with_noise(engine.initial_model)
    sigma = np.full(engine.regression.n_rows, NOISE) * engine.regression.segments[0].band.gain
    return engine.regression, fitted, 1 / np.maximum(sigma, 1e-9)
