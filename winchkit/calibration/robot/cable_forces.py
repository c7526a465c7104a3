"""Rope forces for a robot's calibration: as measured, else what balances the platform's weight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.line import GRAVITY
from winchkit.model.robot import (
    Geometry,
    Pose,
    approximate_forces,
    gravity_wrench,
    structure_matrix,
)
from winchkit.schema.profiles.robot import PlatformSpec

__all__ = ["RopeForces", "balance"]

Blocks = Mapping[str, NDArray[np.intp]]


@dataclass(frozen=True)
class RopeForces:
    """Where rope forces come from.

    How they change with pose and geometry is left out of the fit's derivatives: times a rope's
    compliance it is a thousandth of what geometry itself changes.
    """

    tension: Array
    """Measured, (p, n), N; NaN where not."""
    middle: float | None = None
    """Where nothing was measured, N: the forces nearest to it that balance the weight."""

    def at(
        self, geometry: Geometry, values: Array, pose: Pose, block: Blocks
    ) -> tuple[Array, Array | None]:
        """Forces (p, n), N, and by mass and centre of the payload, (p, n, 4), where computed."""
        if self.middle is None:
            return self.tension, None
        structure = structure_matrix(geometry, pose.position, pose.rotation)
        weight, by_payload = _weight(values, pose, block)
        middle = np.full(structure.shape[2], self.middle)
        force = approximate_forces(structure, weight, middle)
        by = -np.linalg.pinv(structure) @ by_payload
        known = np.isfinite(self.tension)
        return np.where(known, self.tension, force), np.where(known[..., None], 0.0, by)


def balance(
    geometry: Geometry, values: Array, pose: Pose, tension: Array, block: Blocks
) -> tuple[Array, Array]:
    """What measured forces and the weight leave over, in the unit of a force, (p, 6), and by the
    parameters, (p, 6, q).

    Rows are scaled so that each has the variance of one force reading; NaN where one is missing,
    and at poses where the ropes do not hold all six freedoms.
    """
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    weight, by_payload = _weight(values, pose, block)
    left = (structure @ tension[..., None])[..., 0] + weight
    spread = structure @ np.swapaxes(structure, 1, 2)
    whiten = np.full_like(spread, np.nan)
    good = np.all(np.isfinite(spread), axis=(1, 2)) & (np.linalg.matrix_rank(structure) == 6)
    whiten[good] = np.linalg.inv(np.linalg.cholesky(spread[good]))
    by = np.zeros((*left.shape, len(values)))
    by[..., np.concatenate([block["payload_mass"], block["payload_centre"]])] = by_payload
    return (whiten @ left[..., None])[..., 0], whiten @ by


def _weight(values: Array, pose: Pose, block: Blocks) -> tuple[Array, Array]:
    """Wrench of the weight, (p, 6), and by mass and centre, (p, 6, 4)."""
    mass, centre = float(values[block["payload_mass"][0]]), values[block["payload_centre"]]
    x, y, z = centre.tolist()
    platform = PlatformSpec(mass, (x, y, z))
    by = np.zeros((len(pose.position), 6, 4))
    by[..., 0] = gravity_wrench(PlatformSpec(1.0, (x, y, z)), pose.rotation)
    down = np.array([0.0, 0.0, -mass * GRAVITY])
    for k in range(3):
        by[:, 3:, 1 + k] = np.cross(pose.rotation[:, :, k], down)
    return gravity_wrench(platform, pose.rotation), by
