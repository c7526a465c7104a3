"""Writer of runs in MCAP, one record per row, so that a cut-off file keeps all complete rows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from mcap.writer import Writer

from winchkit.runs.formats.mcap_file import COLUMNS, METADATA, PROFILE, SCHEMA, TOPIC, row_schema
from winchkit.runs.run_writer import RunWriter


class McapWriter(RunWriter):
    """An MCAP file without chunks, since a chunk would delay rows until it is full."""

    flush_interval = 0.25

    def _begin(self, metadata: Mapping[str, str]) -> None:
        self._time = self._names.index("time")
        self._count = 0
        self._writer = Writer(self._stream, use_chunking=False, enable_data_crcs=True)
        self._writer.start(PROFILE, "winchkit")
        schema = self._writer.register_schema(SCHEMA, "jsonschema", row_schema(self.columns))
        self._channel = self._writer.register_channel(TOPIC, "json", schema)
        self._writer.add_metadata(METADATA, dict(metadata))
        self._writer.add_metadata(COLUMNS, dict(self.columns))

    def _row(self, values: Sequence[float]) -> None:
        # NaN is the only number that differs from itself.
        cells = [value if value == value else None for value in values]  # noqa: PLR0124
        row = dict(zip(self._names, cells, strict=True))
        stamp = max(round((cells[self._time] or 0.0) * 1e9), 0)
        data = json.dumps(row, separators=(",", ":"), allow_nan=False).encode()
        self._writer.add_message(self._channel, stamp, data, stamp, self._count)
        self._count += 1

    def _end(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
