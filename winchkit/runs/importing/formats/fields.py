"""Fields of a structured message or record by their paths.

Elements of an array are named by their index, joints of a JointState by their name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_LONGEST = 64
"""Most elements of an array in a message; longer ones are images and point clouds."""
_HEADER = re.compile(r"(\w+\.)?header\.")
_DEEPEST = 6
"""Nesting of tables in tables that is read; recordings have two or three levels."""


def numbers_of(value: Any) -> Iterator[tuple[str, float]]:
    """Paths and values of the numbers of a message, without its header.

    ``value``: mappings, sequences, objects with ``__slots__``, numbers. Yields: path such as
    ``pose.x`` or ``joint1.position``; ``data`` for a single number.
    """
    for name, item in fields_of(value):
        if not isinstance(item, str) and not _HEADER.match(name):
            yield name, item


def stamp_of(value: Any) -> int | None:
    """Stamp of the header of a message, or of the header of a part of it; None without one.

    ``value``: as for :func:`numbers_of`.
    """
    header = _field(value, "header")
    for part in () if header is not None else map(str, _keys(value)):
        header = header or _field(_field(value, part), "header")
    stamp = _field(header, "stamp") or _field(value, "timestamp") or _field(value, "stamp")
    seconds = _field(stamp, "sec")
    parts = [_field(stamp, name) for name in ("nanosec", "nsec")]
    fraction = next((part for part in parts if part is not None), None)
    if not isinstance(seconds, int) or not isinstance(fraction, int):
        return None
    return seconds * 1_000_000_000 + fraction


def _keys(value: Any) -> Sequence[Any]:
    if isinstance(value, Mapping):
        return list(value)
    return [key.lstrip("_") for key in getattr(value, "__slots__", ())]


def _field(value: Any, name: str) -> Any:
    if isinstance(value, Mapping):
        return value.get(name)
    return getattr(value, name, None) if hasattr(value, "__slots__") else None


def fields_of(value: Any) -> Iterator[tuple[str, float | str]]:
    """Paths and values of the numbers and texts of a message or a record.

    ``value``: as for :func:`numbers_of`.
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
