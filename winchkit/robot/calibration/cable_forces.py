"""Cable forces for a robot's calibration: measured, or computed from the platform's weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.forces.force_distribution import approximate_forces
from winchkit.robot.geometry.kinematics import Geometry, Pose, structure_matrix
from winchkit.robot.geometry.wrench import gravity_wrench, weight_by_payload
from winchkit.schema.profiles.robot import PlatformSpec


@dataclass(frozen=True)
class CableForces:
    """Source of the cable forces.

    Notes
    -----
    The derivatives of computed forces by pose and geometry are left out of the fit: multiplied by a
    cable's compliance they are a thousandth of the derivatives of the lengths.
    """

    tension: Array
    """Measured, (p, n), N; NaN where not."""
    middle: float | None = None
    """Force, N, to which forces that were not measured are nearest; None without such forces."""

    def at(
        self, geometry: Geometry, platform: PlatformSpec, pose: Pose
    ) -> tuple[Array, Array | None]:
        """Cable forces at poses.

        Returns: ``force`` (p, n): N: measured ones, else those nearest to ``middle`` that balance
        the weight; ``by_payload`` (p, n, 4): derivatives by mass and centre of mass; zero for
        measured forces, None where no force is computed.
        """
        if self.middle is None:
            return self.tension, None
        structure = structure_matrix(geometry, pose.position, pose.rotation)
        middle = np.full(structure.shape[2], self.middle)
        weight = gravity_wrench(platform, pose.rotation)
        force = approximate_forces(structure, weight, middle)
        by = -np.linalg.pinv(structure) @ weight_by_payload(platform, pose.rotation)
        known = np.isfinite(self.tension)
        return np.where(known, self.tension, force), np.where(known[..., None], 0.0, by)
