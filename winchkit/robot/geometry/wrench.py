"""Wrench of the platform's weight, its derivatives, and whether cables can carry it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.rotation import cross, skew
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

_DOWN = np.array([0.0, 0.0, -GRAVITY])
_CARRIED = 0.01
"""Largest part of a weight that cables may leave and still carry it: above rounding and the errors
of a geometry that is not calibrated (rule of thumb)."""


def gravity_wrench(platform: PlatformSpec, rotation: Array) -> Array:
    """Weight of the platform on its origin, (p, 6), N and N m in base axes; gravity is −z.

    Guides carry the components of the coordinates that they hold: these are zero.

    Parameters
    ----------
    platform : PlatformSpec
        Mass and centre of mass.
    rotation : (p, 3, 3) array
        From platform to base axes.

    Returns
    -------
    (p, 6) array
        Force, N, then moment about the platform's origin, N m.
    """
    lever = np.asarray(rotation @ np.asarray(platform.center_of_mass, dtype=float))
    force = np.broadcast_to(platform.mass * _DOWN, lever.shape)
    return np.concatenate([force, cross(lever, force)], axis=-1) * platform.free


def is_carried(slope: Array, weight: Array) -> NDArray[np.bool_]:
    """Whether cables, which only pull, can carry a weight.

    Parameters
    ----------
    slope : (p, n, 6) array
        Derivatives of the lengths by the pose.
    weight : (p, 6) array
        As of :func:`gravity_wrench`.

    Returns
    -------
    (p,) array
    """
    from scipy.optimize import nnls

    left = [nnls(a.T, w, maxiter=50 * len(a))[1] for a, w in zip(slope, weight, strict=True)]
    return np.asarray(np.array(left) <= _CARRIED * np.linalg.norm(weight, axis=1))


def weight_by_payload(platform: PlatformSpec, rotation: Array) -> Array:
    """Derivatives of :func:`gravity_wrench` by mass and centre of mass, (p, 6, 4)."""
    out = np.zeros((len(rotation), 6, 4))
    out[..., 0] = gravity_wrench(replace(platform, mass=1.0), rotation)
    for k in range(3):
        out[:, 3:, 1 + k] = cross(rotation[:, :, k], platform.mass * _DOWN) * platform.free[3:]
    return out


def weight_by_rotation(platform: PlatformSpec, rotation: Array) -> Array:
    """Derivative of :func:`gravity_wrench` by a small rotation vector in the base, (p, 6, 3)."""
    lever = np.asarray(rotation @ np.asarray(platform.center_of_mass, dtype=float))
    moment = platform.mass * skew(_DOWN) @ skew(lever)
    free = np.asarray(platform.free)[:, None]
    return np.asarray(np.concatenate([np.zeros_like(moment), moment], axis=1) * free)


def weight_hessian(platform: PlatformSpec, rotation: Array) -> Array:
    """Second derivatives of the potential m g z by position and rotation vector, (p, 6, 6)."""
    lever = np.asarray(rotation @ np.asarray(platform.center_of_mass, dtype=float))
    lift = -platform.mass * _DOWN
    out = np.zeros((len(lever), 6, 6))
    product = lever[:, :, None] * lift
    inner = (lever @ lift)[:, None, None]
    out[:, 3:, 3:] = (product + np.swapaxes(product, 1, 2)) / 2 - inner * np.eye(3)
    return out * np.outer(platform.free, platform.free)
