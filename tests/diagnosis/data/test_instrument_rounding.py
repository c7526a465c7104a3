"""The rounding of a measured force is an error of what is predicted from it.

The torque is in closed form: a force on a grooved drum times the cable per motor angle.
"""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Array
from winchkit.diagnosis.data.instrument_rounding import instrument_noise, rounding_errors
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run

RATE, COUNT = 25.0, 1500
ARM = (
    float(np.hypot(GROOVED.drum.winding_radius, (GROOVED.drum.groove_pitch or 0.0) / (2 * np.pi)))
    / GROOVED.gearbox.ratio
)
"""Torque per force, m."""
STEP = 10.0
"""N."""
TORQUE_NOISE = 0.2 * STEP * ARM


def run(seed: int, force: Array, noise: float) -> Run:
    """A winch that pays out and in under a force, of which a cell shows whole steps."""
    random = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    shown = np.round((force + random.normal(0, noise, COUNT)) / STEP) * STEP
    torque = GROOVED.gearbox.direction * ARM * force + random.normal(0, TORQUE_NOISE, COUNT)
    channels = {
        "motor_angle": Channel(40 * np.sin(0.5 * time), "rad"),
        "tension": Channel(shown, "N"),
        "motor_torque": Channel(torque, "N m"),
    }
    return Run(f"run-{seed}", time, channels, {"programme": "waves"})


def wave(level: float, size: float) -> Array:
    return level + size * np.sin(0.31 * np.arange(COUNT) / RATE)


@pytest.mark.parametrize("noise", [0.5, 1.5, 2.5])
def test_error_of_the_torque_by_a_rounded_tension(noise: float) -> None:
    """Mean square of the part that repeats share: the mean over many noises of the same force."""
    force = wave(300.0, 60.0)
    runs = [run(seed, force, noise) for seed in range(40)]
    shared = np.mean([each["tension"] for each in runs], axis=0) - force
    dataset = prepare(runs[:2], GROOVED)
    assert dataset.resolution["tension"] == pytest.approx(STEP)
    before = instrument_noise(dataset.recordings, dataset.resolution)
    assert before["tension"] == pytest.approx(noise, rel=0.2, abs=0.1 * STEP)
    found = list(rounding_errors(dataset, 0, "motor_torque", before))
    *_, by_tension = found  # after that of the torque itself
    assert by_tension.white == 0.0
    # Cosines and sines are both there, since the zero is not known: twice the mean square.
    expected = float(np.mean(np.sum(by_tension.components**2, axis=0))) / 2
    simulated = float(np.mean((ARM * shared) ** 2)) - (ARM * noise) ** 2 / 40
    assert expected == pytest.approx(simulated, rel=0.35, abs=(0.03 * STEP * ARM) ** 2)


def test_no_effect_is_named_for_the_rounding_of_the_load_cell() -> None:
    """Weights at rest between two steps: the mean reading is wrong by up to half a step."""
    loads = (343.0, 343.0, 157.5, 157.5)
    runs = [run(seed, wave(load, 1.0), 0.8) for seed, load in enumerate(loads)]
    error = [float(np.mean(each["tension"])) - load for each, load in zip(runs, loads, strict=True)]
    assert max(map(abs, error)) > 0.15 * STEP, "the readings are wrong"
    found = diagnose(runs, GROOVED).diagnosis
    assert found.verdict == "adequate"
    assert found.steps == ()


@pytest.mark.parametrize("step", [0.06, 0.08])
def test_a_rounded_torque_does_not_take_the_name_of_an_effect_away(step: float) -> None:
    """Losses of a fifth of a step: each load and direction has a rounding error of its own."""
    runs = []
    for seed, load in enumerate((395.1, 395.1, 138.3, 138.3, 237.1, 237.1)):
        random = np.random.default_rng(seed)
        time = np.arange(COUNT) / RATE
        angle = 40 * np.sin(0.5 * time)
        torque = GROOVED.gearbox.direction * load * ARM * np.ones(COUNT)
        torque *= np.where(torque * np.gradient(angle) > 0, 1 / 0.986, 0.986)
        torque += random.normal(0, 0.2 * step, COUNT)
        channels = {
            "motor_angle": Channel(angle, "rad"),
            "load": Channel(load + random.normal(0, 1.0, COUNT), "N"),
            "motor_torque": Channel(np.round(torque / step) * step, "N m"),
        }
        runs.append(Run(f"run-{seed}", time, channels, {"programme": f"{load:.0f}"}))
    found = diagnose(runs, GROOVED).diagnosis
    assert found.verdict == "explained"
    assert "gear-efficiency" in found.steps[0].effects
