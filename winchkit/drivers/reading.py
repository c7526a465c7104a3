"""Reading of an instrument with its quality flags, and the interface of any instrument."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from functools import cache
from typing import Protocol

from winchkit.drivers.counters import Counters
from winchkit.errors import ConnectionLost
from winchkit.schema.devices.modbus import StatusMeaning

REPLY_HORIZON = 10.0
"""A reply comes within so many of the device's longest reply times after its time-out, or never.
The device file's number is from a manual; a converter on the way adds a delay of its own."""


class Quality(Flag):
    """Quality flags of a reading; GOOD is none."""

    GOOD = 0
    OVERLOAD = auto()
    UNDERLOAD = auto()
    UNSTABLE = auto()
    FAULT = auto()
    DUPLICATE = auto()
    """The same count as before: perhaps the same conversion, read twice."""
    LATE = auto()
    """The reply took so long that the moment of sampling is uncertain."""
    STALE = auto()
    """The device reports that it has no new value."""
    FROZEN = auto()
    """The raw counts are frozen."""
    MISMATCH = auto()
    """Status and value contradict each other, e.g. for a wrong word order in the device file."""
    AMBIGUOUS = auto()
    """It may be the late reply to an earlier request, whose form is that of the answer."""

    @property
    def usable(self) -> bool:
        """Whether the value is a measurement at all."""
        return not self & _UNUSABLE

    def __str__(self) -> str:
        return _words(self.value)


@cache
def _words(flags: int) -> str:
    return ", ".join(flag.name.lower() for flag in Quality(flags) if flag.name) or "good"


_UNUSABLE = (
    Quality.OVERLOAD
    | Quality.UNDERLOAD
    | Quality.FAULT
    | Quality.STALE
    | Quality.FROZEN
    | Quality.MISMATCH
    | Quality.AMBIGUOUS
)


@dataclass(frozen=True, slots=True)
class InstrumentReading:
    """One answer of an instrument; times are on the bench's clock, s."""

    value: float
    """Net, calibrated, SI; NaN where the flags say that it is no measurement."""
    gross: float
    """Calibrated value before any tare, the device's or the host's."""
    raw: float
    """Counts as read, with their sign."""
    quality: Quality
    t_request: float
    t_receive: float
    t_sample: float
    """Estimate of the moment that the value belongs to: wire, conversion and filter taken off."""
    t_uncertainty: float
    """Half the interval in which that moment lies, s."""


class Sensor(Protocol):
    """An instrument as the bench sees it, whatever line it is on."""

    name: str
    period: float
    """Between two readings, s."""
    max_age: float
    """A reading older than this is stale, s."""

    @property
    def latest(self) -> InstrumentReading | None:
        """Newest reading; other threads read it."""

    @property
    def problem(self) -> ConnectionLost | None:
        """Why there is no new reading, while there is none."""

    @property
    def listeners(self) -> list[Callable[[InstrumentReading], None]]:
        """Called with every reading, on the thread of the slow devices."""

    @property
    def counters(self) -> Counters:
        """What happened since the start."""

    @property
    def tared(self) -> bool | None:
        """Whether the device says that it shows a net value; None where it does not say."""

    @property
    def host_tare(self) -> float:
        """Value that the host subtracts from the calibrated one, SI."""


_FLAGS: Mapping[StatusMeaning, Quality] = {
    "overload": Quality.OVERLOAD,
    "underload": Quality.UNDERLOAD,
    "fault": Quality.FAULT,
    "unstable": Quality.UNSTABLE,
    "busy": Quality.STALE,
}


class StatusWord:
    """Bits by meaning, as a device file declares them; several bits may mean the same."""

    def __init__(self, bits: Mapping[StatusMeaning, Sequence[int]]) -> None:
        self._masks = {meaning: sum(1 << bit for bit in many) for meaning, many in bits.items()}

    def has(self, meaning: StatusMeaning, status: int) -> bool:
        """Whether a status says ``meaning``, e.g. that a tare is active."""
        return bool(status & self._masks.get(meaning, 0))

    def quality(self, status: int) -> Quality:
        """Flags of a reading by its status alone."""
        quality = Quality.GOOD
        for meaning, flag in _FLAGS.items():
            if self.has(meaning, status):
                quality |= flag
        if self._denies("stable", status):
            quality |= Quality.UNSTABLE
        if self._denies("valid", status) and quality.usable:
            quality |= Quality.FAULT
        return quality

    def _denies(self, meaning: StatusMeaning, status: int) -> bool:
        """Whether the device could say something good of the reading, and does not."""
        return meaning in self._masks and not self.has(meaning, status)
