"""A CANopen slave with a CiA 402 drive that misbehaves on demand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slave.dictionary import Abort, Dictionary, read
from slave.emergency import Emergencies
from slave.faults import FAULTS
from slave.frames import Frame, kind_from_host, kind_from_slave
from slave.motion import CYCLIC, Motion
from slave.motor import Declared, Motor
from slave.network import Network, Nmt
from slave.pdo import Pdos
from slave.power import Power, State
from slave.sdo import SdoServer

_STEP = 1e-3
_SYNC_LOST = 0x8700
_MISSED = 1.5
_COMMUNICATION = 0x1FFF


@dataclass(frozen=True)
class Reactions:
    """What a maker decides: each of "none", "fault", "quick stop" and "disable"."""

    leaves_operational: str = "none"
    """On pre-operational and stopped, beside what 6007h says."""
    rpdo_late: str = "fault"
    sync_lost: str = "fault"


@dataclass
class Slave:
    """Driven by ``receive`` and ``advance`` alone; both return the frames that it sends.

    ``faults`` are set by ``inject`` and taken back by ``mend``; what the shaft truly does is in
    ``motor`` and ``power``.
    """

    objects: Dictionary
    node: int = 1
    declared: Declared = field(default_factory=Declared)
    reactions: Reactions = field(default_factory=Reactions)
    boot_time: float = 0.02
    watch: Callable[[Slave], None] = field(default=lambda _slave: None)
    """Called after each step of the motor, at most 1 ms long."""

    def __post_init__(self) -> None:
        self.time = 0.0
        self.faults: dict[str, Any] = {}
        self.twin: Slave | None = None
        self.motor = Motor(self.declared)
        self.power = Power(self.objects, self.motor)
        self.motion = Motion(self.objects, self.power, self.motor, self.declared, self.faults)
        self.network: Network = Network(
            self.node, self.objects, self._send, boot_time=self.boot_time
        )
        self.pdos = Pdos(self.objects, self._send)
        self.sdo = SdoServer(self._upload, self._download)
        self.emergency = Emergencies(self.node, self.objects, self._send)
        self._out: list[Frame] = []
        self._delayed: list[tuple[float, Frame]] = []
        self.stale: dict[int, Frame] = {}
        """TPDOs that are sent again and again, by their identifier."""
        self._status = 0
        self._synced: float | None = None
        self._sync_period, self._awaits_sync = 0.0, False
        self.network.on_state, self.network.on_reset = self._on_state, self._on_reset
        self.network.on_lost = self._on_lost
        self.pdos.write = self._take_object
        self.pdos.on_emergency = self.emergency.report
        self.pdos.on_late = lambda _number: self._react(self.reactions.rpdo_late, 0x8250)
        self.power_on()

    @classmethod
    def from_file(cls, path: Path, node: int = 1, **options: Any) -> Slave:
        """A slave with the objects of an EDS or DCF."""
        return cls(read(path, node), node, **options)

    def inject(self, name: str, value: Any = None) -> None:
        """Set a fault of the table; ``value`` stands in for the one of its row."""
        row = FAULTS[name]
        given = row.value if value is None else value
        if row.lasts:
            self.faults[name] = given
        if row.begin is not None:
            row.begin(self, given)

    def mend(self, name: str) -> None:
        """Take a fault back."""
        if self.faults.pop(name, None) is not None and (end := FAULTS[name].end) is not None:
            end(self)

    def mend_all(self) -> None:
        """Take every fault back."""
        for name in list(self.faults):
            self.mend(name)

    def begin_twin(self) -> None:
        """Let a second node with the same number, and another serial number, take part."""
        self.twin = Slave(self.objects.copy(), self.node, self.declared, boot_time=self.boot_time)
        self.twin.objects.set(0x1018, 4, self.objects.get(0x1018, 4) + 1)
        self.twin.network.enter(self.network.state)

    def power_on(self) -> None:
        """As after the supply has come back."""
        self.network.power_on(self.time)

    def fail(self, code: int) -> None:
        """A fault of the drive, with its EMCY."""
        self.power.fail(code)
        self.emergency.report(code)

    def receive(self, frame: Frame) -> list[Frame]:
        """Take a frame from the bus; returns what is sent at once."""
        kind, number = kind_from_host(frame, self.node, self.pdos.identifiers(0x1400))
        if not self._loses("unheard", kind, number):
            self._handle(kind, number, frame)
        if self.twin is not None:
            self._out += self.twin.receive(frame)
        return self._sent()

    def advance(self, dt: float) -> list[Frame]:
        """Let time pass; returns what is sent meanwhile."""
        end = self.time + dt
        while self.time < end - 1e-12:
            self._step(min(_STEP, end - self.time))
        if self.twin is not None:
            self._out += self.twin.advance(dt)
        return self._sent()

    def _sent(self) -> list[Frame]:
        out, self._out = self._out, []
        return out

    def _step(self, dt: float) -> None:
        self.time += dt
        self.motion.advance(dt)
        self.power.advance()
        watches = not any(FAULTS[name].unwatched for name in self.faults)
        self.network.advance(self.time, watches=watches)
        if self.network.state is Nmt.OPERATIONAL:
            if self.pdos.by_event():
                self._publish()
            self.pdos.advance(self.time, watches=watches)
            self._check_sync(watches=watches)
        if self.power.cleared:
            self.power.cleared = False
            self.emergency.clear()
        if self._delayed:
            waiting, self._delayed = self._delayed, []
            for item in waiting:
                if item[0] <= self.time:
                    self._send(item[1])
                else:
                    self._delayed.append(item)
        self.watch(self)

    def _handle(self, kind: str, number: int, frame: Frame) -> None:
        state = self.network.state
        if kind == "nmt":
            self.network.command(frame.data, self.time)
        elif kind == "guarding":
            self.network.guard(self.time)
        elif kind == "heartbeat":
            self.network.hear(frame.identifier & 0x7F, frame.data, self.time)
        elif kind == "sdo" and state in (Nmt.PRE_OPERATIONAL, Nmt.OPERATIONAL):
            self._serve(frame.data)
        elif state is Nmt.OPERATIONAL and kind == "rpdo":
            for _ in range(2 if "rpdo repeated" in self.faults else 1):
                self.pdos.receive(number, frame.data, self.time)
        elif state is Nmt.OPERATIONAL and kind == "sync":
            self._on_sync()

    def _serve(self, data: bytes) -> None:
        refused = self.faults.get("sdo refused")
        self._publish()
        reply = self.sdo.answer(data)
        if refused is not None and len(data) == 8:
            reply = b"\x80" + data[1:4] + int(refused).to_bytes(4, "little")
        if reply is None:
            return
        frame = Frame(0x580 + self.node, reply)
        delay = self.faults.get("sdo delayed")
        if delay is None:
            self._send(frame)
        else:
            self._delayed.append((self.time + float(delay), frame))

    def _on_sync(self) -> None:
        if self._synced is not None:
            self._sync_period = self.time - self._synced
        self._synced, self._awaits_sync = self.time, True
        self._publish()
        self.pdos.sync(self.time)
        cycle = self.objects.get(0x60C2, 1) * 10.0 ** self.objects.get(0x60C2, 2, -3)
        self.motion.sync(self._sync_period or cycle)

    def _check_sync(self, *, watches: bool) -> None:
        period = self.objects.get(0x1006) * 1e-6
        cyclic = self.power.state is State.ENABLED and self.motion.mode in CYCLIC
        if not (watches and period and cyclic):
            self._awaits_sync = False
        elif self._awaits_sync and self.time - (self._synced or 0.0) > _MISSED * period:
            self._awaits_sync = False
            self.emergency.report(_SYNC_LOST)
            self._react(self.reactions.sync_lost, _SYNC_LOST)

    def _upload(self, index: int, sub: int) -> bytes:
        return self.objects.upload(index, sub)

    def _download(self, index: int, sub: int, data: bytes) -> None:
        self.objects.check_download(index, sub, data)
        self.pdos.check_write(index, sub, data)
        self.network.check_write(index, sub, data)
        if index in (0x1010, 0x1011):
            if data != (b"save" if index == 0x1010 else b"load"):
                raise Abort(0x08000020)
            return
        self._take_object(index, sub, data)
        self.pdos.written(index, sub)
        self.network.written(index, sub, self.time)
        self.motion.rescale()

    def _take_object(self, index: int, sub: int, data: bytes) -> None:
        """A value came, by SDO or RPDO."""
        entry = self.objects.entries.get((index, sub))
        if entry is None:
            return
        entry.value = data
        if index == 0x6040:
            self._control(int.from_bytes(data[:2], "little"))
        elif index == 0x6060 and entry.number:
            self.motion.select(entry.number)

    def _control(self, word: int) -> None:
        if "control word unheeded" in self.faults:
            return
        if "quick stop ignored" in self.faults and not word & 0x04:
            return
        self.power.take(word)
        self.motion.command(word)

    def _publish(self) -> None:
        """Bring the objects up to date that the slave itself writes."""
        self.motion.publish()
        self.objects.set(0x603F, 0, self.power.error)
        if "status frozen" not in self.faults:
            remote = 0x200 if self.network.state is Nmt.OPERATIONAL else 0
            warning = 0x80 if self.emergency.standing and not self.power.error else 0
            self._status = self.power.status() | self.motion.status() | remote | warning
        lies = self.faults.get("status lies")
        shown = self._status if lies is None else self._status & ~0x6F | int(lies)
        self.objects.set(0x6041, 0, shown)

    def _on_state(self, old: Nmt, new: Nmt) -> None:
        if old is not Nmt.OPERATIONAL:
            return
        if new is not Nmt.PRE_OPERATIONAL:
            self.power.lose_connection(0x8130)
        self._react(self.reactions.leaves_operational, 0x8130)
        self._synced = None

    def _on_reset(self, first: int, last: int) -> None:
        """NMT reset, communication or all: 6007h acts, then values of power-on."""
        self.objects.restart(first, last)
        self.pdos.reset()
        self.sdo.reset()
        self.emergency.forget()
        if last > _COMMUNICATION:
            self.power.power_on()
            self.motion.restart()

    def _on_lost(self, code: int) -> None:
        self.emergency.report(code)
        self.power.lose_connection(code)

    def _react(self, reaction: str, code: int) -> None:
        if reaction == "fault":
            self.power.fail(code)
        elif reaction == "quick stop":
            self.power.quick_stop()
        elif reaction == "disable":
            self.power.drop()

    def _numbers(self, name: str) -> frozenset[int]:
        value = self.faults.get(name)
        return (
            frozenset(value) if isinstance(value, set | frozenset | tuple | list) else frozenset()
        )

    def _loses(self, which: str, kind: str, number: int) -> bool:
        if not self.faults:
            return False
        acting = (self._numbers(n) for n in self.faults if kind in getattr(FAULTS[n], which))
        return any(not numbers or number in numbers for numbers in acting)

    def _send(self, frame: Frame) -> None:
        kind, number = kind_from_slave(frame, self.node, self.pdos.identifiers(0x1800))
        if kind == "tpdo" and "tpdo stale" in self.faults:
            frame = self.stale.setdefault(frame.identifier, frame)
        if not self._loses("unsent", kind, number):
            self._out += [frame] * (2 if kind == "tpdo" and "tpdo repeated" in self.faults else 1)
