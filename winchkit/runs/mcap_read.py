"""Reads a run from MCAP; of a file that was cut off, every whole record."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Footer, Message, Metadata
from mcap.stream_reader import StreamReader
from numpy.typing import NDArray
from zstandard import ZstdError

from winchkit.errors import Fault, RunError
from winchkit.runs.assemble import Recording, assemble, refuse
from winchkit.runs.mcap_layout import COLUMNS, METADATA, TOPIC
from winchkit.runs.run import Run
from winchkit.runs.text import read_bytes

__all__ = ["read_mcap"]

Array = NDArray[np.float64]
_MARK = b"\x89MCAP0\r\n"
# What the library raises where bytes are no records: its own errors, failed checksums and text
# (ValueError), lz4 (RuntimeError), zstandard, and lengths that cannot be.
_DAMAGE = (McapError, ValueError, RuntimeError, ArithmeticError, ZstdError)


@dataclass
class _Content:
    """What was found in a file, as far as it could be read."""

    columns: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=dict)
    rows: list[bytes] = field(default_factory=list)
    complete: bool = False


def read_mcap(path: str | Path) -> Run:
    """Read a run; raises RunError where the file is none. A file cut off gives what is whole."""
    name, data = str(path), read_bytes(Path(path))
    if not data.startswith(_MARK):
        raise RunError(Fault("is no MCAP file: it does not begin with MCAP's mark", name))
    content = _collect(data, name)
    if not content.columns:
        topics = ", ".join(sorted(set(content.topics.values()))) or "none"
        message = f"holds no run: there is no metadata record '{COLUMNS}'; its topics are {topics}"
        raise RunError(Fault(message, name))
    notes = []
    if not content.complete:
        notes.append(f"the file is cut off; its {len(content.rows)} whole rows were recovered")
    values = _values(name, content)
    header = list(content.columns.items())
    return assemble(Recording(name, header, list(values), _no_line, content.metadata, notes=notes))


def _no_line(row: int) -> None:
    """A binary file has no lines."""


def _collect(data: bytes, path: str) -> _Content:
    content = _Content()
    try:
        for record in StreamReader(BytesIO(data), validate_crcs=True).records:
            if isinstance(record, Message) and content.topics.get(record.channel_id) == TOPIC:
                content.rows.append(record.data)
            elif isinstance(record, Channel):
                content.topics[record.id] = record.topic
            elif isinstance(record, Metadata) and record.name == COLUMNS:
                content.columns = dict(record.metadata)
            elif isinstance(record, Metadata) and record.name == METADATA:
                content.metadata = dict(record.metadata)
            elif isinstance(record, Footer):
                content.complete = True
    except (EndOfFile, struct.error):
        content.complete = False
    except _DAMAGE as error:
        message = f"is damaged after {len(content.rows)} rows: {error or type(error).__name__}"
        raise RunError(Fault(message, path)) from None
    return content


def _values(path: str, content: _Content) -> Array:
    """Columns by rows, NaN for null and for absent keys."""
    names = list(content.columns)
    values = np.full((len(names), len(content.rows)), np.nan)
    faults: list[Fault] = []
    for index, message in enumerate(content.rows):
        try:
            row = json.loads(message)
            values[:, index] = [_number(row.get(name)) for name in names]
        except (ValueError, AttributeError, TypeError):
            faults.append(Fault(f"row {index + 1} is no JSON object of numbers", path))
    refuse(faults)
    return values


def _number(value: object) -> float:
    if value is None:
        return float("nan")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(value)
    return float(value)
