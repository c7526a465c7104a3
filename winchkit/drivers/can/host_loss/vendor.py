"""A maker's own watchdog of the communication, as a device file declares it."""

from __future__ import annotations

from winchkit.drivers.can.canopen.nmt import NmtState
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.drivers.can.host_loss.cyclic import RpdoTimeout
from winchkit.drivers.can.host_loss.mechanism import LIFE_SIGNS, Mechanism, Silence
from winchkit.schema.host_loss import VENDOR, VendorObject, VendorWatchdog


class VendorWatch(RpdoTimeout):
    """Writes the declared objects and ends the host's frames that the watchdog listens to."""

    noticed_disabled = False
    declared: VendorWatchdog

    def declare(self, name: str, declared: VendorWatchdog) -> Mechanism:
        """Take the declaration of the device file; returns itself."""
        self.name = f"{VENDOR}{name}"
        self.declared = declared
        self.silence = Silence(declared.silence)
        self.codes = frozenset() if declared.emergency is None else frozenset({declared.emergency})
        return self

    def require(self) -> str:
        """Every declared object."""
        for item in self.declared.object:
            if self.node.read_if_there(*parse_object(item.object)) is None:
                return f"it has no {item.object}, which its watchdog needs"
        return ""

    def set_up(self) -> None:
        """Write the declared values and read them back."""
        for item in self.declared.object:
            self.node.write_verified(*parse_object(item.object), self._value(item))

    def withhold(self) -> float:
        """Life signs of the declared kind, then none."""
        bus, silence = self.node.bus, self.silence
        bus.sync_held = silence in (Silence.SYNC, Silence.ALL)
        bus.heartbeat_held = silence in (Silence.HEARTBEAT, Silence.ALL)
        cycle = self.terms.cycle
        self._send_life_signs(self._life_sign, cycle, max(LIFE_SIGNS, round(self.limit / cycle)))
        return self.limit

    def release(self) -> None:
        """Everything is sent again."""
        self.node.bus.sync_held = self.node.bus.heartbeat_held = False

    def restore(self) -> None:
        """As set up."""
        self.set_up()

    def disarm(self) -> None:
        """Write what the device file declares for the end, where it does."""
        for item in self.declared.object:
            if item.off is not None:
                self.node.write(*parse_object(item.object), item.off)

    def _life_sign(self) -> None:
        bus, silence = self.node.bus, self.silence
        if silence in (Silence.RPDO, Silence.ALL) and self._codec is not None:
            self._send()
        if silence in (Silence.HEARTBEAT, Silence.ALL):
            bus.send(0x700 + self.terms.host, bytes((NmtState.OPERATIONAL,)))
        if silence in (Silence.SYNC, Silence.ALL):
            bus.send(0x080, b"")

    def _value(self, item: VendorObject) -> int:
        if item.time_unit is not None:
            return round(self.limit / item.time_unit)
        assert item.value is not None, "the reader has checked it"
        return item.value
