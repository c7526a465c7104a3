"""Motion of the platform from noisy poses: a smoothing spline of each coordinate.

Positions and rotation vectors r from the first rotation R₀, R = exp([r]×) R₀, are smoothed by one
:class:`~winchkit.model.smoothing_spline.SmoothingSpline` whose weight suits a signal with the same
smoothness, such as a motor angle. The angular velocity is ω = J(r) ṙ with the left Jacobian J.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_by, rotation_vector
from winchkit.model.smoothing_spline import SmoothingSpline
from winchkit.robot.dynamics.dynamics import PlatformMotion
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.tracker import left_jacobian


class SmoothedMotion(NamedTuple):
    """Motion of the platform and the uncertainty of its acceleration."""

    motion: PlatformMotion
    acceleration_std: Array
    """Standard deviation of each acceleration, (k, 6), m/s² and rad/s²."""
    coordinates: Array
    """Smoothed position and rotation vector from the first rotation, (k, 6), m and rad."""


def smoothed_motion(spline: SmoothingSpline, pose: Pose) -> SmoothedMotion:
    """Smooth sampled poses and differentiate them twice."""
    start = pose.rotation[0]
    raw = np.hstack([pose.position, rotation_vector(pose.rotation @ start.T)])

    def smooth(values: Array, derivative: int) -> Array:
        return np.stack([spline.smoothed(column, derivative) for column in values.T], axis=1)

    place, rate, bent = (smooth(raw, derivative) for derivative in (0, 1, 2))
    turned = left_jacobian(place[:, 3:])
    spin = (turned @ rate[:, 3:, None])[..., 0]
    motion = PlatformMotion(
        Pose(place[:, :3], rotation_by(place[:, 3:]) @ start),
        np.hstack([rate[:, :3], spin]),
        np.hstack([bent[:, :3], smooth(spin, 1)]),
    )
    # The spline's own uncertainty is that of the signal its weight was fitted to.
    noise = np.sqrt(np.mean((raw - place) ** 2, axis=0))
    return SmoothedMotion(motion, spline.std(2)[:, None] * (noise / spline.noise), place)
