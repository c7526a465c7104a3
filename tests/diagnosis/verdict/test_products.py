"""Laws over two variables at once: friction by the place in a turn, and by load and speed.

The generator knows equations only. No effect of the catalogue is such a law.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit import diagnose, read_profile
from winchkit.arrays import Array
from winchkit.diagnosis.results import Step
from winchkit.runs.run import Channel, Run

RATIO, RADIUS, PITCH, GRAVITY, NOISE = 5.0, 0.05, 0.005, 9.80665, 0.02
WINCH = f"""schema = 1
kind = "winch"
name = "w"
[drum]
kind = "grooved"
winding_radius = "50 mm"
groove_pitch = "5 mm"
[gearbox]
ratio = {RATIO}
[reference]
cable_length = "9 m"
wound_turns = 4
"""


def recorded(law: str) -> list[Run]:
    """Two loads, each twice, lifted and lowered by sums of sines without a common period."""
    time = np.arange(0, 40, 0.02)
    runs = []
    for mass, longest in ((8.0, 21.0), (30.0, 17.0)):
        angle = 40 * (1 - np.cos(2 * np.pi * time / longest)) + 9 * np.sin(2 * np.pi * time / 5.3)
        speed = np.gradient(angle, time)
        arm = np.hypot(RADIUS, PITCH / (2 * np.pi)) / RATIO
        load = mass * (GRAVITY + arm * np.gradient(speed, time)) * arm
        torque = load + added(law, angle, speed, load)
        for _ in range(2):
            noise = np.random.default_rng(len(runs)).normal(0.0, NOISE, len(time))
            channels = {
                "motor_angle": Channel(angle, "rad"),
                "motor_torque": Channel(torque + noise, "N m"),
            }
            known = {"load_mass": f"{mass} kg"}
            runs.append(Run(f"run-{len(runs)}", time, channels, metadata=known))
    return runs


def added(law: str, angle: Array, speed: Array, load: Array) -> Array:
    """Torque beside the load's, N m."""
    turned = {"drum angle": angle / RATIO, "motor angle": angle}
    if law in turned:
        return np.asarray(0.3 * np.tanh(speed / 0.1) * (1 + 0.7 * np.cos(turned[law] + 0.4)))
    return np.asarray(0.02 * load * speed)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "over"),
    [
        ("drum angle", "direction times drum angle in its turn"),
        ("motor angle", "direction times motor angle in its turn"),
        ("load and speed", "load times speed"),
    ],
)
def test_a_law_over_two_variables_is_open_over_both(law: str, over: str, tmp_path: Path) -> None:
    path = tmp_path / "w.toml"
    path.write_text(WINCH)
    first: Step = diagnose(recorded(law), read_profile(path)).diagnosis.steps[0]
    assert (first.law, first.certain, first.curve) == ("open", False, over)
