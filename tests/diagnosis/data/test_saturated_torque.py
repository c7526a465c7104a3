"""A torque that a drive cuts off: what is left determines the model, what was cut off does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit import diagnose, read_profile
from winchkit.runs.run import Channel, Run

WEIGHT, INERTIA, FRICTION, LIMIT = 1.96, 0.02, 0.3, 1.5


@pytest.mark.slow
@pytest.mark.parametrize("step", [1e-6, 0.02, 0.1])
def test_values_at_the_limit_of_a_drive_are_not_compared(tmp_path: Path, step: float) -> None:
    """A pendulum, nearly half of whose torque is beyond the limit, and that is rounded."""
    time = np.arange(0.0, 20.0, 0.01)
    angle = 1.9 * np.sin(1.3 * time) + 0.9 * np.sin(2.9 * time + 1.0)
    rate = np.gradient(angle, time)
    torque = WEIGHT * np.sin(angle) + INERTIA * np.gradient(rate, time) + FRICTION * np.sign(rate)
    noisy = torque + np.random.default_rng(3).normal(0.0, 0.01, len(time))
    cut = step * np.round(np.clip(noisy, -LIMIT, LIMIT) / step)
    assert np.mean(np.abs(cut) > LIMIT - step / 2) > 0.3
    run = Run(
        "r", time, {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(cut, "N m")}
    )
    path = tmp_path / "joint.toml"
    path.write_text('schema = 1\nkind = "axis"\nname = "joint"\n', encoding="utf-8")
    found = diagnose([run], read_profile(path)).diagnosis
    assert "saturated" in found.caveats
    assert found.used_share["motor_torque"] < 0.7
    named = {name: values for step in found.steps for name, values in step.parameters.items()}
    assert named["joint-gravity"]["amplitude"].value == pytest.approx(WEIGHT, rel=0.01)
    assert named["motor-coulomb"]["torque"].value == pytest.approx(FRICTION, rel=0.05)
