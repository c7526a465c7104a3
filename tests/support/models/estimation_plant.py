"""Pulleys whose presliding the simulator integrates, as a truth to estimate against."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from winchkit.sim.physics.base import PlantState
from winchkit.sim.physics.pulley import PreslidingPulleys

WRAPS = (pi / 2, pi, pi / 3)


def cell_readings(
    platform: np.ndarray,
    wound: np.ndarray,
    wraps: Sequence[float] = WRAPS,
    friction: float = 0.02,
    stiffness: float = 1500.0,
    shape: float = 1.0,
) -> np.ndarray:
    """Tension at the drum over time, from the platform's and the cable wound in."""
    pulleys = PreslidingPulleys(friction, stiffness, shape)
    state, out = PlantState(), []
    for load, moved in zip(platform, np.diff(wound, prepend=wound[0]), strict=True):
        state.winding_speed = float(moved)
        tension = float(load)
        for index, wrap in enumerate(reversed(wraps)):
            tension += pulleys.pulley(state, index, wrap, tension, 1.0)
        out.append(tension)
    return np.array(out)


def wander(seconds: float = 40.0, rate: float = 50.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, tension at the platform and cable wound in, with reversals of many sizes."""
    time = np.arange(0, seconds, 1 / rate)
    wound = 0.05 * np.sin(2 * pi * time / 9) + 0.01 * np.sin(2 * pi * time / 2.3)
    return time, 300 + 40 * np.sin(2 * pi * time / 13), wound
