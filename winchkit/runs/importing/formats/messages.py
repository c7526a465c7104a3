"""Reader of MCAP files of other programs: messages in JSON, and of ROS 2 (extra ``ros2``).

Every topic is a group of columns with its own time stamps; fields are named by their path, elements
of arrays by their index, joints of a JointState by their name.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError, UsageError, WinchkitError, one_line
from winchkit.runs.importing.table import Column, Table, named_apart

__all__ = ["read_messages"]

_LONGEST = 64
"""Most elements of an array in a message; longer ones are images and point clouds."""
_DEEPEST = 6


def read_messages(path: str, data: bytes) -> Table:
    """Read an MCAP file.

    Parameters
    ----------
    path : str
        File, for messages.
    data : bytes
        Its content.

    Returns
    -------
    Table
        Columns by topic; the time is the log time, in ns since 1970 or on the recorder's clock.

    Raises
    ------
    UsageError
        For ROS 2 messages without the decoder.
    RunError
        For an invalid file, and one without numbers in a known encoding.
    """
    from mcap.reader import NonSeekingReader

    rows: dict[str, list[tuple[int, dict[str, float]]]] = {}
    notes: list[str] = []
    decoders: dict[int, Any] = {}
    try:
        messages = NonSeekingReader(io.BytesIO(data)).iter_messages(log_time_order=False)
        for schema, channel, message in messages:
            found = _decoded(path, schema, channel, message.data, decoders)
            if found is not None:
                numbers = dict(_numbers("", found, 0))
                rows.setdefault(channel.topic, []).append((message.log_time, numbers))
            else:
                encoding = one_line(channel.message_encoding)
                notes.append(f"topic {channel.topic} is in '{encoding}' and left out")
    except WinchkitError:
        raise
    except Exception as error:  # noqa: BLE001 - readers and decoders raise many kinds
        if not rows:
            raise RunError(Fault(f"is not a readable MCAP file: {error}", path)) from None
        count = sum(map(len, rows.values()))
        notes.append(
            f"the file is damaged or cut off ({error}); its first {count} messages are read"
        )
    columns = [c for topic, found in rows.items() for c in _columns(topic, found)]
    notes = list(dict.fromkeys(notes))
    if not columns:
        text = "has no messages with numbers in JSON or ROS 2"
        raise RunError(Fault("; ".join([text, *notes]), path))
    return Table(path, "MCAP", named_apart(columns), notes=tuple(notes))


def _decoded(path: str, schema: Any, channel: Any, data: bytes, decoders: dict[int, Any]) -> Any:
    """A message as mappings, lists and numbers; None in an unknown encoding."""
    if channel.message_encoding == "json":
        return json.loads(data)
    if channel.message_encoding != "cdr" or schema is None or schema.encoding != "ros2msg":
        return None
    if schema.id not in decoders:
        decoders[schema.id] = _ros2(path, schema)
    return decoders[schema.id](data)


def _ros2(path: str, schema: Any) -> Any:
    try:
        from mcap_ros2.decoder import DecoderFactory
    except ImportError:
        raise UsageError(
            f"{path}: messages of ROS 2 need mcap-ros2-support; install it with "
            "pip install 'winchkit[ros2]'"
        ) from None
    return DecoderFactory().decoder_for("cdr", schema)


def _columns(topic: str, found: Sequence[tuple[int, Mapping[str, float]]]) -> Iterator[Column]:
    found = sorted(found, key=lambda item: item[0])
    times = np.array([stamp for stamp, _ in found], dtype=np.int64)
    names = dict.fromkeys(name for _, values in found for name in values)
    if not names:
        return
    yield Column("log_time", times.astype(np.float64), "ns", (topic,), group=topic)
    for name in names:
        values = np.array([row.get(name, np.nan) for _, row in found], dtype=np.float64)
        yield Column(name, values, "", (topic,), group=topic)


def _numbers(name: str, value: Any, depth: int) -> Iterator[tuple[str, float]]:
    """Paths and values of the numbers of a message."""
    if isinstance(value, bool | int | float):
        yield name or "data", float(value)
    elif depth > _DEEPEST:
        return
    elif isinstance(value, Mapping):
        yield from _fields(name, value, depth)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        if len(value) <= _LONGEST:
            for index, item in enumerate(value):
                yield from _numbers(f"{name}[{index}]", item, depth + 1)
    elif hasattr(value, "__slots__"):
        slots = {key.lstrip("_"): getattr(value, key) for key in value.__slots__}
        yield from _fields(name, slots, depth)


def _fields(name: str, fields: Mapping[Any, Any], depth: int) -> Iterator[tuple[str, float]]:
    joints = fields.get("name")
    is_joints = isinstance(joints, Sequence) and not isinstance(joints, str) and bool(joints)
    for key, item in fields.items():
        if key in {"header", "name"} and depth <= 1:
            continue
        path = f"{name}.{key}" if name else str(key)
        lists = isinstance(item, Sequence) and not isinstance(item, str | bytes)
        if is_joints and lists and joints is not None and len(item) == len(joints):
            for joint, one in zip(joints, item, strict=True):
                yield from _numbers(f"{joint}.{path}", one, depth + 1)
        else:
            yield from _numbers(path, item, depth + 1)
