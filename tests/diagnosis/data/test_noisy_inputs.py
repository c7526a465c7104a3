"""Cable acceleration more accurate than by differences of samples: hysteresis and ripples.

The reference is a motion in closed form, with its second derivative, and a hysteresis integrated in
steps of a 64th of a sample.
"""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from diagnosis_runs import GROOVED, UNITS, Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.units import GRAVITY

RATE, COUNT, FINER = 25.0, 1500, 64
RATIO = GROOVED.gearbox.ratio
TURN = float(
    np.hypot(GROOVED.drum.winding_radius, (GROOVED.drum.groove_pitch or 0.0) / (2 * np.pi))
)
"""Cable per drum angle, m/rad."""
STIFFNESS, FRACTION = 2e4, 0.03
AMPLITUDE, ORDER, PHASE = 1.5e-3, 4.0, 0.4
NOISE = {"cable_length": 1e-4, "tension": 0.4, "motor_torque": 3e-3}


BRISK = ((60.0, 9.1), (1.0, 0.4))
GENTLE = ((10.0, 9.1), (0.5, 0.7))
"""Waves of the motor: amplitude in rad, period in s."""
DRIVEN = ((20.0, 0), (20.0, 1), (45.0, 10), (45.0, 11))
"""Two weights in kg, each twice, with the seeds of the noise."""
Waves = tuple[tuple[float, float], ...]


def motion(time: Array, waves: Waves) -> tuple[Array, Array, Array]:
    """Motor angle, rate and acceleration."""
    quick = [(a, 2 * np.pi / period) for a, period in waves]
    angle = np.asarray(sum(a * np.sin(w * time) for a, w in quick))
    rate = np.asarray(sum(a * w * np.cos(w * time) for a, w in quick))
    return angle, rate, np.asarray(sum(-a * w**2 * np.sin(w * time) for a, w in quick))


def loop(force: Array) -> Array:
    """Dahl's loop of the force over itself, dF/dT = ½ (1 − s F/F_c), by plain small steps."""
    held, out = 0.0, [0.0]
    for step, now in zip(np.diff(force).tolist(), force[1:].tolist(), strict=True):
        limit = FRACTION * now
        end = limit if step > 0 else -limit
        held = end + (held - end) * exp(-0.5 * abs(step) / limit)
        out.append(held)
    return np.array(out)


def recorded(
    seed: int, waves: Waves, mass: float, outputs: dict[str, Array], load: Array | None = None
) -> Run:
    """Samples of a truth with noise; the load as a channel, or the weight as what is known."""
    random = np.random.default_rng(seed)
    time = np.arange(COUNT) / RATE
    channels = {"motor_angle": Channel(motion(time, waves)[0], "rad")}
    for name, values in outputs.items():
        noise = NOISE[name] * random.standard_normal(COUNT)
        channels[name] = Channel(values + noise, UNITS[name])
    if load is not None:
        channels["load"] = Channel(load + 0.3 * random.standard_normal(COUNT), "N")
    return Run(
        f"run-{seed}", time, channels, {} if load is not None else {"load_mass": f"{mass} kg"}
    )


def rubbing(mass: float, seed: int, *, measured: bool) -> Run:
    """A run whose cable has a loop of hysteresis."""
    fine = np.arange(COUNT * FINER) / (RATE * FINER)
    angle, _, acceleration = motion(fine, BRISK)
    free = 4.0 - TURN * angle / RATIO
    load = mass * (GRAVITY + TURN * acceleration / RATIO)
    shown = free - (free + GROOVED.cable.dead_length) * loop(load) / STIFFNESS
    every = slice(None, None, FINER)
    outputs = {
        "cable_length": shown[every],
        "tension": load[every],
        "motor_torque": (load * TURN / RATIO)[every],
    }
    return recorded(seed, BRISK, mass, outputs, load[every] if measured else None)


def rippling(mass: float, seed: int, *, differences: bool) -> Run:
    """A run whose gear ripples at a third of the sampling rate, under a known weight.

    How the weight speeds up is exact, or differences of the samples' own differences.
    """
    time = np.arange(COUNT) / RATE
    angle, rate, acceleration = motion(time, GENTLE)
    turned = ORDER * angle + PHASE
    drum = angle / RATIO + AMPLITUDE * (np.sin(turned) - np.sin(PHASE))
    slope = 1 / RATIO + AMPLITUDE * ORDER * np.cos(turned)
    second = slope * acceleration - AMPLITUDE * ORDER**2 * np.sin(turned) * rate**2
    if differences:
        second = np.gradient(np.gradient(drum, time), time)
    load = mass * (GRAVITY + TURN * second)
    outputs = {
        "cable_length": 4.0 - TURN * drum,
        "tension": load,
        "motor_torque": load * TURN * slope,
    }
    return recorded(seed, GENTLE, mass, outputs)


def alone(found: Diagnosis, effect: str) -> list[tuple[float, float]]:
    """Values with their std of the one effect that is named, which must explain all there is."""
    assert found.verdict == "explained", found.notes
    assert [step.effects for step in found.steps] == [(effect,)]
    return [(e.value, e.std) for e in found.steps[0].parameters[effect].values()]


@pytest.mark.slow
@pytest.mark.parametrize("measured", [True, False])
def test_a_loop_is_explained_whole(measured: bool) -> None:
    runs = [rubbing(mass, seed, measured=measured) for mass, seed in DRIVEN]
    found = diagnose(runs, GROOVED).diagnosis
    for (value, std), truth in zip(
        alone(found, "cable-hysteresis"), (STIFFNESS, FRACTION), strict=True
    ):
        assert abs(value - truth) < 3 * std < truth
    length = found.outputs["cable_length"]
    assert length.rms_before > 1.5 * (length.noise_rms or 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("differences", [True, False])
def test_a_ripple_of_a_known_weight_is_explained_whole(differences: bool) -> None:
    runs = [rippling(mass, seed, differences=differences) for mass, seed in DRIVEN]
    found = diagnose(runs, GROOVED).diagnosis
    (amplitude, _), _, (order, _) = alone(found, "gear-transmission-error")
    assert order == ORDER
    assert amplitude == pytest.approx(AMPLITUDE, rel=0.02)


def test_a_force_is_known_to_the_last_sample() -> None:
    """A run that ends in the midst of a move does not end at rest."""
    runs = [rubbing(20.0, k, measured=True) for k in (0, 1)]
    (recording, _) = prepare(runs, GROOVED).recordings
    true = 20.0 * (GRAVITY + TURN * motion(recording.signals.time, BRISK)[2] / RATIO)
    error = recording.smooth.at.tension - true
    assert np.max(np.abs(error)) < 0.3 * np.ptp(true) / 2
