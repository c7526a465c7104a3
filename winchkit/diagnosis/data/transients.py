"""Masks of samples at which the force of a hanging weight is not known.

At the next layer of a spiral drum the winding radius and the speed of the cable jump. The force of
that transient depends on compliances that the nominal model does not have. Of unevenly sampled runs
the acceleration is uncertain beside gaps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.drum import Spiral, drum_of
from winchkit.model.line import Motion

Mask = NDArray[np.bool_]
_NEIGHBOURS = 2
"""Samples to either side of a transient, besides the reach of the derivatives."""
_MOVING = 0.9
"""Expected direction above which the cable counts as moving; screened."""
_LEAST_TRANSIENT = 2.0
"""In units of the white noise; a smaller transient only marks where a layer begins."""
_NORMAL = 1.4826
"""Standard deviation of normal noise over its median absolute deviation."""


def transient_mask(measured: Array, output: str, motion: Motion) -> Mask:
    """Samples of tension or torque near a change of layer whose transient exceeds the noise.

    There are none without a known weight or without layers. A step that the encoder's noise crosses
    while the cable rests does not count.
    """
    drum = drum_of(motion.at.profile)
    none = np.zeros(len(measured), dtype=bool)
    if motion.load_mass is None or not isinstance(drum, Spiral):
        return none
    at, speed = motion.at, np.abs(motion.at.speed)
    steps = np.diff(np.floor(at.wound_angle / (2 * np.pi)), prepend=np.nan) != 0
    steps[0] = False
    force = motion.load_mass * speed * (drum.growth / drum.winding_radius) / motion.clock.span
    if output == "motor_torque":
        force = force * speed / np.maximum(np.abs(at.motor_rate), 1e-12)
    acting = force > _LEAST_TRANSIENT * white_noise(measured)
    transients = steps & (np.abs(at.direction) > _MOVING) & acting
    if not transients.any():
        return none
    return with_neighbours(transients, motion.clock)


def uncertain_force_mask(measured: Array, nominal: Array, motion: Motion) -> Mask:
    """Samples of a force whose acceleration is less certain than elsewhere and than the instrument;
    none unless it follows from the acceleration of unevenly sampled angles."""
    load, std = motion.load, motion.load_std
    if load is None or std is None or not std.any():
        return np.zeros(len(measured), dtype=bool)
    std = std * np.abs(nominal / np.where(load == 0.0, np.inf, load))
    usual = np.hypot(white_noise(measured), np.median(std))
    return np.asarray(std > _LEAST_TRANSIENT * usual)


def with_neighbours(marked: Mask, clock: SamplingTimes) -> Mask:
    """Extend a mask by the samples whose derivatives reach across a marked one."""
    reach = _NEIGHBOURS + clock.support
    return np.asarray(np.convolve(marked, np.ones(2 * reach + 1), mode="same") > 0)


def white_noise(measured: Array) -> float:
    """Standard deviation of white noise, from second differences by their median absolute value."""
    second_differences = np.diff(measured, 2)
    return float(_NORMAL * np.median(np.abs(second_differences)) / np.sqrt(6))
