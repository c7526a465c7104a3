"""Emergency messages and error codes (603Fh) in words."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass

_TEXT: dict[int, str] = {
    0x0000: "no error",
    0x1000: "generic error",
    0x2310: "continuous over-current",
    0x2320: "short circuit",
    0x2330: "earth leakage",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "drive over-temperature",
    0x4310: "motor over-temperature",
    0x5113: "24 V supply low",
    0x5441: "safe torque off",
    0x5530: "non-volatile memory",
    0x6010: "software watchdog",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7122: "motor or commutation error",
    0x7300: "sensor error",
    0x7305: "encoder 1 error",
    0x7310: "speed error",
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "heartbeat or life guard error: the drive lost the host",
    0x8140: "recovered from bus off",
    0x8210: "PDO not processed: wrong length",
    0x8220: "PDO length exceeded",
    0x8240: "unexpected SYNC data length",
    0x8250: "RPDO timeout: the drive lost the host",
    0x8311: "excess torque",
    0x8400: "velocity loop error",
    0x8500: "position loop error",
    0x8611: "following error",
    0x8612: "reference limit",
    0xF001: "deceleration error",
}
_FAMILY: dict[int, str] = {
    0x10: "generic error",
    0x20: "current",
    0x30: "voltage",
    0x40: "temperature",
    0x50: "drive hardware",
    0x60: "drive software",
    0x70: "additional module",
    0x80: "monitoring",
    0x90: "external error",
    0xF0: "additional function",
    0xFF: "device specific",
}


_KEPT = 64
"""Messages: more than any bring-up gives, and a storm of EMCY has a bounded memory."""


@dataclass(frozen=True)
class Emergency:
    """One EMCY message."""

    code: int
    register: int
    vendor: bytes
    time: float

    def __str__(self) -> str:
        return f"EMCY {self.code:04X}h {error_text(self.code)} (register {self.register:02X}h)"


def error_text(code: int) -> str:
    """Meaning of a CiA 301/402 error code; its family when the code itself is not known."""
    known = _TEXT.get(code)
    if known:
        return known
    family = _FAMILY.get(code >> 8) or _FAMILY.get((code >> 8) & 0xF0)
    return f"{family} (see the drive's manual)" if family else "see the drive's manual"


def parse_emergency(data: bytes, now: float) -> Emergency | None:
    """Read a frame of 80h + node; None when it is too short to be one."""
    if len(data) < 3:
        return None
    code, register = struct.unpack_from("<HB", data)
    return Emergency(code, register, bytes(data[3:8]), now)


class EmergencyLog(deque[Emergency]):
    """The newest messages of one drive; ``receive`` takes its frames."""

    def __init__(self) -> None:
        super().__init__(maxlen=_KEPT)
        self.in_force: dict[int, Emergency] = {}
        """By code, what the drive has not taken back by 0000h."""
        self.short = 0
        """Frames too short to be a message."""

    def receive(self, data: bytes, now: float) -> None:
        """Take a frame of 80h + node."""
        found = parse_emergency(data, now)
        if found is None:
            self.short += 1
            return
        self.append(found)
        if found.code == 0:
            self.in_force.clear()
        else:
            self.in_force[found.code] = found

    @property
    def standing(self) -> str:
        """Messages in force in words; over-temperature (4210h) may come without a fault."""
        return "; ".join(str(item) for item in tuple(self.in_force.values()))
