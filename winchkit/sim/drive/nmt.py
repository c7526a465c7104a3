"""Network functions of a simulated drive: NMT slave, heartbeat producer and consumer, EMCY."""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import IntEnum
from math import inf

from winchkit.sim.drive.object_dictionary import Abort, ObjectDictionary

_HISTORY = 0x1003
"""CiA 301: pre-defined error field."""
_CONSUMER = 0x1016
"""CiA 301: consumer heartbeat time."""
_PRODUCER = 0x1017
"""CiA 301: producer heartbeat time."""
_MS = 1e-3
"""s: unit of the two times."""


class NodeState(IntEnum):
    """NMT state as in a heartbeat."""

    BOOTING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


NMT_COMMANDS = {
    0x01: NodeState.OPERATIONAL,
    0x02: NodeState.STOPPED,
    0x80: NodeState.PRE_OPERATIONAL,
}
"""NMT state by the command that enters it (CiA 301)."""


class Heartbeats:
    """Produces the drive's heartbeat (1017h) and monitors those of other nodes (1016h).

    Monitoring of a node starts with its first heartbeat, as CiA 301 requires. It ends when a
    heartbeat is missing; ``lost`` is then called.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        send: Callable[[], None],
        lost: Callable[[int], None],
        back: Callable[[], None],
    ) -> None:
        self._objects = objects
        self.needs_both = False
        """Whether monitoring needs heartbeat production."""
        self._send, self._lost, self._back = send, lost, back
        self._due = inf
        self._deadlines: dict[int, float] = {}
        self._failed: set[int] = set()
        self._changed = False
        self.producing = True
        objects.guards[_CONSUMER] = self._check
        objects.watchers[_CONSUMER] = self._watch_again
        objects.watchers[_PRODUCER] = self._produce_again

    def start(self, now: float) -> None:
        """Start after boot-up; no node is monitored yet."""
        self._deadlines.clear()
        self._failed.clear()
        self._due = now + self._period if self._period else inf

    def heard(self, node: int, now: float) -> None:
        """Take a heartbeat of another node."""
        limit = self._limits().get(node)
        if limit is None:
            return
        self._deadlines[node] = now + limit
        if node in self._failed:
            self._failed.discard(node)
            self._back()

    def watch(self, now: float) -> None:
        """Detect missing heartbeats."""
        for node in [node for node, limit in self._deadlines.items() if now > limit]:
            self._fail(node)

    def produce(self, now: float) -> None:
        """Send a heartbeat that is due."""
        if self._changed:
            self._changed = False
            self._due = now if self._period else inf
        if now >= self._due:
            if self.producing:
                self._send()
            self._due = max(self._due + self._period, now)

    def lose(self) -> None:
        """Lose all monitored nodes, as after their time-outs."""
        for node in list(self._limits()):
            self._fail(node)

    def _fail(self, node: int) -> None:
        self._deadlines.pop(node, None)
        self._failed.add(node)
        self._lost(node)

    @property
    def _period(self) -> float:
        return self._objects.number(_PRODUCER, 0, 0) * _MS

    def _produce_again(self, sub: int, value: int) -> None:
        self._changed = True

    def _watch_again(self, sub: int, value: int) -> None:
        self._deadlines.clear()

    def _limits(self) -> dict[int, float]:
        found: dict[int, float] = {}
        if self.needs_both and not self._period:
            return found
        for sub in range(1, self._objects.number(_CONSUMER, 0, 0) + 1):
            entry = self._objects.number(_CONSUMER, sub, 0)
            node, time = entry >> 16 & 0x7F, entry & 0xFFFF
            if node and time:
                found[node] = time * _MS
        return found

    def _check(self, sub: int, value: int) -> Abort | None:
        node = value >> 16
        if value & 0xFFFF == 0 or node == 0:
            return None
        if node > 127:
            return Abort.RANGE
        subs = range(1, self._objects.number(_CONSUMER, 0, 0) + 1)
        others = (self._objects.number(_CONSUMER, other, 0) for other in subs if other != sub)
        twice = any(entry >> 16 == node and entry & 0xFFFF for entry in others)
        return Abort.INCOMPATIBLE if twice else None


def error_register(code: int) -> int:
    """Error register (1001h) of an emergency error code; 0 for none."""
    if code == 0:
        return 0
    groups = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08, 0x81: 0x10, 0x82: 0x10}
    return 0x01 | groups.get(code >> 12, 0) | groups.get(code >> 8, 0)


def emergency_frame(objects: ObjectDictionary, code: int) -> bytes:
    """Enter an error (0: none) into 1001h and 1003h, and return the data of the EMCY frame."""
    register = error_register(code)
    objects.put(0x1001, 0, register)
    if code:
        depth = max((sub for index, sub in objects if index == _HISTORY), default=0)
        for sub in range(depth, 1, -1):
            objects.put(_HISTORY, sub, objects.number(_HISTORY, sub - 1, 0))
        objects.put(_HISTORY, 1, code)
        objects.put(_HISTORY, 0, min(depth, objects.number(_HISTORY, 0, 0) + 1))
    return struct.pack("<HB5x", code, register)
