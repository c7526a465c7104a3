"""Stick-slip: the torque at a standstill is a reaction of static friction, and is not compared."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.standstill import STANDSTILL, spread_at_standstill
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
STEP = 1e-3
"""s, of the integration."""
SAMPLED = 30
"""Steps between two samples."""
RESOLUTION = 4e-4
"""rad, of the encoder."""
NOISE = 0.01
"""N m, of the torque."""
FRICTION = "motor-coulomb", "motor-dahl", "motor-stribeck"


def run_of(time: Array, angle: Array, torque: Array, name: str = "joint") -> Run:
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run(name, time, channels, {})


def stick_slip(seed: int, gravity: float, kinetic: float, static: float) -> Run:
    """A joint drawn by a soft position controller: Karnopp's model of friction, integrated.

    The joint has 0.05 kg m^2; the controller is a spring and a damper from the joint to a slow
    set point.
    """
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 90.0, STEP)
    wanted = 0.5 * np.sin(0.12 * time + 1.0) + 0.3 * np.sin(0.31 * time + seed)
    angle, speed, place = np.empty_like(time), 0.0, float(wanted[0])
    torque = np.empty_like(time)
    inertia, stiffness, damping = 0.05, 12.0, 0.6
    for n, target in enumerate(wanted):
        drive = stiffness * (target - place) - damping * speed
        pull = drive - gravity * np.sin(place)
        if abs(speed) < 1e-3 and abs(pull) <= static:
            speed = 0.0
        else:
            direction = np.sign(speed) if abs(speed) >= 1e-3 else np.sign(pull)
            following = speed + STEP * (pull - kinetic * direction) / inertia
            speed = 0.0 if speed * following < 0 else following
        place += STEP * speed
        angle[n], torque[n] = place, drive
    rows = slice(0, None, SAMPLED)
    seen = torque[rows] + NOISE * random.normal(size=len(time[rows]))
    counts = RESOLUTION * np.round(angle[rows] / RESOLUTION)
    return run_of(time[rows], counts, seen)


def at_standstill(dataset: Dataset) -> list[str]:
    return [finding.channel for finding in dataset.sanity if finding.code == STANDSTILL]


def test_the_torque_of_a_joint_that_sticks_is_not_compared_where_it_stands() -> None:
    run = stick_slip(1, gravity=0.0, kinetic=0.4, static=0.6)
    dataset = prepare([run], JOINT)
    valid = dataset.recordings[0].valid["motor_torque"]
    stands = np.abs(np.gradient(run["motor_angle"])) == 0.0
    assert at_standstill(dataset) == ["motor_torque"]
    assert 0.3 < np.mean(stands) < 0.95
    assert np.mean(valid[stands]) < 0.15
    assert np.mean(valid[~stands]) > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("gravity", [0.0, 2.0])
def test_friction_and_gravity_of_a_joint_that_sticks_are_named_with_their_sizes(
    gravity: float,
) -> None:
    """Of samples at standstills a fit would make the friction too small by a third."""
    run = stick_slip(2, gravity, kinetic=0.4, static=0.6)
    found = diagnose([run], JOINT).diagnosis
    assert found.verdict == "explained"
    named = {effect: step.parameters[effect] for step in found.steps for effect in step.effects}
    (friction,) = [named[effect] for effect in FRICTION if effect in named][:1]
    assert friction["torque"].value == pytest.approx(0.4, abs=0.08)
    assert ("joint-gravity" in named) == bool(gravity)
    if gravity:
        assert named["joint-gravity"]["amplitude"].value == pytest.approx(gravity, rel=0.1)


def moved(torque: Array, noise: float = 1e-6) -> Run:
    """Strokes with a rest after each, as a bench makes them."""
    time = np.arange(0.0, 60.0, 0.02)
    phase = time % 10.0
    angle = np.where(phase < 6.0, 1.0 - np.cos(2 * np.pi * phase / 6.0), 0.0)
    return run_of(time, angle + noise * np.random.default_rng(0).normal(size=len(time)), torque)


def test_noise_at_a_standstill_is_noise() -> None:
    noise = 0.01 * np.random.default_rng(1).normal(size=3000)
    for coefficient in (0.0, 0.6):
        coloured = noise.copy()
        for n in range(1, len(noise)):
            coloured[n] += coefficient * coloured[n - 1]
        dataset = prepare([moved(coloured)], JOINT)
        assert at_standstill(dataset) == []
        assert dataset.used_share["motor_torque"] > 0.99


def test_presliding_at_a_reversal_is_compared() -> None:
    """Within 0.02 rad about each reversal the torque changes, and the angle determines how."""
    time = np.arange(0.0, 60.0, 0.01)
    angle = np.sin(2 * np.pi * time / 6.0)
    torque, force = np.empty_like(time), 0.0
    for n, step in enumerate(np.diff(angle, prepend=angle[0])):
        force += (0.5 - np.sign(step) * force) * step / 0.02 * 1.0 if step else 0.0
        force = float(np.clip(force, -0.5, 0.5))
        torque[n] = force
    random = np.random.default_rng(2)
    run = run_of(time, angle + 1e-5 * random.normal(size=6000), torque)
    assert at_standstill(prepare([run], JOINT)) == []


def test_a_slow_motion_of_a_coarse_encoder_is_no_standstill() -> None:
    time = np.arange(0.0, 60.0, 0.01)
    angle = 0.5 * np.sin(2 * np.pi * time / 30.0)
    torque = np.cos(angle) * 5.0 + 0.01 * np.random.default_rng(3).normal(size=6000)
    run = run_of(time, 2e-3 * np.round(angle / 2e-3), torque)
    dataset = prepare([run], JOINT)
    assert dataset.used_share["motor_torque"] > 0.95


def test_a_joint_that_never_slips_is_compared_where_it_stands() -> None:
    """There is nothing else, and the diagnosis must say something of such a file."""
    run = stick_slip(1, gravity=0.0, kinetic=20.0, static=20.0)
    angle = run["motor_angle"] + np.where(np.arange(len(run)) % 700 == 0, RESOLUTION, 0.0)
    dataset = prepare([run_of(run.time, angle, run["motor_torque"])], JOINT)
    assert at_standstill(dataset) == []
    assert dataset.used_share["motor_torque"] > 0.9
    found = diagnose([run_of(run.time, angle, run["motor_torque"])], JOINT).diagnosis
    assert found.verdict in {"unknown", "partly"}


def test_the_two_variances_are_those_of_white_noise() -> None:
    """Both estimate its variance; of a ramp the second does not contain the trend."""
    noise = np.random.default_rng(4).normal(scale=0.3, size=20_000)
    intervals = [slice(start, start + 40) for start in range(0, 20_000, 50)]
    within, successive = spread_at_standstill(noise, intervals)
    assert within == pytest.approx(0.09, rel=0.03)
    assert successive == pytest.approx(0.09, rel=0.03)
    ramp = np.tile(np.linspace(0.0, 3.0, 50), 400)
    within, successive = spread_at_standstill(noise + ramp, intervals)
    assert within == pytest.approx(0.09 + np.var(ramp[:40], ddof=1), rel=0.05)
    assert successive == pytest.approx(0.09, rel=0.05)
    assert spread_at_standstill(noise, []) == (0.0, 0.0)
