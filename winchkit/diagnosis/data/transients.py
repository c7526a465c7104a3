"""Where a hanging weight is jerked by the step from one layer of a spiral drum to the next.

The radius jumps there, and with it the rope's speed: how hard that pulls depends on what gives
way, which the nominal line does not know. Its accelerations are differences across the jump.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.derivatives import Clock
from winchkit.model.drum import Spiral, drum_of
from winchkit.model.line import Motion

__all__ = ["around", "jerked"]

Mask = NDArray[np.bool_]
_BESIDE = 2
"""Samples to either side of a jerk, and as many as accelerations reach."""
_MOVING = 0.9
_HEARD = 2.0
"""Of the noise: a smaller jerk tells by its moment where a layer begins, and spoils nothing."""
_NORMAL = 1.4826
"""Standard deviation of normal noise by its median absolute deviation."""


def jerked(time: Array, measured: Array, output: str, motion: Motion) -> Mask:
    """Samples of ``tension`` or ``motor_torque`` that a step from layer to layer may shake.

    Only steps count whose jerk stands out of the instrument's own noise. Where the rope rests on
    a step nothing jerks, though the encoder's noise may step to and fro.
    """
    drum = drum_of(motion.at.profile)
    none = np.zeros(len(time), dtype=bool)
    if motion.load_mass is None or not isinstance(drum, Spiral):
        return none
    at, speed = motion.at, np.abs(motion.at.speed)
    steps = np.diff(np.floor(at.wound_angle / (2 * np.pi)), prepend=np.nan) != 0
    steps[0] = False
    pull = motion.load_mass * speed * (drum.growth / drum.winding_radius) / Clock(time).span
    if output == "motor_torque":
        pull = pull * speed / np.maximum(np.abs(at.motor_rate), 1e-12)
    shaken = steps & (np.abs(at.direction) > _MOVING) & (pull > _HEARD * _white(measured))
    if not shaken.any():
        return none
    return around(shaken, time)


def around(jerked: Mask, time: Array) -> Mask:
    """Jerked samples with those beside them that their accelerations are differences across."""
    reach = _BESIDE + Clock(time).reach
    return np.asarray(np.convolve(jerked, np.ones(2 * reach + 1), mode="same") > 0)


def _white(measured: Array) -> float:
    """White noise of a signal, from second differences: what moves slowly takes no part."""
    bends = np.diff(measured, 2)
    return float(_NORMAL * np.median(np.abs(bends)) / np.sqrt(6))
