"""Node guarding of CiA 301: the host polls with remote frames, the drive answers with a toggle bit.

Life guarding is the same exchange seen from the drive: where no poll comes for guard time
(100Ch) times life time factor (100Dh), the drive reports EMCY 8130h and acts by 1029h and 6007h.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer
from winchkit.drivers.can.host_loss.mechanism import LIFE_SIGNS, MS, Mechanism, Silence
from winchkit.errors import NotPermitted

FACTOR = 3
"""Life time factor: the drive tolerates two lost polls."""
_LONG_GUARD_TIME, _LONG_FACTOR = 1.0, 60
"""s, and how many of them: a commissioning takes some seconds."""
_TOGGLE, _STATE = 0x80, 0x7F


def guard_time(limit: float) -> float:
    """Period of the polls whose threefold is the longest life time within ``limit``, s."""
    return max(1, int(limit / MS / FACTOR + 1e-9)) * MS


@dataclass
class GuardingWatch(HeartbeatConsumer):
    """Supervises a node by its guarding replies, in place of its heartbeat."""

    missing: ClassVar[str] = (
        "the drive does not answer node guarding any more; check its power and the bus, and that "
        "every adapter passes remote frames"
    )
    replies: int = 0
    """Accepted so far."""
    stuck: int = 0
    """Replies whose toggle bit had not changed; by the standard they count as not received."""
    _toggle: int | None = field(default=None, repr=False)

    def begin_anew(self) -> None:
        """Whatever the next reply's toggle bit is, it counts; silence does not, until then."""
        self._toggle = self.last = None
        self.stuck = 0

    def receive(self, data: bytes, now: float) -> None:
        """Take a frame of 700h + node."""
        if not data:
            return
        if data[0] & _STATE == 0:
            self._toggle = None
            super().receive(data, now)
            return
        toggle = data[0] & _TOGGLE
        if toggle == self._toggle:
            self.stuck += 1
            return
        self._toggle = toggle
        self.replies += 1
        super().receive(data, now)


class Guarding(Mechanism):
    """Life guarding by 100Ch and 100Dh; the drive sends no heartbeat (1017h = 0)."""

    name = "guarding"
    silence = Silence.GUARDING
    supervised_by_heartbeat = False
    watch: GuardingWatch

    def require(self) -> str:
        """100Ch, 100Dh, and an adapter that sends remote frames."""
        objects = ((0x100C, "guard time"), (0x100D, "life time factor"))
        for index, what in objects:
            if self.node.read_if_there(index) is None:
                return f"it has no {index:04X}h ({what}) and cannot be guarded"
        if not self.node.bus.sends_remote:
            return (
                "guarding needs remote frames (RTR), and the interface of this bus sends none; "
                "use another adapter, or another host_loss"
            )
        return ""

    @property
    def guard_time(self) -> float:
        """Period of the host's polls, s."""
        return guard_time(self.terms.limit)

    def set_up(self) -> None:
        """A life time of a minute until the proof, so that polls may be few.

        With a guard time of 0 some drives answer no poll (Lely's CANopen stack).
        """
        self.limit = FACTOR * self.guard_time
        self._set(_LONG_GUARD_TIME, _LONG_FACTOR)

    def poll(self) -> None:
        """Ask the drive for its state."""
        self.node.bus.remote(0x700 + self.node.node)

    def withhold(self) -> float:
        """Poll a few times with life guarding on, then no more."""
        self._set(self.guard_time, FACTOR)
        before = self.watch.replies
        self._send_life_signs(self.poll, self.guard_time)
        self.clock.sleep(self.guard_time / 2)
        if self.watch.replies == before:
            raise NotPermitted(
                f"{self.node.place(0x100C)}: no answer to {LIFE_SIGNS} guarding polls (remote "
                "frames of 700h + node): the adapter sends none, or the drive is not guarded"
            )
        return max(0.0, self.limit - self.guard_time / 2)

    def restore(self) -> None:
        """A life time of a minute again, so that polls may be few while the drive is set up."""
        self._set(_LONG_GUARD_TIME, _LONG_FACTOR)

    def arm(self) -> None:
        """Life guarding on, from the control loop's first poll.

        Some drives count on from the last poll that they had, however long ago. Error control by
        heartbeat in between ends that: a node has one or the other.
        """
        self.node.write(0x1017, 0, round(self.terms.period / MS))
        self.node.write_verified(0x1017, 0, 0)
        self._set(self.guard_time, FACTOR)
        self.watch.begin_anew()

    def disarm(self) -> None:
        """Life guarding off."""
        for index in (0x100D, 0x100C):
            self.node.write_verified(index, 0, 0)

    def _set(self, guard_time: float, factor: int) -> None:
        self.node.write_verified(0x100C, 0, round(guard_time / MS))
        self.node.write_verified(0x100D, 0, factor)
