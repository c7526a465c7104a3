"""Position of a motor over many turns of its counter, and its standstill."""

from __future__ import annotations

import math

from winchkit.drivers.can.cia402.commission import Commissioned
from winchkit.drivers.can.cia402.feedback import AxisFeedback, counter_range
from winchkit.drivers.can.cia402.position_agreement import PositionAgreement
from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.standstill import Standstill
from winchkit.schema.devices.servo import ServoSpec

__all__ = ["MotorPosition"]


class MotorPosition:
    """One axis's; it outlives every commissioning, so that crossings of the counter's end count."""

    def __init__(
        self,
        servo: ServoSpec,
        fastest: float = 0.0,
        *,
        response: float = 0.0,
        late: float = 0.0,
    ) -> None:
        """Take the greatest speed of the motor, rad/s; 0 where it is not known.

        ``response`` (s) is the longest lag of its speed, ``late`` what it turns within that, rad.
        """
        self._wraps, self._fastest = servo.position_wraps, fastest
        self._response, self._late = response, late
        self.agreement = PositionAgreement()
        """Of its 6064h with 606Ch."""
        self.counter: PositionCounter | None = None
        """Of its 6064h; None before it is commissioned."""
        self._standstill: Standstill | None = None
        self._boot_ups = 0
        self._angle = math.nan
        self._lost = False

    @property
    def absolute(self) -> bool:
        """Whether the drive's count alone is the position, for a later process too."""
        return not self._lost if self.counter is None else self.counter.absolute

    @property
    def jump(self) -> str:
        """Change of 6064h that no motion explains, in words; empty without one."""
        counter = self.counter
        if counter is None or not counter.jump:
            return ""
        turns = counter.jump * self._angle / math.tau
        return f"6064h changed by {turns:.2f} turns of the motor from one answer to the next"

    @property
    def disagreement(self) -> str:
        """Change of 6064h that 606Ch contradicts, in words; empty without one."""
        found = self.agreement.found
        return "" if found is None else str(found)

    def forget_jump(self) -> None:
        """A reset has shown it; the position stays unknown."""
        self.agreement.forget()
        if self.counter is not None:
            self.counter.jump = 0.0

    def lose(self) -> None:
        """An earlier process has lost count of the ranges, or has counted some."""
        self._lost = True

    def begin(self, drive: Commissioned, boot_ups: int) -> PositionCounter:
        """The counter of a drive that has been set up; a boot-up has reset it."""
        counter = self.counter
        if counter is None:
            low, high = self._wraps or counter_range(drive.tpdo)
            counter = PositionCounter(low, high, self._fastest / drive.scale.angle)
            counter.known = not self._lost
        self._angle = drive.scale.angle
        counter.restart(forgotten=boot_ups != self._boot_ups)
        self.counter, self._boot_ups = counter, boot_ups
        self._standstill = Standstill(drive.scale)
        self.agreement = PositionAgreement(
            drive.scale.angle,
            drive.scale.velocity,
            self._response,
            self._late,
            self._fastest,
        )
        return counter

    def at_rest(self, seen: AxisFeedback | None) -> bool:
        """Whether the newest feedback says that the motor stands still."""
        if seen is None or self._standstill is None:
            return False
        return self._standstill.take(seen.time, seen.angle, seen.velocity)

    def changed_mode(self, before: str, mode: str, *, homed: bool) -> None:
        """While it homes, the drive's count jumps to the new zero: it is taken as it is."""
        if self.counter is None or before == mode:
            return
        if mode == "HM":
            self.counter.suspend()
            self.agreement.suspend()
        elif before == "HM":
            self.counter.resume(homed=homed)
            self.agreement.resume()
