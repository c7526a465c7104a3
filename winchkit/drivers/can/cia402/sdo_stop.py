"""Quick stop by SDO, from the control loop: frames sent as they are, replies taken as they come.

The confirmed client of :mod:`winchkit.drivers.can.canopen.node` waits for each reply, which a
control loop cannot; and its transfer with the same node, if one is under way, must not delay a
stop. Expedited transfers of CiA 301: download 2Bh, reply 60h; upload 40h, reply 4xh; abort 80h.
"""

from __future__ import annotations

from winchkit.drivers.can.bus.bus import SDO_SIZE, CanBus
from winchkit.drivers.can.cia402.state_machine import DriveState, state_of

_REQUEST, _REPLY = 0x600, 0x580
_WRITE = bytes.fromhex("2B40600002000000")
_WROTE = bytes.fromhex("604060")
_ASK = bytes.fromhex("4041600000000000")
_TOLD = bytes.fromhex("416000")
_REFUSED = bytes.fromhex("80406000")


class SdoStop:
    """Quick stop of one drive by SDO (6040h), and its state read back (6041h)."""

    def __init__(self, bus: CanBus, node: int) -> None:
        """Nothing is sent yet."""
        self._bus, self._node = bus, node
        self._asked = self._held = False
        self.active = False
        """Whether it has sent something since it was last ended."""
        self.taken = False
        """Whether the drive has confirmed the write."""
        self.refused = False
        """Whether it has aborted it."""
        self.state: DriveState | None = None
        """Power state by a status word that was asked for after that."""

    def send(self) -> None:
        """Write 6040h = 02h, or ask for 6041h once that is confirmed; raises ConnectionLost."""
        if self._held:
            return
        if not self.active:
            self.active, self.taken, self.refused, self.state = True, False, False, None
            self._bus.on(_REPLY + self._node, self._receive)
        self._asked = self.taken
        self._bus.send(_REQUEST + self._node, _ASK if self._asked else _WRITE)

    def end(self) -> None:
        """Leave the node's replies to the confirmed client again."""
        if self.active:
            self.active = self.refused = False
            self.state = None
            self._bus.off(_REPLY + self._node)

    def hold(self, held: bool) -> None:
        """Send nothing while the drive is being commissioned, which stops it by itself."""
        self._held = held
        if held:
            self.end()

    def _receive(self, data: bytes, now: float) -> None:
        if data[:3] == _WROTE and not self.taken:
            self.taken = True
        elif data[:4] == _REFUSED and not self.taken:
            self.refused = True
        elif (
            self._asked and len(data) == SDO_SIZE and data[0] & 0xE2 == 0x42 and data[1:4] == _TOLD
        ):
            self._asked = False
            self.state = state_of(int.from_bytes(data[4:6], "little"))
        else:
            self._bus.pass_on(_REPLY + self._node, data, now)
