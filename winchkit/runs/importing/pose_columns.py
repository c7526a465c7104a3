"""Pose columns of trackers: the body of an export, and the set of columns that is complete."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import Column

_NOT_A_BODY = re.compile(
    r"^(rigid body|rigid body marker|marker|bone|type|name|position|rotation|orientation|"
    r"mean marker error|marker quality|trajectories|pose pose|pose|transform)$"
)
_AXES = re.compile("[xyz]")
_POSITION = ("platform_x", "platform_y", "platform_z")
_QUATERNION = ("platform_qw", "platform_qx", "platform_qy", "platform_qz")
_ANGLES = ("platform_roll", "platform_pitch", "platform_yaw")
_MATRIX = tuple(f"platform_r{row}{column}" for row in "123" for column in "123")


def body_of(column: Column) -> str:
    """Body or marker of a tracker that a column belongs to; empty without labels.

    Returns: labels without words such as ``Rigid Body`` and ``Position``.
    """
    own = [text for text in column.labels if not _NOT_A_BODY.match(words_of(text))]
    return " ".join(own) or column.group


def chosen_body(
    columns: Sequence[Column], wanted: str | None
) -> tuple[str | None, tuple[str, ...]]:
    """Body whose pose is imported.

    Returns: ``body``: None where there are several and none is chosen. ``bodies``: all of them.
    Where bodies with an orientation exist, single markers are not among them.
    """
    bodies = tuple(dict.fromkeys(body_of(item) for item in columns))
    turned = tuple(
        dict.fromkeys(
            body_of(item)
            for item in columns
            if "rotation" in words_of(" ".join(item.labels)) or "quat" in words_of(item.name)
        )
    )
    bodies = turned or bodies
    if wanted is not None:
        found = next((b for b in bodies if b.casefold() == wanted.casefold()), None)
        return found, bodies
    return (bodies[0] if len(bodies) == 1 else None), bodies


def complete_sets(channels: Mapping[str, object]) -> tuple[str, ...]:
    """Pose channels whose set is complete; the quaternion is preferred to matrix and angles."""
    found: tuple[str, ...] = ()
    if all(name in channels for name in _POSITION):
        found += _POSITION
    for group in (_QUATERNION, _MATRIX, _ANGLES):
        if all(name in channels for name in group):
            return found + group
    return found


def vector_names(names: Sequence[str]) -> frozenset[str]:
    """Names that differ in x, y and z only, as those of a six-axis cell: ``Fx``, ``Fy``, ``Fz``."""
    stems: dict[tuple[str, str], dict[str, str]] = {}
    for name in names:
        plain = words_of(name).replace(" ", "")
        for axis in _AXES.finditer(plain):
            stem = plain[: axis.start()], plain[axis.end() :]
            stems.setdefault(stem, {})[axis[0]] = name
    return frozenset(n for own in stems.values() if len(own) == 3 for n in own.values())


def quaternion_names(names: Sequence[str], order: str = "wxyz") -> dict[str, str]:
    """Channels of numbered quaternions: ``q0`` to ``q3`` beside positions.

    Returns: channel by name, from ``q0`` to ``q3``; empty where the four names are not there, or no
    positions.
    """
    words = {words_of(name).replace(" ", ""): name for name in names}
    axes = all(any(key in words for key in (axis, f"pos{axis}", f"p{axis}")) for axis in "xyz")
    joint = any(key.startswith(("q4", "q5", "dq")) for key in words)
    if not axes or joint or not all(f"q{n}" in words for n in range(4)):
        return {}
    return {words[f"q{n}"]: f"platform_q{axis}" for n, axis in enumerate(order)}
