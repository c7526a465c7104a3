"""A cable length that a drive computes from its angle: printed digits, and a law of its own.

Repeats of such a length agree exactly; friction and cogging in the torque have to be found beside
it all the same. The generator knows equations only, no effect of the catalogue.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.quantisation import printed_resolution
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile

RADIUS, PITCH, MASS = 0.05, 0.005, 20.0
FRICTION, COGGING, NOISE = 0.35, 0.3, 0.06
DIGITS = 6
PROFILE = """schema = 1
kind = "winch"
name = "hoist"
[drum]
kind = "grooved"
winding_radius = "50 mm"
groove_pitch = "5 mm"
[path]
inclination = "90 deg"
[reference]
motor_angle = "0 rad"
cable_length = "3 m"
"""


def printed(values: np.ndarray) -> np.ndarray:
    """Values as ``%g`` writes them."""
    return np.array([float(f"{value:.{DIGITS}g}") for value in values])


def lifted(seed: int, wave: float) -> Run:
    """A weight lifted and lowered, with a length of its own law: a wave of the height, m."""
    random, time = np.random.default_rng(seed), np.arange(0, 30, 0.02)
    height = 1.0 - 0.98 * np.cos(2 * np.pi * time / 15)
    angle = height / RADIUS
    rate = np.gradient(angle, time)
    acceleration = 0.98 * (2 * np.pi / 15) ** 2 * np.cos(2 * np.pi * time / 15)
    torque = (
        MASS * (9.80665 + acceleration) * RADIUS
        + FRICTION * np.tanh(rate / 0.05)
        + COGGING * np.sin(3 * angle + 0.4)
        + random.normal(0, NOISE, time.size)
    )
    length = 3.0 - np.hypot(RADIUS, PITCH / (2 * np.pi)) * angle + wave * np.sin(3 * height) ** 2
    channels = {
        "motor_angle": Channel(angle, "rad"),
        "motor_torque": Channel(torque, "N m"),
        "cable_length": Channel(printed(length), "m"),
    }
    return Run(f"lift-{seed}", time, channels, {"load_mass": f"{MASS} kg"})


@pytest.fixture(name="profile")
def hoist(tmp_path: Path) -> WinchProfile:
    path = tmp_path / "hoist.toml"
    path.write_text(PROFILE)
    return read_profile(path)


def found(profile: WinchProfile, wave: float) -> Diagnosis:
    return diagnose([lifted(seed, wave) for seed in (1, 2)], profile).diagnosis


def test_printed_digits_have_a_resolution_that_follows_the_magnitude() -> None:
    random = np.random.default_rng(0)
    values = printed(random.uniform(0.2, 3.0, 2000))
    steps = 10.0 ** (np.floor(np.log10(values)) - DIGITS + 1)
    expected = np.sqrt(np.mean(steps**2))
    assert printed_resolution(values) == pytest.approx(expected)
    assert printed_resolution(values * 0.001) == pytest.approx(0.001 * expected)
    assert printed_resolution(random.uniform(0.2, 3.0, 2000)) == 0.0


def test_an_exact_length_is_not_judged_below_its_printed_digits(profile: WinchProfile) -> None:
    diagnosis = found(profile, 0.0)
    assert prepare([lifted(1, 0.0)], profile).resolution["cable_length"] > 5e-6
    assert diagnosis.verdict == "explained"
    length, torque = (diagnosis.outputs[name] for name in ("cable_length", "motor_torque"))
    assert length.heldout_rms_after < 1.1 * (length.noise_rms or 0.0)
    assert torque.heldout_rms_after < 1.1 * (torque.noise_rms or 0.0)


def test_a_length_that_no_law_explains_hides_no_friction(profile: WinchProfile) -> None:
    diagnosis = found(profile, 2e-3)
    assert diagnosis.verdict == "unknown"
    length, torque = (diagnosis.outputs[name] for name in ("cable_length", "motor_torque"))
    assert length.heldout_rms_after > 50 * (length.noise_rms or 0.0)
    assert torque.heldout_rms_before > 4 * (torque.noise_rms or 0.0)
    assert torque.heldout_rms_after < 1.1 * (torque.noise_rms or 0.0)
    names = {name for step in diagnosis.steps for name in step.effects}
    assert {"motor-coulomb", "motor-cogging"} <= names
    (friction,) = (
        step.parameters["motor-coulomb"]["torque"]
        for step in diagnosis.steps
        if "motor-coulomb" in step.effects
    )
    assert friction.value == pytest.approx(FRICTION, abs=3 * friction.std)
