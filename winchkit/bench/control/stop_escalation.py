"""Stop methods of a drive in their order: the next is used where one shows no reaction.

A pure state machine, asked once a cycle while a winch is being stopped. Every method can only take
energy away: quick stop (02h) and NMT stop lead down from every power state (CiA 402-2, table of
transitions), and silence leaves the drive to the reaction that commissioning proved.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class StopMethod(IntEnum):
    """A stop method."""

    PDO = 0
    SDO = 1
    NMT = 2
    SILENCE = 3


@dataclass(frozen=True, slots=True)
class StopRow:
    """A row of the table."""

    method: StopMethod
    sends: str
    not_heard: str
    """When the next method is used."""
    syncs: int
    """Answers to SYNC that must still show operation enabled, or be missing."""
    timeout: float
    """At least this long, s: a drive takes its time to act, whatever the cycle."""


STOP_TABLE: tuple[StopRow, ...] = (
    StopRow(
        StopMethod.PDO,
        "RPDO with control word 02h, SYNC",
        "NMT state not operational, or 4 SYNCs answered with operation enabled or not at all",
        4,
        0.012,
    ),
    StopRow(
        StopMethod.SDO,
        "expedited SDO write of 6040h = 02h, then a read of 6041h",
        "abort, no reply, or still operation enabled",
        4,
        0.02,
    ),
    StopRow(
        StopMethod.NMT,
        "NMT stop, to drives that commissioning saw leave operation enabled on it",
        "no heartbeat with state stopped",
        2,
        0.06,
    ),
    StopRow(
        StopMethod.SILENCE,
        "nothing: heartbeat, guarding, SYNC and RPDOs cease, as host_loss of the drive says",
        "(the last one)",
        0,
        0.0,
    ),
)


@dataclass(frozen=True, slots=True)
class StopEvidence:
    """State in a cycle of a drive that is being stopped."""

    left: bool
    """Whether a status that was sampled after the stop shows no operation enabled."""
    hears_pdos: bool
    """Whether its NMT state lets it process PDOs, and the bus takes frames."""
    hears_sdos: bool
    """Whether its NMT state lets it answer SDOs, and none was refused."""


class StopEscalation:
    """Present stop method of one drive."""

    def __init__(self) -> None:
        """Begin without a stop."""
        self._table = STOP_TABLE
        self._level = 0
        self._since = 0.0
        self._syncs = 0
        self.method: StopMethod | None = None
        """The method in use; None while nothing is being stopped."""

    def begin(self, now: float, *, nmt: bool = False) -> None:
        """Start; with ``nmt`` the drive was seen to leave operation enabled on NMT stop."""
        self._table = tuple(row for row in STOP_TABLE if nmt or row.method is not StopMethod.NMT)
        self._level, self._since, self._syncs = 0, now, 0
        self.method = self._table[0].method

    def end(self) -> None:
        """The drive has left operation enabled, or nothing is to be stopped any more."""
        self.method = None

    def step(self, now: float, seen: StopEvidence) -> StopMethod | None:
        """The method to use in this cycle; None once the drive has left operation enabled."""
        if seen.left:
            self.end()
        if self.method is None:
            return None
        self._syncs += 1
        while self._not_heard(now, seen):
            self._level += 1
            self._since, self._syncs = now, 0
        self.method = self._table[self._level].method
        return self.method

    def _not_heard(self, now: float, seen: StopEvidence) -> bool:
        row = self._table[self._level]
        if row.method is StopMethod.SILENCE:
            return False
        if (row.method is StopMethod.PDO and not seen.hears_pdos) or (
            row.method is StopMethod.SDO and not seen.hears_sdos
        ):
            return True
        return self._syncs > row.syncs and now - self._since >= row.timeout
