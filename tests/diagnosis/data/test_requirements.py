"""Effects that runs admit: a joint declared as a winch has gravity, a loaded winch has none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.requirements import missing_needs
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_profile

WINCH = """schema = 1
kind = "winch"
name = "joint"
[drum]
kind = "grooved"
winding_radius = "1 m"
groove_pitch = "0 mm"
[gearbox]
ratio = 1.0
[reference]
wound_turns = 0
"""


def lacking(folder: Path, effect: str, stroke: float, *, tension: bool = False) -> list[str]:
    """What an effect lacks on one run with a stroke, rad."""
    path = folder / "joint.toml"
    path.write_text(WINCH)
    time = np.arange(2000) / 100
    angle = stroke / 2 * np.sin(2 * np.pi * time / 5)
    noise = np.random.default_rng(1).normal(0, 0.1, len(time))
    channels = {
        "motor_angle": Channel(angle, "rad"),
        "motor_torque": Channel(np.sign(np.cos(2 * np.pi * time / 5)) + noise, "N m"),
    }
    if tension:
        channels["tension"] = Channel(50 + noise, "N")
    metadata = {"load_mass": "5 kg" if tension else "0 kg"}
    run = Run("swing", time, channels, metadata)
    return missing_needs(load_catalogue()[effect], prepare([run], read_profile(path)))


@pytest.mark.parametrize("stroke", [0.5, 3.0, 6.0])
def test_a_part_of_a_turn_without_cable_force_may_carry_a_weight(
    tmp_path: Path, stroke: float
) -> None:
    assert lacking(tmp_path, "joint-gravity", stroke) == []
    assert lacking(tmp_path, "drum-unbalance", stroke)


@pytest.mark.parametrize("stroke", [7.0, 60.0])
def test_whole_turns_are_those_of_a_drum(tmp_path: Path, stroke: float) -> None:
    assert lacking(tmp_path, "joint-gravity", stroke)
    assert lacking(tmp_path, "drum-unbalance", stroke) == []


def test_a_force_in_the_cable_makes_it_a_winch(tmp_path: Path) -> None:
    assert lacking(tmp_path, "drum-unbalance", 3.0, tension=True)
    assert lacking(tmp_path, "drum-unbalance", 4.0, tension=True) == []
    (missing,) = lacking(tmp_path, "joint-gravity", 3.0, tension=True)
    assert "without any force in a cable" in missing
