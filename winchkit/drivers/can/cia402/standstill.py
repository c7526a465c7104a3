"""Whether a motor stands still: by the resolution of 606Ch, confirmed by 6064h.

The reported speed alone does not show it. A drive that reports whole revolutions a minute shows
±1 rpm (0.105 rad/s) of noise at rest, one of fine resolution shows many counts. So the speed has to
be within its resolution, and the position has to stay where it is for a while.
"""

from __future__ import annotations

from math import inf, isfinite, nan

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.units import CountScale, read_scale
from winchkit.drivers.clock import Clock
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import ServoSpec

_WINDOW = 0.04
"""For which the position has to stay where it is, s."""
_CREEP = 0.05
"""Speed of the motor that the position would betray within the window, rad/s."""
_SPEED_COUNTS, _ANGLE_COUNTS = 1.5, 2.0
"""Noise of 606Ch and 6064h at standstill: one count up or down, and rounding."""


class Standstill:
    """Judges one motor by successive feedback; SI at the motor shaft.

    A motor whose first feedback shows no speed stands still at once; one that has moved stands
    still after its position has stayed within ``travel`` for the window.
    """

    def __init__(self, scale: CountScale) -> None:
        self.speed = max(_CREEP, _SPEED_COUNTS * scale.velocity)
        """Reported speed that counts as none, rad/s."""
        self.travel = max(_CREEP * _WINDOW, _ANGLE_COUNTS * scale.angle)
        """Change of the position that counts as none, rad."""
        self._angle, self._since, self._time = nan, -inf, -inf
        self._still = False

    def take(self, time: float, angle: float, velocity: float) -> bool:
        """Take a feedback (s, rad, rad/s); whether the motor stands still. Old ones repeat."""
        if time <= self._time:
            return self._still
        self._time = time
        speed = abs(velocity)
        if speed > self.speed:
            self._angle, self._since, self._still = angle, time, False
            return False
        if not isfinite(self._angle):
            self._angle = angle
        if abs(angle - self._angle) > self.travel:
            self._angle, self._since = angle, time
        self._still = speed <= self.speed and time - self._since >= _WINDOW
        return self._still


class PolledStandstill:
    """Judges a drive that is read by SDO, before its PDOs run or while it has no owner."""

    def __init__(self, node: SdoNode, servo: ServoSpec, clock: Clock) -> None:
        """Read the drive's units; raises NoReply, DeviceRefused."""
        try:
            scale = read_scale(node, servo)
        except NotPermitted:
            # Units that cannot be meant say nothing of standing still: whole counts decide.
            scale = CountScale(nan, nan, nan)
        self._node, self._clock, self._scale = node, clock, scale
        self._standstill = Standstill(scale)

    def poll(self) -> bool:
        """Ask once; to be repeated until the motor stands still. Raises NoReply, DeviceRefused."""
        speed, position = (self._node.read_if_there(index) or 0 for index in (0x606C, 0x6064))
        if not isfinite(self._scale.angle):
            return speed == 0
        return self._standstill.take(
            self._clock.now(), position * self._scale.angle, speed * self._scale.velocity
        )
