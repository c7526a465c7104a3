"""Mechanisms by which a drive detects a lost host: objects, set-up, and the frames that cease.

A mechanism is set up while the drive is pre-operational. ``withhold`` gives the drive the life
signs that it watches and then ends them, on a disabled drive; ``restore`` leaves the mechanism
set up and waiting for the control loop's first life sign; ``disarm`` switches it off at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import PdoCodec
from winchkit.drivers.clock import Clock

HEARTBEAT_LOST = 0x8130
"""EMCY error code of CiA 301: life guard or heartbeat error."""
LIFE_SIGNS = 3
"""Given before the silence of a proof."""
_NODES = range(127, 0, -1)
_PROOF_TIME = 0.1
"""Limit of the heartbeat during its proof at most, s: what is proved is that it watches."""
MS = 1e-3
"""s: unit of 100Ch, 1016h, 1017h and of event timers."""


class Silence(Enum):
    """Frames of the host that a drive monitors; the last way to stop it is to end them."""

    HEARTBEAT = "heartbeat"
    GUARDING = "guarding"
    RPDO = "rpdo"
    SYNC = "sync"
    ALL = "all"
    NOTHING = "nothing"
    """None is monitored; hardware beside the drive stops the winch."""


@dataclass(frozen=True)
class Terms:
    """Times of the mutual supervision of host and drive."""

    host: int
    """Node id of the host."""
    limit: float
    """After this long without a life sign the other side counts as lost, s."""
    period: float
    """Of heartbeats, s."""
    cycle: float
    """SYNC period, s."""


class Mechanism:
    """Base class of the mechanisms, itself used where hardware beside the drive stops the winch."""

    name = "hardware"
    silence = Silence.NOTHING
    supervised_by_heartbeat = True
    """Whether the drive sends a heartbeat (1017h) to the host; else it is guarded."""
    noticed_disabled = True
    """Whether a disabled drive must notice the silence too."""
    codes: frozenset[int] = frozenset({HEARTBEAT_LOST})
    """EMCY codes that say that the drive noticed; empty for any."""

    def __init__(
        self,
        node: SdoNode,
        terms: Terms,
        clock: Clock,
        rpdo: tuple[PdoCodec, ...] = (),
        mode: str = "CSV",
    ) -> None:
        """Nothing is sent yet."""
        self.node, self.terms, self.clock = node, terms, clock
        self._rpdo, self._mode = rpdo, mode
        self.limit = terms.limit
        """Set time-out of the drive, s."""

    def require(self) -> str:
        """Objects and functions for it that the drive lacks, in words; empty where it has all."""
        return ""

    def set_up(self) -> None:
        """Write its objects and read them back; raises NoReply, DeviceRefused."""

    def withhold(self) -> float:
        """Give the drive life signs, then end them; returns its limit from then on, s."""
        return self.limit

    def release(self) -> None:
        """Let frames that were held back for the proof be sent again."""

    def restore(self) -> None:
        """Leave it set up and unarmed after the proof."""

    def disarm(self) -> None:
        """Switch it off; raises ConnectionLost."""

    def _send_life_signs(
        self, life_sign: Callable[[], object], every: float, count: int = LIFE_SIGNS
    ) -> None:
        for number in range(count):
            if number:
                self.clock.sleep(every)
            life_sign()


class Heartbeat(Mechanism):
    """Heartbeat consumer 1016h; the drive acts by 6007h and 1029h."""

    name = "heartbeat"
    silence = Silence.HEARTBEAT

    def require(self) -> str:
        """1016h."""
        there = self.node.read_if_there(0x1016, 1) is not None
        return "" if there else "it has no 1016h and cannot watch the host's heartbeat"

    def set_up(self) -> None:
        """Enter the host into the heartbeat consumer list (1016h), from which it was removed.

        Where the same entry is written again, some drives monitor on from the last heartbeat that
        they had, however the host has paused since (Lely's CANopen stack).
        """
        self.disarm()
        self.node.write_verified(0x1016, 1, consumer_entry(self.terms.host, self.limit))

    def withhold(self) -> float:
        """One heartbeat of a node id that is not in use: its absence affects no other drive."""
        limit = min(self.limit, _PROOF_TIME)
        unused = self._free_node()
        self.node.write_verified(0x1016, 1, consumer_entry(unused, limit))
        self.node.bus.heartbeat(unused, NmtState.OPERATIONAL)
        return limit

    def restore(self) -> None:
        """Enter the host again."""
        self.set_up()

    def disarm(self) -> None:
        """Monitor no node."""
        self.node.write(0x1016, 1, 0)

    def _free_node(self) -> int:
        """A node id that no frame on this bus has shown; from the top, where few devices are."""
        known = (self.terms.host, self.node.node, *self.node.bus.nodes)
        return next(number for number in _NODES if number not in known)


def consumer_entry(host: int, timeout: float) -> int:
    """A heartbeat consumer's entry: node and time in ms."""
    return host << 16 | round(timeout / MS)
