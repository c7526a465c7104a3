"""A simulated CANopen instrument: a process value with its status, by TPDO and by SDO."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from math import isfinite
from pathlib import Path

from winchkit.schema.devices.modbus import StatusMeaning
from winchkit.schema.devices.process import ProcessSpec
from winchkit.sim.drive.nmt import NMT_COMMANDS, Heartbeats, NodeState
from winchkit.sim.drive.object_dictionary import Abort, Entry, Key, ObjectDictionary, read_eds
from winchkit.sim.drive.pdo import Pdos
from winchkit.sim.drive.sdo import SdoServer
from winchkit.sim.instruments.instrument import SimulatedInstrument, status_word

_RESET = (0x81, 0x82)
_SYNC = 0x1005
"""CiA 301: COB-ID SYNC."""
_NO_NUMBER = 0x7FC00000
"""A quiet NaN as REAL32."""


class SimulatedProcessInstrument(SimulatedInstrument):
    """One node. ``measure`` returns the present quantity in the unit of the device file."""

    KIND = "a simulated CANopen instrument"
    FAULTS = ("silence", "frozen", "overload", "sensor break", "reboot", "recover")

    def __init__(
        self,
        spec: ProcessSpec,
        eds: Path,
        node: int,
        measure: Callable[[], float],
        send: Callable[[int, bytes], None],
        *,
        now: float,
    ) -> None:
        super().__init__(measure, spec.rate, spec.filter_delay, now=now)
        self.spec, self.node = spec, node
        self._bus = send
        self._value, self._status = _key(spec.value), _key(spec.status) if spec.status else None
        self.objects = ObjectDictionary(_numeric(read_eds(eds, node)))
        self._commands = {_key(item.object)[0] for item in spec.command.values()}
        for index in self._commands:
            self.objects.guards[index] = self._check_command
            self.objects.watchers[index] = self._command
        self._sdo = SdoServer(self.objects)
        self._pdos = Pdos(self.objects, self._send, lambda: None, lambda: None)
        self._heartbeats = Heartbeats(
            self.objects, self._send_heartbeat, lambda _node: None, lambda: None
        )
        self.nmt = NodeState.BOOTING
        self._write()

    # Time.

    def _showing(self) -> None:
        self._write()

    def _write(self) -> None:
        """Write value and status to the objects."""
        self.objects.put(*self._value, self._raw((self.gross - self._tare) / self.spec.scale))
        if self._status is not None:
            self.objects.put(*self._status, self._status_bits())

    # Network.

    def tick(self, now: float) -> None:
        """Evaluate the network's timers."""
        self.show(now)
        if self.nmt is NodeState.BOOTING:
            self._send(0x700 + self.node, b"\0")
            self.nmt = NodeState.PRE_OPERATIONAL
            self._heartbeats.start(now)
        self._heartbeats.produce(now)
        if self.nmt is NodeState.OPERATIONAL:
            self._pdos.poll(now)

    def receive(self, identifier: int, data: bytes, now: float) -> None:
        """Take a frame from the bus."""
        if "silence" in self.faults or self.nmt is NodeState.BOOTING:
            return
        if identifier == 0x000 and len(data) == 2 and data[1] in (0, self.node):
            self._manage(data[0])
        elif identifier == 0x600 + self.node and self.nmt is not NodeState.STOPPED:
            self.show(now)
            reply = self._sdo.answer(data)
            if reply is not None:
                self._send(0x580 + self.node, reply)
        elif identifier == self.objects.number(_SYNC) & 0x7FF and self.nmt is NodeState.OPERATIONAL:
            self.show(now)
            self._pdos.on_sync(now)

    def inject(self, kind: str) -> None:
        """Inject a fault; raises UsageError for an unknown kind."""
        if kind == "reboot":
            self._reboot()
        else:
            super().inject(kind)

    def _manage(self, command: int) -> None:
        if command in _RESET:
            self._reboot()
        else:
            self.nmt = NMT_COMMANDS.get(command, self.nmt)

    def _reboot(self) -> None:
        self._zero, self._tare, self._net = 0.0, 0.0, False
        self.objects.reset()
        self._sdo.reset()
        self._pdos.rebuild()
        self._write()
        self.nmt = NodeState.BOOTING

    def _send(self, identifier: int, data: bytes) -> None:
        if "silence" not in self.faults:
            self._bus(identifier, data)

    def _send_heartbeat(self) -> None:
        self._send(0x700 + self.node, bytes((self.nmt,)))

    # Commands and values.

    def _check_command(self, _sub: int, value: int) -> Abort | None:
        known = {item.value for item in self.spec.command.values()}
        return None if value in known else Abort.RANGE

    def _command(self, _sub: int, value: int) -> None:
        name = next(key for key, item in self.spec.command.items() if item.value == value)
        self.stored += self.spec.command[name].permanent
        self._obey(name)
        self._write()

    def _raw(self, counts: float) -> int:
        if self.spec.type != "f32":
            return round(counts) if isfinite(counts) else 0
        if not isfinite(counts):
            return _NO_NUMBER
        return int.from_bytes(struct.pack("<f", counts), "little")

    def _status_bits(self) -> int:
        says: dict[StatusMeaning, bool] = {
            "fault": self._shown.broken,
            "overload": self._shown.overload,
            "valid": not self._shown.broken,
            "stable": True,
            "net": self._net,
        }
        return status_word(self.spec.bits, says)


def _key(text: str) -> Key:
    index, _, sub = text.partition(":")
    return int(index, 16), int(sub or "0", 0)


def _numeric(entries: dict[Key, Entry]) -> dict[Key, Entry]:
    """Entries with REAL32 values kept as their 32 bits."""
    return {
        key: replace(entry, format="I", default=0) if not entry.format and entry.mappable else entry
        for key, entry in entries.items()
    }
