"""The commissioning record: trials on a bench, confirmations, and the person who gave them.

It is a file beside the bench file (``bench.toml`` -> ``bench.commissioned.json``) and holds the
identity of each drive, SHA-256 of the files that decide how it moves, and the measured times.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from winchkit.bench.cells.instruments import device_of, eds_of
from winchkit.drivers.can.canopen.node import Objects
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.tools.scan import identity_of
from winchkit.errors import FileError, NotPermitted
from winchkit.regular_file import file_errors, read_text, regular
from winchkit.schema.bench import BenchSpec, BusSpec, WinchWiring

SCHEMA = 1
"""Of the record, which counts on with each change of its keys."""


@dataclass(frozen=True)
class FileHash:
    """A file as it was."""

    path: str
    sha256: str


@dataclass(frozen=True)
class DriveRecord:
    """Which drive it was: 1018h, its software version 100Ah, and the sense of its motion."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0
    software: str = ""
    polarity: int | None = None
    """607Eh, which reverses the confirmed direction; None where the drive has none."""


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
class CommissioningRecord:
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
    with file_errors(path, "read"), open(path, "rb", opener=regular) as file:
        digest = hashlib.sha256(file.read()).hexdigest()
    return FileHash(Path(path).name, digest)


def write_record(record: CommissioningRecord, path: str | Path) -> None:
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


def read_record(path: str | Path) -> CommissioningRecord | None:
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
        record = CommissioningRecord(**tree, bench_file=bench_file, winch=winches)
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


_SIMULATED = ("virtual", "udp_multicast")
_VIRTUAL_CAN = "vcan"
_NAMES = {
    "vendor": "vendor id",
    "product": "product code",
    "revision": "revision number",
    "serial": "serial number",
    "software": "software version (100Ah)",
    "polarity": "polarity (607Eh)",
}


def is_simulated(spec: BenchSpec) -> bool:
    """Whether every servo is behind an interface that no real drive is behind."""
    return all(_virtual(spec.bus[winch.servo.bus]) for winch in spec.winch.values())


def items_of(winch: WinchWiring) -> tuple[str, ...]:
    """Items of a winch that have to be confirmed."""
    cell = ("cell",) if winch.cell is not None else ()
    return ("brake", "host loss", "direction", "units", *cell, "limits")


def drive_record(axis: Cia402Axis) -> DriveRecord:
    """Identity of a drive as it says now; raises NoReply, DeviceRefused."""
    port = axis.objects
    identity = identity_of(port)
    software = Objects(port, port.dictionary).text(0x100A)
    return DriveRecord(
        *(identity.vendor, identity.product, identity.revision, identity.serial, software),
        polarity=port.read_if_there(0x607E),
    )


def stale_items(
    spec: BenchSpec, drives: Mapping[str, DriveRecord] | None = None
) -> tuple[str, ...]:
    """Items of the record that are not valid, in words; with ``drives`` their identities too."""
    if not spec.path:
        return ("a bench without a file has no commissioning record",)
    try:
        record = read_record(spec.record_file)
    except FileError as error:
        return (str(error),)
    if record is None:
        return (f"there is no commissioning record {spec.record_file}",)
    return tuple(_stale(spec, record, drives or {}))


def unproved(axes: Mapping[str, Cia402Axis]) -> tuple[str, ...]:
    """Drives whose mechanism against a dead host was neither proved nor seen to work."""
    found = []
    for name, axis in axes.items():
        drive = axis.drive
        if drive is None or drive.host_loss.certain or drive.proof is None or drive.proof.noticed:
            continue
        found.append(f"winch {name}: {drive.host_loss.mechanism}: {drive.host_loss.words}")
    return tuple(found)


def require_commissioned(spec: BenchSpec, drives: Mapping[str, Cia402Axis]) -> None:
    """Raise NotPermitted naming the first item without which nothing may move.

    On a simulated interface no record is needed, but a drive's mechanism against a dead host must
    have been proved there as well.
    """
    items = unproved(drives)
    if not is_simulated(spec):
        known = {name: drive_record(axis) for name, axis in drives.items()}
        items = (*stale_items(spec, known), *items)
    if items:
        more = f" (and {len(items) - 1} more)" if len(items) > 1 else ""
        raise NotPermitted(
            f"bench '{spec.name}' is not commissioned: {items[0]}{more}; run `winchkit commission "
            f"{spec.path or 'BENCH'}`"
        )


def trust_record(spec: BenchSpec, axes: Mapping[str, Cia402Axis]) -> None:
    """Give the axes what commissioning saw of these very drives, where the record still holds."""
    try:
        record = read_record(spec.record_file) if spec.path else None
    except FileError:
        return
    if record is None:
        return
    for name, axis in axes.items():
        known = record.winch.get(name)
        if known is None or any(_stale_winch(spec, name, known, drive_record(axis))):
            continue
        seen = known.host_loss.stopped_after is not None
        axis.take_commissioning(seen_stopping=seen, stops_on_nmt=known.stops_on_nmt)


def _virtual(bus: BusSpec) -> bool:
    if bus.interface in _SIMULATED:
        return True
    return bus.interface == "socketcan" and (bus.channel or "").startswith(_VIRTUAL_CAN)


def _stale(
    spec: BenchSpec, record: CommissioningRecord, drives: Mapping[str, DriveRecord]
) -> Iterator[str]:
    yield from _changed("the bench file", record.bench_file, spec.path)
    for name in spec.winch:
        if name not in record.winch:
            yield f"winch {name} is not in the record"
            continue
        yield from _stale_winch(spec, name, record.winch[name], drives.get(name))


def _stale_winch(
    spec: BenchSpec, name: str, known: WinchRecord, drive: DriveRecord | None
) -> Iterator[str]:
    wiring = spec.winch[name]
    device = device_of(spec, wiring.servo)
    yield from _changed(f"winch {name}: the device file", known.device, device.path)
    if device.servo is not None:
        eds = eds_of(device)
        yield from _changed(f"winch {name}: the EDS", known.eds, eds)
        yield from _other_mechanism(name, wiring, device.servo.host_loss, known)
    for item in items_of(wiring):
        if item not in known.items:
            yield f"winch {name}: {item} was not confirmed"
    if known.host_loss.stopped_after is None:
        yield f"winch {name}: the enabled drive was not seen to stop when the computer fell silent"
    if drive is None:
        return
    for key in fields(DriveRecord):
        was, now = getattr(known.drive, key.name), getattr(drive, key.name)
        if was != now:
            yield f"winch {name}: the drive's {_NAMES[key.name]} is {now}, commissioned was {was}"


def _other_mechanism(
    name: str, wiring: WinchWiring, declared: str, known: WinchRecord
) -> Iterator[str]:
    mechanism = wiring.host_loss or declared
    if known.host_loss.mechanism != mechanism:
        yield (
            f"winch {name}: host_loss is {mechanism}, commissioned was {known.host_loss.mechanism}"
        )


def _changed(what: str, known: FileHash, path: str | Path) -> Iterator[str]:
    try:
        now = hash_of(path)
    except FileError as error:
        yield f"{what} {error}"
        return
    if now.sha256 != known.sha256:
        yield f"{what} {now.path} has changed since commissioning"
