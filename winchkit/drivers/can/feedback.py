"""What a drive's TPDOs say, put together by SYNC: complete, of one moment, and counted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple

from winchkit.drivers.can.bus import Handler
from winchkit.drivers.can.cia402 import State, StatusBit, state_of
from winchkit.drivers.can.pdo import PdoCodec
from winchkit.drivers.can.scale import Scale
from winchkit.errors import Fault, FileError

__all__ = [
    "ERROR",
    "MODE",
    "POSITION",
    "STATUS",
    "VELOCITY",
    "AxisFeedback",
    "FeedbackHealth",
    "Gathering",
    "check_feedback",
]

Key = tuple[int, int]

STATUS, POSITION, VELOCITY, TORQUE = (0x6041, 0), (0x6064, 0), (0x606C, 0), (0x6077, 0)
MODE, ERROR, CURRENT = (0x6061, 0), (0x603F, 0), (0x6078, 0)
_SHOWN = (STATUS, POSITION, VELOCITY, TORQUE, MODE, ERROR, CURRENT)
_NONE = 0
"""No TPDO has this number."""
_KEPT = 3
"""Times its own period after which a slower TPDO counts as missing."""


class AxisFeedback(NamedTuple):
    """What a drive said at one SYNC; SI at the motor shaft.

    A named tuple, since one is made of every drive in every cycle: a frozen dataclass takes six
    times as long to make.
    """

    time: float
    """Estimate of the moment of sampling, on the bench's clock, s: the SYNC reaches the drive
    between its sending and the arrival of the first answer."""
    sync: int
    """Number of that SYNC."""
    state: State
    status: int
    angle: float
    """rad."""
    velocity: float
    """rad/s; NaN where the drive does not send it."""
    torque: float
    """N m; NaN where the drive does not send it."""
    mode: int | None = None
    """As 6061h shows it; None where the drive does not send it."""
    error_code: int = 0
    current: float = math.nan
    """A; NaN where the drive does not send it."""

    @property
    def limited(self) -> bool:
        """Whether a limit of the drive's own holds it back (status bit 11)."""
        return bool(self.status & StatusBit.INTERNAL_LIMIT)

    @property
    def target_reached(self) -> bool:
        """Status bit 10; what it means depends on the mode."""
        return bool(self.status & StatusBit.TARGET_REACHED)


@dataclass(frozen=True, slots=True)
class FeedbackHealth:
    """Counts of a drive's TPDOs since it was commissioned; a snapshot."""

    complete: int = 0
    """SYNCs whose answer was complete."""
    missed: int = 0
    """SYNCs without a complete answer."""
    torn: int = 0
    """TPDOs out of their order: what is left of an answer that came after the next SYNC."""
    short: int = 0
    """Frames with fewer bytes than their mapping."""
    late: int = 0
    """Answers that came after the next SYNC."""


class Gathering:
    """Puts together the TPDOs that answer one SYNC; :meth:`receiver` takes their frames.

    TPDOs of transmission type 1 are a set: they count only together, and in their order, so that
    none of them can be left over from the SYNC before. The order is that of their numbers until
    a drive answers twice running in another one. TPDOs of other types are slower: their newest
    values are joined until they are too old, and are then unknown.
    """

    def __init__(self, codecs: Sequence[PdoCodec], scale: Scale, cycle: float) -> None:
        self.feedback: AxisFeedback | None = None
        self._scale, self._cycle = scale, cycle
        self._order = sorted(codec.spec.number for codec in codecs if codec.spec.every_sync)
        self._parts, places = _places(codecs)
        row = sum(len(codec.objects) for codec in codecs)
        # What no TPDO carries stands at the end of the row and stays unknown.
        self._values: list[int | None] = [None] * (row + 1)
        self._pick = itemgetter(*(places.get(key, row) for key in _SHOWN))
        self._expires: dict[int, float] = {}
        self._members, self._place = len(self._order), 0
        self._next = self._order[0]
        self._strays: list[int] = []
        self._before: list[int] = []
        self._sync, self._sent, self._time = 0, -math.inf, -math.inf
        self._complete = self._missed = self._torn = self._short = self._late = 0

    @property
    def health(self) -> FeedbackHealth:
        """The counts up to now."""
        return FeedbackHealth(self._complete, self._missed, self._torn, self._short, self._late)

    def begin(self, sync: int, now: float) -> None:
        """Note a SYNC that is about to be sent: what follows is its answer."""
        if self._sent > -math.inf and self._place < self._members:
            self._missed += 1
            self._learn_order()
        self._strays = []
        self._place, self._next = 0, self._order[0]
        self._sync, self._sent = sync, now

    def receiver(self, codec: PdoCodec) -> Handler:
        """What takes the frames of one TPDO."""
        return self._member(codec) if codec.spec.every_sync else self._slower(codec)

    def _member(self, codec: PdoCodec) -> Handler:
        """Take a TPDO of the set; the last of them completes an answer."""
        number, size, unpack = codec.spec.number, codec.size, codec.unpack
        part, row = self._parts[number], self._values

        def receive(data: bytes, now: float) -> None:
            if len(data) < size:
                self._short += 1
            elif number == self._next or self._begins_anew(number):
                row[part] = unpack(data)
                self._count_on(now)

        return receive

    def _slower(self, codec: PdoCodec) -> Handler:
        """Take a TPDO that comes less often, to be joined to the answers that follow."""
        number, lifetime = codec.spec.number, self._lifetime(codec)

        def receive(data: bytes, now: float) -> None:
            values = codec.decode(data)
            if values is None:
                self._short += 1
            else:
                self._values[self._parts[number]] = values
                self._expires[number] = now + lifetime

        return receive

    def _count_on(self, now: float) -> None:
        """One more of the set is there."""
        place = self._place
        if place == 0:
            delay = now - self._sent
            self._time = self._sent + delay / 2 if 0 <= delay < self._cycle else self._sent
        self._place = place = place + 1
        if place == self._members:
            self._next = _NONE
            self._publish(now)
        else:
            self._next = self._order[place]

    def _begins_anew(self, number: int) -> bool:
        """Whether a TPDO that is not the next of the set is the first of another one."""
        first = self._order[0]
        if self._place == self._members and number == first:
            self._late += 1
        else:
            self._torn += 1
            self._strays += self._order[: self._place]
        self._place, self._next = 0, first
        if number == first:
            return True
        self._strays.append(number)
        return False

    def _learn_order(self) -> None:
        """Take an order over that the drive keeps to, of all its TPDOs once each."""
        came = [*self._strays, *self._order[: self._place]]
        if sorted(came) != sorted(self._order):
            self._before = []
        elif came == self._before:
            self._order = came
        else:
            self._before = came

    def _lifetime(self, codec: PdoCodec) -> float:
        spec = codec.spec
        if spec.by_event:
            return _KEPT * spec.event_timer or math.inf
        return _KEPT * spec.transmission * self._cycle or math.inf

    def _forget_expired(self, now: float) -> None:
        for number, expires in self._expires.items():
            if now > expires:
                part = self._parts[number]
                self._values[part] = [None] * (part.stop - part.start)

    def _publish(self, now: float) -> None:
        if self._expires:
            self._forget_expired(now)
        status, position, velocity, torque, mode, error, current = self._pick(self._values)
        scale = self._scale
        self._complete += 1
        self.feedback = AxisFeedback(
            self._time,
            self._sync,
            state_of(status),
            status,
            position * scale.angle,
            math.nan if velocity is None else velocity * scale.velocity,
            math.nan if torque is None else torque * scale.torque,
            mode,
            error or 0,
            math.nan if current is None else current * scale.current,
        )


def _places(codecs: Sequence[PdoCodec]) -> tuple[dict[int, slice], dict[Key, int]]:
    """Where each TPDO's values stand in one row of all, and where each object does."""
    parts: dict[int, slice] = {}
    places: dict[Key, int] = {}
    end = 0
    for codec in codecs:
        start, end = end, end + len(codec.objects)
        parts[codec.spec.number] = slice(start, end)
        places |= {(o.index, o.sub): start + k for k, o in enumerate(codec.objects)}
    return parts, places


def check_feedback(name: str, codecs: Sequence[PdoCodec]) -> None:
    """Raise FileError where a device file's TPDOs lack what motion needs."""
    seen = {key for codec in codecs for key in codec.position}
    each = {key for codec in codecs if codec.spec.every_sync for key in codec.position}
    faults = [
        Fault(f"{name}: its TPDO mapping lacks {key[0]:04X}h")
        for key in (STATUS, POSITION, VELOCITY)
        if key not in seen
    ]
    faults += [
        Fault(f"{name}: {key[0]:04X}h has to come with every SYNC; map it with transmission = 1")
        for key in (STATUS, POSITION)
        if key in seen and key not in each
    ]
    if faults:
        raise FileError(faults)
