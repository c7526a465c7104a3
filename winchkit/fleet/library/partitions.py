"""Files of a library's tables: one per winch and month, replaced as a whole, under a lock.

A partition is written beside and renamed, so that a reader sees the old or the new file. Writers of
one table exclude each other by a lock of the operating system, which ends with the process.
"""

from __future__ import annotations

import os
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from winchkit.errors import Fault, FileError
from winchkit.fleet.library.tables import arrow_schema
from winchkit.regular_file import file_errors
from winchkit.runs.files import write_whole
from winchkit.runs.recording.log_file import Lock, lock_file

if TYPE_CHECKING:
    import pyarrow as pa

FOLDER = ".winchkit-library"
"""Folder of the tables, below that of the runs."""
_EMPTY = "%"
"""Folder of a winch without a name: never the encoding of one."""
_POLL = 0.05
"""s: not noticed by a user."""
Row = dict[str, Any]
"""A row of a table by column."""


@dataclass(frozen=True)
class Partitions:
    """Tables of the library of a folder of runs."""

    runs: Path
    """Folder of the runs."""

    @property
    def folder(self) -> Path:
        """Folder of the tables."""
        return self.runs / FOLDER

    def files(self, table: str) -> list[Path]:
        """Partitions of a table, sorted."""
        return sorted((self.folder / table).glob("*/*.parquet"))

    def of_winch(self, table: str, winch: str) -> list[Path]:
        """Partitions of one winch, sorted."""
        return sorted((self.folder / table / _encoded(winch)).glob("*.parquet"))

    def place(self, table: str, row: Mapping[str, Any]) -> Path:
        """Partition of a row, by its winch and the UTC month of its time."""
        moment: datetime = row["time"]
        return self.folder / table / _encoded(row["winch"]) / f"{moment:%Y-%m}.parquet"

    def read(self, table: str, columns: Sequence[str] | None = None) -> pa.Table:
        """Rows of a table; raises FileError for a damaged partition."""
        import pyarrow as pa

        schema = arrow_schema(table)
        wanted = schema if columns is None else pa.schema([schema.field(c) for c in columns])
        parts = [self._read(path, columns) for path in self.files(table)]
        return pa.concat_tables([wanted.empty_table(), *parts])

    def placed(self, table: str, columns: Sequence[str]) -> list[tuple[Path, Row]]:
        """Partition and columns of every row; a damaged partition is removed, to be rebuilt."""
        out = []
        for path in self.files(table):
            try:
                rows = self._read(path, columns).to_pylist()
            except FileError:
                path.unlink(missing_ok=True)
                continue
            out += [(path, row) for row in rows]
        return out

    def change(
        self, table: str, drop: Callable[[Row], bool], touched: Iterable[Path], rows: Sequence[Row]
    ) -> None:
        """Remove rows and add others; the caller holds the lock. Raises FileError where a partition
        cannot be written; it then is as before. Partitions that only lose rows are written first: a
        row is missing after a kill, and never there twice."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = arrow_schema(table)
        new: dict[Path, list[Row]] = defaultdict(list)
        for row in rows:
            new[self.place(table, row)].append(row)
        for path in sorted({*touched, *new}, key=lambda path: (path in new, path)):
            old = self._read(path, None).to_pylist() if path.exists() else []
            kept = [row for row in old if not drop(row)]
            if path not in new and len(kept) == len(old):
                continue
            kept += new.get(path, [])
            if not kept:
                path.unlink(missing_ok=True)
                continue
            content = BytesIO()
            pq.write_table(pa.Table.from_pylist(kept, schema=schema), content)
            _made(path.parent)
            write_whole(path, content.getvalue())

    @contextmanager
    def locked(self, table: str, waiting: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Exclude other writers of a table meanwhile, after one that is writing. Raises FileError
        where the folder cannot be written or its file system has no locks."""
        _made(self.folder)
        path = self.folder / f"{table}.lock"
        with file_errors(path):
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            while (state := lock_file(descriptor)) is Lock.BUSY:
                waiting()
                time.sleep(_POLL)
            if state is Lock.UNSUPPORTED:
                message = "its file system has no locks; keep the library on one that has"
                raise FileError(Fault(message, str(path)))
            yield
        finally:
            os.close(descriptor)

    def _read(self, path: Path, columns: Sequence[str] | None) -> pa.Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = arrow_schema(path.parent.parent.name)
        wanted = schema if columns is None else pa.schema([schema.field(c) for c in columns])
        try:
            # Small tables: threads save nothing, and may abort the process when it exits.
            file = pq.ParquetFile(BytesIO(path.read_bytes()))
            found = file.read(columns=columns, use_threads=False)
            return found.select(wanted.names).cast(wanted)
        except (OSError, pa.ArrowException, KeyError) as error:
            message = f"is no partition of a library ({error}); delete it, and index again"
            raise FileError(Fault(message, str(path))) from None


def _encoded(winch: str) -> str:
    """Name of a winch as one folder."""
    return quote(winch, safe="").replace(".", "%2E") or _EMPTY


def _made(folder: Path) -> None:
    with file_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
