"""How a run lies in an MCAP file: names of its topic and records, and the schema of a row.

Every row is one JSON message on one topic, its keys the columns, null where there is no value;
log time is the column ``time`` in ns. Two metadata records stand before the first row: the run's
metadata, and the columns with their units in the order of the columns.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

__all__ = ["COLUMNS", "METADATA", "PROFILE", "SCHEMA", "TOPIC", "row_schema"]

PROFILE = "winchkit"
TOPIC = "run"
SCHEMA = "winchkit.Row"
METADATA = "winchkit.metadata"
COLUMNS = "winchkit.columns"


def row_schema(columns: Sequence[tuple[str, str]]) -> bytes:
    """The JSON schema of a row; each property carries its unit."""
    properties = {name: {"type": ["number", "null"], "unit": unit} for name, unit in columns}
    return json.dumps({"title": SCHEMA, "type": "object", "properties": properties}).encode()
