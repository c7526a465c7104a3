"""Conventions of an orientation that names leave open: rotation vectors, orders of a quaternion."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_by, rotation_of, rotation_vector
from winchkit.runs.importing.assignment import Question
from winchkit.runs.importing.chosen import ChosenColumn, Work
from winchkit.runs.importing.names import words_of
from winchkit.schema.mapping import VECTOR

_ANGLES = ("platform_roll", "platform_pitch", "platform_yaw")
_OPEN = re.compile(r"(a )?r(ot)? ?[xyz]")
"""Names of components of a rotation, which may be fixed angles or a rotation vector."""
_ALIKE = math.radians(0.05)
"""Difference below which the convention has no influence: accuracy of a tracker's angles."""
_SMOOTHER = 5.0
"""Ratio of the largest steps of both conventions from which the continuous one is taken."""
_BEYOND = 1.001
"""Factor by which rounded angles exceed their range."""


def settle_orientation(work: Work) -> None:
    """Decide whether ``rx``, ``ry``, ``rz`` are fixed angles or a rotation vector, or ask.

    Notes
    -----
    A pitch beyond ±π/2 is none, and a rotation vector is not longer than π. Else the convention
    counts whose largest step from row to row is five times smaller; small angles are alike in both.
    """
    found = {item.base: item for item in work.columns if item.base in _ANGLES}
    items = [found[name] for name in _ANGLES if name in found]
    is_open = all(_OPEN.fullmatch(words_of(item.column.name)) for item in items)
    if len(items) < 3 or not is_open or any(item.factor is None for item in items):
        return
    answer = work.answers.orientation
    kind = answer if answer in {"vector", "angles"} else _kind(items)
    names = ", ".join(f"'{item.column.source}'" for item in items)
    if not kind:
        text = f"{names}: fixed angles (roll, pitch, yaw; R = Rz Ry Rx), or a rotation vector?"
        options = ("--orientation vector", "--orientation angles")
        work.questions.append(Question(text, options, "orientation"))
    elif kind == "vector":
        for item in items:
            item.stored = VECTOR
        work.notes.append(f"{names} are a rotation vector")


def _kind(items: Sequence[ChosenColumn]) -> str:
    """Convention by the values; empty where both are possible."""
    values = np.stack([item.column.values * (item.factor or 1.0) for item in items], axis=1)
    values = values[np.isfinite(values).all(axis=1)]
    if any(item.unit not in {"rad", ""} for item in items) or not len(values):
        return "angles"
    if np.any(np.abs(values[:, 1]) > _BEYOND * math.pi / 2):
        return "vector"
    if np.any(np.linalg.norm(values, axis=1) > _BEYOND * math.pi):
        return "angles"
    vector, angles = rotation_by(values), rotation_of(*values.T)
    if float(np.max(_turned(vector, angles))) < _ALIKE:
        return "angles"
    steps = [float(np.max(_turned(r[1:], r[:-1]), initial=0.0)) for r in (vector, angles)]
    if max(steps) < _SMOOTHER * min(steps):
        return ""
    return "vector" if steps[0] < steps[1] else "angles"


def _turned(first: Array, second: Array) -> Array:
    """Angle between orientations, rad."""
    return np.asarray(np.linalg.norm(rotation_vector(first @ np.swapaxes(second, -1, -2)), axis=-1))


def quaternion_order(first: Array, last: Array) -> str:
    """Order of a numbered quaternion whose platform turns by less than a right angle, else empty.

    ``first``, ``last`` (n,): first and last element: the real part of such a quaternion is above
    √½.
    """
    limit = math.sqrt(0.5)
    ends = [np.abs(values[np.isfinite(values)]) for values in (first, last)]
    is_real = [bool(len(end)) and bool(np.all(end > limit)) for end in ends]
    return {(True, False): "wxyz", (False, True): "xyzw"}.get((is_real[0], is_real[1]), "")
