"""The commissioning record: trials on a bench, confirmations, and the person who gave them.

It is a file beside the bench file (``bench.toml`` -> ``bench.commissioned.json``) and holds the
identity of each drive, SHA-256 of the files that decide how it moves, and the measured times.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from winchkit.errors import FileError, NotPermitted
from winchkit.regular_file import read_text, regular

SCHEMA = 1
"""Of the record, which counts on with each change of its keys."""


@dataclass(frozen=True)
class FileHash:
    """A file as it was."""

    path: str
    sha256: str


@dataclass(frozen=True)
class DriveRecord:
    """Which drive it was: 1018h, and its software version 100Ah."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0
    software: str = ""


@dataclass(frozen=True)
class HostLossRecord:
    """How the drive detects the loss of its host, and its observed reaction; times in s."""

    mechanism: str
    limit: float
    """Set time-out of the drive, s."""
    noticed_after: float | None = None
    """On the disabled drive; None where it shows nothing then."""
    stopped_after: float | None = None
    """From the last life sign until the drive, enabled at standstill, had left the state."""
    stopped_moving_after: float | None = None
    """The same in a slow move; None where that was not tried."""
    hardware: str = ""


@dataclass(frozen=True)
class Confirmation:
    """One item of the procedure: the question, the answer, and what was measured (SI)."""

    item: str
    question: str
    answer: str
    time: str
    measured: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class WinchRecord:
    """One winch."""

    drive: DriveRecord
    device: FileHash
    eds: FileHash
    host_loss: HostLossRecord
    stops_on_nmt: bool
    """Whether the enabled drive left operation enabled on NMT stopped."""
    confirmed: tuple[Confirmation, ...]

    @property
    def items(self) -> frozenset[str]:
        """Items that were confirmed."""
        return frozenset(one.item for one in self.confirmed)


@dataclass(frozen=True)
class Record:
    """A bench as it was commissioned."""

    bench: str
    date: str
    by: str
    answers: str
    """``typed``, or the file of answers with its SHA-256."""
    software: Mapping[str, str]
    bench_file: FileHash
    winch: Mapping[str, WinchRecord]


def hash_of(path: str | Path) -> FileHash:
    """SHA-256 of a file, named without its folder; raises FileError."""
    try:
        with open(path, "rb", opener=regular) as file:
            digest = hashlib.sha256(file.read()).hexdigest()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return FileHash(Path(path).name, digest)


def write_record(record: Record, path: str | Path) -> None:
    """Write it whole or not at all; raises NotPermitted."""
    text = json.dumps({"schema": SCHEMA, **dataclasses.asdict(record)}, indent=1) + "\n"
    draft = Path(f"{path}.{os.getpid()}")
    try:
        with draft.open("x", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise NotPermitted(f"{path}: the record cannot be written: {error.strerror}") from error


def read_record(path: str | Path) -> Record | None:
    """The record; None where there is none. Raises FileError for one that cannot be used."""
    try:
        text = read_text(path)
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{path}: the commissioning record cannot be read: {error}") from error
    try:
        tree = json.loads(text)
        schema = tree.pop("schema")
        winches = {name: _winch(one) for name, one in tree.pop("winch").items()}
        bench_file = FileHash(**tree.pop("bench_file"))
        record = Record(**tree, bench_file=bench_file, winch=winches)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path}: holds no commissioning record: {error}") from error
    if schema != SCHEMA:
        raise FileError(f"{path}: schema {schema} is not {SCHEMA}; commission the bench again")
    return record


def _winch(tree: dict[str, Any]) -> WinchRecord:
    return WinchRecord(
        drive=DriveRecord(**tree["drive"]),
        device=FileHash(**tree["device"]),
        eds=FileHash(**tree["eds"]),
        host_loss=HostLossRecord(**tree["host_loss"]),
        stops_on_nmt=tree["stops_on_nmt"] is True,
        confirmed=tuple(Confirmation(**one) for one in tree["confirmed"]),
    )
