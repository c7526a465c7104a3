"""Excitation: effects that a set of poses cannot show, by missing measurements or motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from winchkit.model.rotation import rotation_of, rotation_vector

if TYPE_CHECKING:
    from winchkit.robot.diagnosis.preparation import Preparation

_LEAST_ROTATION = np.radians(1.0)
"""Rotation of the platform below which a note says that it never turned, rad; rule of thumb."""
_LEAST_POSES = 40
"""Distinct poses below which a note asks for more; rule of thumb."""


def missing_pose_excitation(preparation: Preparation) -> list[str]:
    """Sentences on missing repeats, tensions, temperatures, rotations, and on few poses."""
    dataset, measured = preparation.dataset, preparation.dataset.measured
    notes = []
    if dataset.moves:
        notes.append(
            "a trajectory has no repeats: the noise is what neither geometry nor any known effect "
            "explains, so an effect outside the catalogue cannot be excluded; record poses at "
            "rest, some ten of them twice"
        )
    elif not preparation.noise.from_repeats:
        notes.append(
            "too few poses repeat another: the noise is what neither geometry nor any known effect "
            "explains, so an effect outside the catalogue cannot be excluded; drive to some ten "
            "poses twice"
        )
    if not dataset.has_tension:
        notes.append(
            "no tensions measured: what depends on the cables' force (elasticity, payload, cells) "
            "cannot be seen; record LINE.tension [N]"
        )
    elif not dataset.has_balance:
        notes.append(
            "the tensions measured do not carry the platform's weight, whatever it is: payload and "
            "cells cannot be judged; does something else pull at the platform?"
        )
    if not np.isfinite(measured.temperature).all():
        notes.append("no temperature measured: thermal effects cannot be detected")
    if not np.isfinite(measured.position).any():
        notes.append("no position measured: the origin of the platform frame cannot be determined")
    whole = measured.angles[np.isfinite(measured.angles).all(axis=1)]
    if len(whole):
        turned = rotation_vector(rotation_of(*whole.T) @ rotation_of(*whole[0]).T)
        if float(np.max(np.linalg.norm(turned, axis=1))) < _LEAST_ROTATION:
            notes.append(
                "the platform never turned: exit and anchor points cannot be distinguished; "
                "turn it between poses"
            )
    distinct = int(dataset.pose.max()) + 1
    if distinct < _LEAST_POSES:
        notes.append(
            f"{distinct} distinct poses only; ninety, widely spread, are much more informative"
        )
    return notes
