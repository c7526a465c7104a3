"""Poses of trackers: the body, the complete set of columns, and conventions that names leave open.

Names do not distinguish fixed angles from a rotation vector, nor the orders of a quaternion.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_by, rotation_of, rotation_vector
from winchkit.runs.importing.assignment import ChosenColumn, Question, Work
from winchkit.runs.importing.formats.header import VICON
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import FileColumn
from winchkit.schema.mapping import ANGLES, EULER, MATRIX, POSITION, QUATERNION, VECTOR

_OPEN = re.compile(r"(a )?r(ot|vec)? ?[xyz]")
"""Names of components of a rotation, which may be angles or a rotation vector."""
_AXES = re.compile("[xyz]")
_TURNS = ("rotation", "quaternion", "orientation")
"""Words above the axes of a rotation."""
_ALIKE = math.radians(0.05)
"""Difference below which the convention has no influence: accuracy of a tracker's angles."""
_SMOOTHER = 5.0
"""Ratio of the largest steps of the two smoothest conventions from which the first is taken."""
_BEYOND = 1.001
"""Factor by which rounded angles exceed their range."""
_CONVENTIONS: dict[str, tuple[str, Callable[[Array], Array], str]] = {
    "angles": ("", lambda own: rotation_of(*own.T), "angles of R = Rz Ry Rx (roll, pitch, yaw)"),
    "vector": (VECTOR, rotation_by, "a rotation vector"),
    "xyz": (
        EULER,
        # The inverse of a product has the factors with the other sign in the other order.
        lambda own: np.swapaxes(rotation_of(*-own.T), -1, -2),
        "angles of R = Rx Ry Rz",
    ),
}
"""By answer: how it is stored, its rotations (p, 3, 3) of three numbers (p, 3), and words."""
_USUAL = ("angles", "vector")
"""Conventions of programs that are not known to have others."""


def rotation_as(stored: str) -> Callable[[Array], Array] | None:
    """Rotations of numbers that are stored so; None for roll, pitch and yaw."""
    found = (turned for own, turned, _ in _CONVENTIONS.values() if own == stored and own)
    return next(found, None)


def settle_orientation(work: Work) -> None:
    """Decide of which convention three numbers of a rotation are, or ask.

    A pitch beyond ±π/2 is none, and a rotation vector is not longer than π. Else the convention
    counts whose largest step from row to row is five times smaller; small rotations are alike in
    all. Degrees are angles, but in exports of Vicon and of OptiTrack, which have several kinds.
    """
    found = {item.base: item for item in work.columns if item.base in ANGLES}
    items = [found[name] for name in ANGLES if name in found]
    is_open = all(
        _OPEN.fullmatch(words_of(item.column.name)) or is_turned_axis(item.column) for item in items
    )
    if len(items) < 3 or not is_open or any(item.factor is None for item in items):
        return
    answer = work.answers.orientation
    kind = answer if answer in _CONVENTIONS else _kind(items, _has_kinds(work.table.metadata))
    names = ", ".join(f"'{item.column.source}'" for item in items)
    if not kind:
        words = ", or ".join(text for _, _, text in _CONVENTIONS.values())
        options = tuple(f"--orientation {name}" for name in _CONVENTIONS)
        work.questions.append(Question(f"{names}: {words}?", options, "orientation"))
    elif kind != "angles":
        stored, _, text = _CONVENTIONS[kind]
        for item in items:
            item.stored = stored
        work.notes.append(f"{names} are {text}")


def _has_kinds(metadata: Mapping[str, str]) -> bool:
    """Whether a file is of a program that exports rotations in several conventions."""
    kind = metadata.get("Rotation Type", "Quaternion")
    return kind != "Quaternion" or not VICON.isdisjoint(metadata.values())


def _kind(items: Sequence[ChosenColumn], has_kinds: bool) -> str:
    """Convention by names and values; empty where several are possible."""
    above = " ".join(words_of(label) for item in items for label in item.column.labels)
    if "helical" in above or all(words_of(i.column.name).startswith("rvec") for i in items):
        return "vector"
    values = np.stack([item.column.values * (item.factor or 1.0) for item in items], axis=1)
    values = values[np.isfinite(values).all(axis=1)]
    if not len(values) or (not has_kinds and any(i.unit not in {"rad", ""} for i in items)):
        return "angles"
    possible = dict(_CONVENTIONS) if has_kinds else {n: _CONVENTIONS[n] for n in _USUAL}
    if np.any(np.abs(values[:, 1]) > _BEYOND * math.pi / 2):
        return "vector"
    if np.any(np.linalg.norm(values, axis=1) > _BEYOND * math.pi):
        del possible["vector"]
    turned = {name: convert(values) for name, (_, convert, _) in possible.items()}
    first = turned["angles"]
    if all(float(np.max(_turned(other, first))) < _ALIKE for other in turned.values()):
        return "angles"
    steps = {n: float(np.max(_turned(r[1:], r[:-1]), initial=0.0)) for n, r in turned.items()}
    best, *others = sorted(steps, key=lambda name: steps[name])
    return "" if any(steps[n] < _SMOOTHER * steps[best] for n in others) else best


def _turned(first: Array, second: Array) -> Array:
    """Angle between orientations, rad."""
    return np.asarray(np.linalg.norm(rotation_vector(first @ np.swapaxes(second, -1, -2)), axis=-1))


def quaternion_order(first: Array, last: Array) -> str:
    """Order of a numbered quaternion by its real part, above √½ below a right angle; else empty."""
    limit = math.sqrt(0.5)
    ends = [np.abs(values[np.isfinite(values)]) for values in (first, last)]
    is_real = [bool(len(end)) and bool(np.all(end > limit)) for end in ends]
    return {(True, False): "wxyz", (False, True): "xyzw"}.get((is_real[0], is_real[1]), "")


_NOT_A_BODY = re.compile(
    r"^(rigid body|rigid body marker|marker|bone|type|name|position|rotation|orientation|"
    r"mean marker error|marker quality|trajectories|pose pose|pose|transform)$"
)
_KIND_OF_BODY = re.compile(r"^Global Angle( \(\w+\))? ")
"""What Vicon writes before the name of an object."""


def is_turned_axis(column: FileColumn) -> bool:
    """Whether a column is one of X, Y and Z below the word ``Rotation``."""
    above = words_of(" ".join(column.labels))
    return words_of(column.name) in {"x", "y", "z"} and any(word in above for word in _TURNS)


def body_of(column: FileColumn) -> str:
    """Body or marker of a tracker that a column belongs to; empty without labels."""
    labels = [_KIND_OF_BODY.sub("", text) for text in column.labels]
    own = [text for text in labels if not _NOT_A_BODY.match(words_of(text))]
    return " ".join(own) or column.group


def chosen_body(
    columns: Sequence[FileColumn], wanted: str | None
) -> tuple[str | None, tuple[str, ...]]:
    """Body whose pose is imported, None where none of several is chosen, and all bodies.

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
    if all(name in channels for name in POSITION):
        found += POSITION
    for group in (QUATERNION, MATRIX, ANGLES):
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
    """Channels of ``q0`` to ``q3`` beside positions by name; else empty."""
    words = {words_of(name).replace(" ", ""): name for name in names}
    axes = all(any(key in words for key in (axis, f"pos{axis}", f"p{axis}")) for axis in "xyz")
    joint = any(key.startswith(("q4", "q5", "dq")) for key in words)
    if not axes or joint or not all(f"q{n}" in words for n in range(4)):
        return {}
    return {words[f"q{n}"]: f"platform_q{axis}" for n, axis in enumerate(order)}
