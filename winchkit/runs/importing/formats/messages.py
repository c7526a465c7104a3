"""Reader of MCAP files of other programs: messages in JSON, and of ROS 2 (extra ``ros2``).

Every topic is a group of columns with its own times, of its recorder and of its source.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError, WinchkitError, one_line
from winchkit.extras import library
from winchkit.runs.importing.formats.fields import numbers_of, stamp_of
from winchkit.runs.importing.source_stamps import LOG_TIME, SOURCE_STAMP
from winchkit.runs.importing.table import ColumnTable, FileColumn, named_apart


@dataclass(frozen=True)
class _Message:
    log_time: int
    """ns."""
    stamp: int | None
    """Of its header, ns; None without one."""
    numbers: dict[str, float]


def read_messages(path: str, data: bytes) -> ColumnTable:
    """Read an MCAP file: columns by topic, with log time and header's stamp in ns.

    Raises UsageError for ROS 2 messages without the decoder; RunError for an invalid file, and one
    without numbers in a known encoding.
    """
    from mcap.reader import NonSeekingReader

    rows: dict[str, list[_Message]] = {}
    notes: list[str] = []
    decoders: dict[int, Any] = {}
    try:
        messages = NonSeekingReader(io.BytesIO(data)).iter_messages(log_time_order=False)
        for schema, channel, message in messages:
            found = _decoded(path, schema, channel, message.data, decoders)
            if found is not None:
                read = _Message(message.log_time, stamp_of(found), dict(numbers_of(found)))
                rows.setdefault(channel.topic, []).append(read)
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
    columns = [c for topic, found in rows.items() for c in _columns(topic, found, notes)]
    notes = list(dict.fromkeys(notes))
    if not columns:
        text = "has no messages with numbers in JSON or ROS 2"
        raise RunError(Fault("; ".join([text, *notes]), path))
    layout = "MCAP" if decoders else "MCAP, JSON"
    return ColumnTable(path, layout, named_apart(columns), notes=tuple(notes))


def _decoded(path: str, schema: Any, channel: Any, data: bytes, decoders: dict[int, Any]) -> Any:
    """A message as mappings, lists and numbers; None in an unknown encoding."""
    if channel.message_encoding == "json":
        return json.loads(data)
    if channel.message_encoding != "cdr" or schema is None or schema.encoding != "ros2msg":
        return None
    if schema.id not in decoders:
        ros2 = library("mcap_ros2.decoder", f"{path}: a message of ROS 2")
        decoders[schema.id] = ros2.DecoderFactory().decoder_for("cdr", schema)
    return decoders[schema.id](data)


def _columns(topic: str, found: Sequence[_Message], notes: list[str]) -> Iterator[FileColumn]:
    names = dict.fromkeys(name for item in found for name in item.numbers)
    if not names:
        return
    stamps = [item.stamp for item in found if item.stamp is not None]
    zeros = stamps.count(0)
    if zeros > 1:
        notes.append(f"topic {topic}: {zeros} of {len(found)} stamps are 0; none is used")
    elif len(stamps) == len(found):
        yield FileColumn(SOURCE_STAMP, np.array(stamps, float), "ns", (topic,), group=topic)
    times = np.array([item.log_time for item in found], dtype=np.float64)
    yield FileColumn(LOG_TIME, times, "ns", (topic,), group=topic)
    for name in names:
        values = np.array([item.numbers.get(name, np.nan) for item in found], dtype=np.float64)
        yield FileColumn(name, values, "", (topic,), group=topic)
