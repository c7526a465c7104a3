"""A motor that turns slowly there and back at one speed: its friction is one law, not two.

Cogging, dry friction and inertia by formula. A viscous friction alone leaves the ramps; with a
further curve over the speed it imitates dry friction, which is no reason to list it.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

COGGING, DRY, INERTIA, NOISE = 0.03, 0.02, 1e-4, 0.003
"""N m, kg m²."""
SPEED, RAMP, REST, RATE, SECONDS = 0.8, 0.27, 0.5, 100.0, 34.5
"""rad/s, s, s, Hz, s."""


def there_and_back(seed: int) -> Run:
    random, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, 1 / RATE)
    from_turn = SECONDS / 4 - np.abs(time % (SECONDS / 2) - SECONDS / 4) - REST / 2
    speed = SPEED * np.clip(from_turn / RAMP, 0.0, 1.0) * np.where(time < SECONDS / 2, 1.0, -1.0)
    angle = np.cumsum(speed) / RATE
    torque = DRY * np.tanh(speed / 0.02) + INERTIA * np.gradient(speed, time)
    torque += COGGING * (np.sin(16 * angle + 1.0) + 0.6 * np.cos(7 * angle))
    channels = {
        "motor_angle": Channel(angle + random.normal(0.0, 1e-4, len(time)), "rad"),
        "motor_torque": Channel(torque + random.normal(0.0, NOISE, len(time)), "N m"),
    }
    return Run("turns", time, channels, {})


@pytest.mark.parametrize("seed", [8, 12])
def test_dry_friction_at_one_speed_is_not_also_viscous_with_a_stribeck_curve(seed: int) -> None:
    found = diagnose([there_and_back(seed)], AxisProfile(name="motor")).diagnosis
    (friction,) = [step for step in found.steps if "motor-coulomb" in step.effects]
    assert friction.effects == ("motor-coulomb",)
    torque = friction.parameters["motor-coulomb"]["torque"]
    assert torque.value == pytest.approx(DRY, rel=0.02)
