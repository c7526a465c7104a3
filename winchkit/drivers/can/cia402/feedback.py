"""Feedback of a drive from its TPDOs: complete sets, each sampled at one SYNC, with counts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

from winchkit.drivers.can.bus.bus import Handler
from winchkit.drivers.can.canopen.pdo import Key, PdoCodec, joint_layout
from winchkit.drivers.can.cia402.position_agreement import PositionAgreement
from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.state_machine import STATE_BITS, STATES, DriveState, StatusBit
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.errors import Fault, FileError

STATUS, POSITION, VELOCITY, TORQUE = (0x6041, 0), (0x6064, 0), (0x606C, 0), (0x6077, 0)
MODE, ERROR, CURRENT = (0x6061, 0), (0x603F, 0), (0x6078, 0)
_SHOWN = (STATUS, POSITION, VELOCITY, TORQUE, MODE, ERROR, CURRENT)
_QUANTITIES = (POSITION, VELOCITY, TORQUE, CURRENT)
_WITHOUT: Mapping[Key, int | None] = {MODE: None, ERROR: 0}
"""What is shown where a drive does not send it."""
_new = tuple.__new__
_CONTRADICTED = "606Ch has contradicted 6064h"
_NONE = 0
"""No TPDO has this number."""
_KEPT = 3
"""Times its own period after which a slower TPDO counts as missing."""


class AxisFeedback(NamedTuple):
    """Feedback of a drive at one SYNC, SI at the motor shaft; a named tuple is made the fastest."""

    time: float
    """Estimate of the moment of sampling, on the bench's clock, s: the SYNC reaches the drive
    between its sending and the arrival of the first answer."""
    sync: int
    """Number of that SYNC."""
    state: DriveState
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
    shown: int | None = None
    """6064h in counts as the drive shows it; ``angle`` counts on where it wraps."""

    @property
    def limited(self) -> bool:
        """Whether a limit of the drive's own holds it back (status bit 11)."""
        return bool(self.status & StatusBit.INTERNAL_LIMIT)


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
    """Collects the TPDOs that answer one SYNC; :meth:`receiver` takes their frames.

    TPDOs of transmission type 1 are a set: they count only together, and in their order, so that
    none of them can be left over from the SYNC before. The order is that of their numbers until
    a drive answers twice running in another one. TPDOs of other types are slower: their newest
    values are joined until they are too old, and are then unknown.

    The frames of the set are kept as they come and unpacked together, once it is complete.
    """

    def __init__(
        self,
        codecs: Sequence[PdoCodec],
        scale: CountScale,
        cycle: float,
        counter: PositionCounter | None = None,
        agreement: PositionAgreement | None = None,
    ) -> None:
        """Without a ``counter`` one of the mapped position's own size is made."""
        self.feedback: AxisFeedback | None = None
        self._agreement = agreement or PositionAgreement()
        self._counter = counter or PositionCounter(*counter_range(codecs))
        self._cycle = cycle
        members = [codec for codec in codecs if codec.spec.every_sync]
        self._frames = [b""] * len(members)
        self._unpack, each = joint_layout(members)
        slower = [codec for codec in codecs if not codec.spec.every_sync]
        self._slower = [_Slower(codec, self._lifetime(codec)) for codec in slower]
        mapped = [*each, *(key for codec in slower for key in codec.position)]
        lacking = [key for key in _WITHOUT if key not in mapped]
        self._lacking = tuple(_WITHOUT[key] for key in lacking)
        objects = [*mapped, *lacking]
        # A quantity that no TPDO carries is any number times NaN.
        self._at = tuple(objects.index(key) if key in objects else 0 for key in _SHOWN)
        units = zip(
            _QUANTITIES, (scale.angle, scale.velocity, scale.torque, scale.current), strict=True
        )
        self._units = tuple(unit if key in mapped else math.nan for key, unit in units)
        self._next = _NONE
        self._set_order(sorted(codec.spec.number for codec in members))
        self._strays: list[int] = []
        self._before: list[int] = []
        self._sync, self._sent, self._came = 0, -math.inf, -math.inf
        self._complete = self._missed = self._torn = self._short = self._late = 0

    @property
    def health(self) -> FeedbackHealth:
        """The counts up to now."""
        return FeedbackHealth(self._complete, self._missed, self._torn, self._short, self._late)

    def begin(self, sync: int, now: float) -> None:
        """Note a SYNC that is about to be sent: what follows is its answer."""
        if self._next and self._sync:
            self._missed += 1
            self._learn_order()
        if self._strays:
            self._strays = []
        self._next = self._first
        self._sync = sync
        self._sent = now

    def receiver(self, codec: PdoCodec) -> Handler:
        """What takes the frames of one TPDO."""
        return self._member(codec) if codec.spec.every_sync else self._slower_one(codec)

    def _member(self, codec: PdoCodec) -> Handler:
        """Take a TPDO of the set; the last of them completes an answer, which becomes feedback."""
        number, size, frames = codec.spec.number, codec.size, self._frames
        place = sorted(self._order).index(number)
        unpack, cycle, join = self._unpack, self._cycle, b"".join
        slower, lacking, counter = self._slower, self._lacking, self._counter
        compare = self._agreement.take
        status_at, position_at, velocity_at, torque_at, mode_at, error_at, current_at = self._at
        angle, speed, torque, current = self._units

        def receive(data: bytes, now: float) -> None:
            if len(data) != size:
                if len(data) < size:
                    self._short += 1
                    return
                data = data[:size]
            if number != self._next and not self._begins_anew(number):
                return
            frames[place] = data
            if number == self._first:
                self._came = now
            self._next = following = self._following[number]
            if following:
                return
            values = unpack(join(frames))
            if slower:
                values += self._others(now)
            elif lacking:
                values += lacking
            sent = self._sent
            delay = self._came - sent
            time = sent + delay / 2 if 0 <= delay < cycle else sent
            position, status = values[position_at], values[status_at]
            turned, velocity = counter.take(position, time) * angle, values[velocity_at] * speed
            if not counter.jump and compare(time, turned, velocity):
                counter.lose(_CONTRADICTED)
            self._complete += 1
            # What AxisFeedback(...) makes, without the call of its constructor.
            self.feedback = _new(
                AxisFeedback,
                (
                    time,
                    self._sync,
                    STATES[status & STATE_BITS],
                    status,
                    turned,
                    velocity,
                    values[torque_at] * torque,
                    values[mode_at],
                    values[error_at],
                    values[current_at] * current,
                    position,
                ),
            )

        return receive

    def _slower_one(self, codec: PdoCodec) -> Handler:
        """Take a TPDO that comes less often, to be joined to the answers that follow."""
        newest = next(one for one in self._slower if one.codec is codec)

        def receive(data: bytes, now: float) -> None:
            if not newest.take(data, now):
                self._short += 1

        return receive

    def _set_order(self, order: list[int]) -> None:
        self._order, self._first = order, order[0]
        self._following = dict(zip(order, [*order[1:], _NONE], strict=True))
        self._next = self._first

    def _begins_anew(self, number: int) -> bool:
        """Whether a TPDO that is not the next of the set is the first of another one."""
        first = self._first
        if not self._next and number == first:
            self._late += 1
        else:
            self._torn += 1
            self._strays += self._arrived()
        self._next = first
        if number == first:
            return True
        self._strays.append(number)
        return False

    def _arrived(self) -> list[int]:
        """Those of the set that have come in their order."""
        return self._order[: self._order.index(self._next)] if self._next else self._order

    def _learn_order(self) -> None:
        """Take an order over that the drive keeps to, of all its TPDOs once each."""
        came = [*self._strays, *self._arrived()]
        if sorted(came) != sorted(self._order):
            self._before = []
        elif came == self._before:
            self._set_order(came)
        else:
            self._before = came

    def _lifetime(self, codec: PdoCodec) -> float:
        spec = codec.spec
        if spec.by_event:
            return _KEPT * spec.event_timer or math.inf
        return _KEPT * spec.transmission * self._cycle or math.inf

    def _others(self, now: float) -> tuple[Any, ...]:
        """Values that do not come with every SYNC: those of slower TPDOs, and unknown ones."""
        return tuple(chain.from_iterable(one.values(now) for one in self._slower)) + self._lacking


def counter_range(codecs: Sequence[PdoCodec]) -> tuple[int, int]:
    """Lowest and highest count that the mapped 6064h can show."""
    for codec in codecs:
        if POSITION in codec.position:
            bits = codec.objects[codec.position[POSITION]].bits
            return -(1 << bits - 1), (1 << bits - 1) - 1
    return -(1 << 31), (1 << 31) - 1


class _Slower:
    """The newest values of a TPDO that does not come with every SYNC."""

    def __init__(self, codec: PdoCodec, lifetime: float) -> None:
        self.codec, self._lifetime = codec, lifetime
        self._unknown = tuple(_WITHOUT.get(key, math.nan) for key in codec.position)
        self._values, self._expires = self._unknown, math.inf

    def take(self, data: bytes, now: float) -> bool:
        """Take a frame; False where it is too short."""
        values = self.codec.decode(data)
        if values is None:
            return False
        self._values, self._expires = values, now + self._lifetime
        return True

    def values(self, now: float) -> tuple[Any, ...]:
        """The newest values, or unknown ones once those are too old."""
        return self._values if now <= self._expires else self._unknown


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
