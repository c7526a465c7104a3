"""How runs and logs lie in MCAP files: names of topics and records, and schemas.

A run has one row after another: one JSON message per row on one topic, its keys the columns, null
where there is no value; log time is the column ``time`` in ns. Two metadata records stand before
the first row: the run's metadata, and the columns with their units in the order of the columns.

A log has one topic per source (``/A/drive``, ``/A/cell``), each message a struct of float64 in CDR
as a ROS 2 message has it; log time is the moment of sampling and publish time that of arrival,
both in ns UTC. The metadata record ``winchkit.log`` has the layout and the bench clock's offset.
Messages lie in small compressed chunks, each complete when it is written.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from winchkit.runs.layout import Signal, Source

__all__ = [
    "CDR",
    "COLUMNS",
    "COUNTERS",
    "END",
    "EVENTS",
    "LOG",
    "MARK",
    "METADATA",
    "PROFILE",
    "SCHEMA",
    "TOPIC",
    "message_definition",
    "message_name",
    "row_schema",
]

MARK = b"\x89MCAP0\r\n"
PROFILE = "winchkit"
TOPIC = "run"
SCHEMA = "winchkit.Row"
METADATA = "winchkit.metadata"
COLUMNS = "winchkit.columns"
LOG = "winchkit.log"
"""Metadata record of a log: its ``layout`` as JSON, and the number of its ``part``."""
END = "winchkit.end"
"""Metadata record of a log that was closed: what was counted until then."""
EVENTS = "/events"
COUNTERS = "/counters"
CDR = b"\x00\x01\x00\x00"
"""Head of a CDR message: little-endian; what follows is aligned to eight bytes from here on."""

_WORD = re.compile(r"[A-Za-z]+")


def row_schema(columns: Sequence[tuple[str, str]]) -> bytes:
    """The JSON schema of a row; each property carries its unit."""
    properties = {name: {"type": ["number", "null"], "unit": unit} for name, unit in columns}
    return json.dumps({"title": SCHEMA, "type": "object", "properties": properties}).encode()


def message_name(source: Source) -> str:
    """Name of a source's message type, after the last word of its topic."""
    word: str = _WORD.findall(source.topic)[-1]
    return f"winchkit/msg/{word.capitalize()}"


def message_definition(signals: Sequence[Signal]) -> bytes:
    """The ROS 2 definition of a message; each field carries its unit as a remark."""
    return "".join(f"float64 {item.name} # {item.unit}\n" for item in signals).encode()
