"""Fields of a structured message or record by their paths.

Elements of an array are named by their index, joints of a JointState by their name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

__all__ = ["fields_of", "numbers_of"]

_LONGEST = 64
"""Most elements of an array in a message; longer ones are images and point clouds."""
_HEADER = re.compile(r"(\w+\.)?header\.")
_DEEPEST = 6
"""Nesting of tables in tables that is read; recordings have two or three levels."""


def numbers_of(value: Any) -> Iterator[tuple[str, float]]:
    """Paths and values of the numbers of a message, without its header.

    Parameters
    ----------
    value : object
        Mappings, sequences, objects with ``__slots__``, numbers.

    Yields
    ------
    (str, float)
        Path such as ``pose.x`` or ``joint1.position``; ``data`` for a single number.
    """
    for name, item in fields_of(value):
        if not isinstance(item, str) and not _HEADER.match(name):
            yield name, item


def fields_of(value: Any) -> Iterator[tuple[str, float | str]]:
    """Paths and values of the numbers and texts of a message or a record.

    Parameters
    ----------
    value : object
        As for :func:`numbers_of`.
    """
    yield from _leaves("", value, 0)


def _leaves(name: str, value: Any, depth: int) -> Iterator[tuple[str, float | str]]:
    if isinstance(value, bool | int | float):
        yield name or "data", float(value)
    elif isinstance(value, str):
        yield name or "data", value
    elif depth > _DEEPEST:
        return
    elif isinstance(value, Mapping):
        yield from _of_mapping(name, value, depth)
    elif isinstance(value, Sequence) and not isinstance(value, bytes):
        if len(value) <= _LONGEST:
            for index, item in enumerate(value):
                yield from _leaves(f"{name}[{index}]", item, depth + 1)
    elif hasattr(value, "__slots__"):
        slots = {key.lstrip("_"): getattr(value, key) for key in value.__slots__}
        yield from _of_mapping(name, slots, depth)


def _of_mapping(
    name: str, fields: Mapping[Any, Any], depth: int
) -> Iterator[tuple[str, float | str]]:
    joints = fields.get("name")
    is_joints = isinstance(joints, Sequence) and not isinstance(joints, str) and bool(joints)
    for key, item in fields.items():
        if depth <= 1 and key == "name" and is_joints:
            continue
        path = f"{name}.{key}" if name else str(key)
        lists = isinstance(item, Sequence) and not isinstance(item, str | bytes)
        if is_joints and lists and joints is not None and len(item) == len(joints):
            for joint, one in zip(joints, item, strict=True):
                yield from _leaves(f"{joint}.{path}", one, depth + 1)
        else:
            yield from _leaves(path, item, depth + 1)
