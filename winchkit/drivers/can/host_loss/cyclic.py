"""Mechanisms that watch the host's cyclic frames: the timeout of an RPDO, the loss of SYNC."""

from __future__ import annotations

from winchkit.drivers.can.canopen.pdo import PdoCodec
from winchkit.drivers.can.canopen.pdo_parameters import INVALID, cob_id
from winchkit.drivers.can.cia402.modes import MODES
from winchkit.drivers.can.host_loss.mechanism import LIFE_SIGNS, MS, Mechanism, Silence

RPDO_TIMEOUT = 0x8250
"""EMCY error code of CiA 301."""
_US = 1e-6
"""s: unit of 1006h."""
_CONTROL, _MODE = (0x6040, 0), (0x6060, 0)
_POSITIONS = ((0x607A, 0), (0x60C1, 1))


class RpdoTimeout(Mechanism):
    """Event timer of the RPDO that carries the control word (14xxh:05); EMCY 8250h."""

    name = "rpdo-timeout"
    silence = Silence.RPDO
    codes = frozenset({RPDO_TIMEOUT})

    def require(self) -> str:
        """The event timer of an RPDO that carries 6040h."""
        codec = self._codec
        if codec is None:
            return "no RPDO of the device file carries the control word 6040h"
        if self.node.read_if_there(self._record, 5) is None:
            return f"it has no {self._record:04X}h:5, the event timer of RPDO {codec.spec.number}"
        return ""

    def set_up(self) -> None:
        """Written while the PDO is invalid, as some drives ask for."""
        self._set(round(self.limit / MS))

    def withhold(self) -> float:
        """A few RPDOs with disable voltage, each before a SYNC, then none."""
        self._send_life_signs(self._send, self.terms.cycle)
        return self.limit

    def disarm(self) -> None:
        """No timeout any more."""
        self._set(0)

    def _set(self, milliseconds: int) -> None:
        record, identifier = self._record, self.node.read(self._record, 1)
        self.node.write(record, 1, identifier | INVALID)
        self.node.write_verified(record, 5, milliseconds)
        self.node.write(record, 1, identifier & ~INVALID)

    def _send(self) -> None:
        codec = self._codec
        assert codec is not None, "it was required"
        actual = self.node.read(0x6064)
        values = {_MODE: MODES[self._mode].number, **dict.fromkeys(_POSITIONS, actual)}
        data = codec.encode([values.get(key, 0) for key in codec.position])
        self.node.bus.send(cob_id("rpdo", codec.spec.number, self.node.node), data)
        self.node.bus.sync()

    @property
    def _codec(self) -> PdoCodec | None:
        return next((codec for codec in self._rpdo if _CONTROL in codec.position), None)

    @property
    def _record(self) -> int:
        codec = self._codec
        return 0x1400 + (1 if codec is None else codec.spec.number) - 1


class SyncLoss(Mechanism):
    """Loss of SYNC in a cyclic mode: 1006h, the communication cycle period."""

    name = "sync-loss"
    silence = Silence.SYNC
    noticed_disabled = False
    codes = frozenset()

    def require(self) -> str:
        """1006h and a cyclic mode."""
        if not MODES[self._mode].cyclic:
            return f"{self._mode} is no cyclic mode: a loss of SYNC is not noticed in it"
        there = self.node.read_if_there(0x1006) is not None
        return "" if there else "it has no 1006h, the communication cycle period"

    def set_up(self) -> None:
        """The period, µs."""
        self.node.write_verified(0x1006, 0, round(self.terms.cycle / _US))

    def withhold(self) -> float:
        """SYNC at its period for a while, then none; a running control loop is held back."""
        self.node.bus.sync_held = True
        count = max(LIFE_SIGNS, round(self.limit / self.terms.cycle))
        self._send_life_signs(lambda: self.node.bus.send(0x080, b""), self.terms.cycle, count)
        return self.limit

    def release(self) -> None:
        """The control loop's SYNC is sent again."""
        self.node.bus.sync_held = False

    def restore(self) -> None:
        """As set up."""
        self.set_up()

    def disarm(self) -> None:
        """No period: no loss is noticed."""
        self.node.write(0x1006, 0, 0)
