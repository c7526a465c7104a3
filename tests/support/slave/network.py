"""NMT, boot-up, heartbeats (1016h, 1017h), node guarding (100Ch, 100Dh) and 1029h of CiA 301."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from slave.dictionary import Abort, Dictionary
from slave.frames import Frame

_MS = 1e-3
HEARTBEAT_LOST = 0x8130


class Nmt(IntEnum):
    """NMT states with the number that a heartbeat shows."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


_COMMANDS = {0x01: Nmt.OPERATIONAL, 0x02: Nmt.STOPPED, 0x80: Nmt.PRE_OPERATIONAL}


class Network:
    """The NMT state of a node, and what watches it and the master.

    ``on_state`` gets each change, ``on_reset`` the first and last object that a reset gives
    its power-on value, ``on_lost`` the code of a connection that was lost.
    """

    def __init__(
        self,
        node: int,
        objects: Dictionary,
        send: Callable[[Frame], None],
        *,
        boot_time: float = 0.02,
    ) -> None:
        self.node, self.objects, self.boot_time = node, objects, boot_time
        self.state = Nmt.INITIALISING
        self.on_state: Callable[[Nmt, Nmt], None] = lambda _old, _new: None
        self.on_reset: Callable[[int, int], None] = lambda _first, _last: None
        self.on_lost: Callable[[int], None] = lambda _code: None
        self._send = send
        self._boots_at: float | None = None
        self._beat_at = 0.0
        self._heard: dict[int, float] = {}
        self._lost: set[int] = set()
        self._consumers: list[tuple[int, float]] | None = None
        self.polls_need_life_time = False
        """Whether a poll is answered with life guarding on only, as by Lely's CANopen stack."""
        self.same_consumer_goes_on = False
        """Whether an entry of 1016h that is written again as it was is monitored on, as there."""
        self._consumer_before = 0
        self._toggle = 0
        self._guarded: float | None = None

    def power_on(self, now: float) -> None:
        """Begin to boot."""
        self._begin_boot(now, 0)

    def command(self, data: bytes, now: float) -> None:
        """An NMT command for this node or for all."""
        if len(data) < 2 or data[1] not in (0, self.node) or self.state is Nmt.INITIALISING:
            return
        if data[0] == 0x81:
            self._begin_boot(now, 0)
        elif data[0] == 0x82:
            self._begin_boot(now, 0x1000)
        elif data[0] in _COMMANDS:
            self.enter(_COMMANDS[data[0]])

    def enter(self, state: Nmt) -> None:
        """Change the NMT state."""
        old, self.state = self.state, state
        if old is not state:
            self.on_state(old, state)

    def hear(self, node: int, data: bytes, now: float) -> None:
        """A heartbeat of another node: its consumer entry arms, or goes on."""
        if data and any(other == node for other, _ in self._consumed()):
            self._heard[node] = now
            self._lost.discard(node)

    def guard(self, now: float) -> None:
        """An RTR for the state: the answer carries a toggle bit; life guarding begins."""
        if self.state is Nmt.INITIALISING or self.objects.get(0x1017):
            return
        if self.polls_need_life_time and not self.objects.get(0x100C) * self.objects.get(0x100D):
            return
        self._guarded = now
        self._lost.discard(0)
        self._beat(self._toggle | self.state)
        self._toggle ^= 0x80

    def written(self, index: int, sub: int, now: float) -> None:
        """An object was written by SDO."""
        if index == 0x1016 and sub:
            same = self.objects.get(0x1016, sub) == self._consumer_before
            if self.same_consumer_goes_on and same:
                return
            self._consumers = None
            nodes = {node for node, _ in self._consumed()}
            self._heard = {node: at for node, at in self._heard.items() if node in nodes}
            self._heard.pop(self.objects.get(0x1016, sub) >> 16 & 0x7F, None)
            self._lost.clear()
        elif index == 0x1017:
            self._beat_at = now
            self._guarded = None

    def check_write(self, index: int, sub: int, data: bytes) -> None:
        """One node may stand in one consumer entry only."""
        if index != 0x1016 or not sub:
            return
        self._consumer_before = self.objects.get(0x1016, sub)
        value = int.from_bytes(data, "little")
        node = value >> 16 & 0xFF
        others = {
            self.objects.get(0x1016, other) >> 16 & 0x7F
            for other in range(1, self.objects.get(0x1016) + 1)
            if other != sub and self.objects.get(0x1016, other) & 0xFFFF
        }
        if value & 0xFFFF and node in others:
            raise Abort(0x06040043)

    def advance(self, now: float, *, watches: bool) -> None:
        """Boot, beat, and notice who has fallen silent."""
        if self._boots_at is not None and now >= self._boots_at:
            self._boots_at, self._beat_at = None, now
            self._beat(Nmt.INITIALISING)
            self.enter(Nmt.PRE_OPERATIONAL)
        if self.state is Nmt.INITIALISING:
            return
        period = self.objects.get(0x1017) * _MS
        if period and now >= self._beat_at:
            self._beat(self.state)
            self._beat_at = max(self._beat_at + period, now)
        if watches:
            self._watch(now)

    def _consumed(self) -> list[tuple[int, float]]:
        """Nodes of 1016h with their times."""
        entries = (self.objects.get(0x1016, sub) for sub in range(1, self.objects.get(0x1016) + 1))
        return [(e >> 16 & 0x7F, (e & 0xFFFF) * _MS) for e in entries if e & 0xFFFF and e >> 16]

    def _watch(self, now: float) -> None:
        for node, limit in self._consumed():
            heard = self._heard.get(node)
            if heard is not None and now - heard > limit and node not in self._lost:
                self._lost.add(node)
                self._heard.pop(node)
                self._lose()
        life = self.objects.get(0x100C) * _MS * self.objects.get(0x100D)
        if (
            life
            and self._guarded is not None
            and now - self._guarded > life
            and 0 not in self._lost
        ):
            self._lost.add(0)
            self._lose()

    def _lose(self) -> None:
        """The drive first, since in the state stopped nothing can be said any more."""
        self.on_lost(HEARTBEAT_LOST)
        reaction = self.objects.get(0x1029, 1, 0)
        if reaction == 2:
            self.enter(Nmt.STOPPED)
        elif reaction == 0 and self.state is Nmt.OPERATIONAL:
            self.enter(Nmt.PRE_OPERATIONAL)

    def _begin_boot(self, now: float, first: int) -> None:
        last = 0x1FFF if first else 0xFFFF
        self.enter(Nmt.INITIALISING)
        self.on_reset(first, last)
        self._consumers = None
        self._heard.clear()
        self._lost.clear()
        self._toggle, self._guarded = 0, None
        self._boots_at = now + self.boot_time

    def _beat(self, value: int) -> None:
        self._send(Frame(0x700 + self.node, bytes((value,))))
