"""Results of the calls of a load cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from winchkit.drivers.counters import Latency


@dataclass(frozen=True)
class CellTares:
    """Tares in force."""

    host: float
    """Subtracted by winchkit, N; 0 without one."""
    device: bool | None
    """Whether the device shows a net value; None where it does not say."""


@dataclass(frozen=True)
class CellValue:
    """One reading of a cell."""

    value: float
    """After tares, in the unit of the instrument (N, or °C of a thermometer)."""
    gross: float
    """Before the host's tare, in the same unit."""
    raw: float
    """Counts of the device."""
    quality: str


@dataclass(frozen=True)
class CellTiming:
    """Times of one reading, s."""

    age: float
    """From the sample to its receipt."""
    uncertainty: float
    """Of the time of the sample."""
    filter: float
    """Delay by the device's filter, from its device file."""
    latency: float
    """From the request to the receipt."""


@dataclass(frozen=True)
class CellInfo:
    """What is known of an instrument."""

    cell: str
    """Full name, such as ``A.cell``."""
    device: Mapping[str, str]
    """Name, maker, model, source and trust of its device file."""
    identity: Mapping[str, float]
    """What the device says of itself, such as its serial number."""
    calibration: str | None
    """Name and date of its calibration."""
    coefficients: tuple[float, ...]
    """Of the reading over the counts, ascending powers."""
    tare: CellTares
    """Tares in force."""
    reading: CellValue
    """The present one."""
    timing: CellTiming
    """Of the present reading."""
    counters: Mapping[str, int]
    """Readings, errors and repeats since the start."""
    remarks: tuple[str, ...]
    """What is to be known of its line, device file and calibration."""


@dataclass(frozen=True)
class CellExchange:
    """Where the time of one reading on its line goes; None for what is not known of the line."""

    baudrate: int | None
    """Of a serial line, Bd."""
    sharing: int | None = None
    """Instruments on the line."""
    line_rate: float | None = None
    """Readings of this instrument that the line carries, 1/s."""
    time: float | None = None
    """Of the whole reading, s."""
    bytes: int | None = None
    """Of requests and replies."""
    wire: float | None = None
    """Of these bytes on the wire, s."""
    silence: float | None = None
    """Between frames, s."""
    turnaround: float | None = None
    """Of the device, s."""
    queries: int | None = None
    """Requests of one reading."""


@dataclass(frozen=True)
class CellRate:
    """Rate at which an instrument is read, and what limits it; rates in 1/s."""

    cell: str
    """Full name, such as ``A.cell``."""
    rate: float
    """Measured."""
    planned: float
    """By its device file, its wiring and its line."""
    by_itself: bool
    """The device sends without requests."""
    limited_by: str
    """Key of ``limits``."""
    limits: Mapping[str, float]
    """Rates by what limits them."""
    exchange: CellExchange | None
    """Where the time of one reading on its line goes; None where the device sends by itself."""
    duplicates: float
    """Share of readings with the counts of the one before."""
    latency: Latency
    """From request to receipt."""
    counters: Mapping[str, int]
    """As of :class:`CellInfo`."""
    advice: str
    """How to read it faster; empty where there is none."""


@dataclass(frozen=True)
class CellTare:
    """A tare or zero that was set or removed; in the unit of the instrument, None if not known."""

    before: float | None = None
    """Mean reading before."""
    std: float | None = None
    """Of the readings before."""
    readings: int | None = None
    """Number of them."""
    after: float | None = None
    """Mean reading after."""
    tare: float | None = None
    """The host's tare from now on."""
    removed: float | None = None
    """The host's tare that was removed."""
    host_tare: float | None = None
    """The tare of the host that is in force as well as that of the device."""
    file: str | None = None
    """File that keeps the host's tares."""
