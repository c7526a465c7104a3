"""Small motions of a commissioning, and what the instruments said of them."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, replace

from winchkit.bench.bench import Bench
from winchkit.bench.control.motion import PlannedMove
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.direction import directed
from winchkit.errors import NotPermitted

_STEP = 0.02
"""m, at most a motor turn: visible to the operator, ten times the resolution of a length sensor."""
_TURN = 2 * math.pi
_AGREES = 0.1
"""Share: a wrong gear ratio, unit or direction is off by more (rule of thumb; layers of cable
change the arm by some per cent)."""
_RESOLUTION = 2e-3
"""Of a length sensor beside its own error in proportion, m."""
_SHOWN = 5e-5
"""m: below it a length in mm reads 0.0, and has no direction."""
_LOOK = 0.5
"""s: the load has ceased to bounce, and a cell of 10 Hz gives five readings."""
_PAUSE = 0.02
"""s: 25 readings within `_LOOK`, at most one of each conversion of a cell of 50 Hz."""
_SIGMAS = 5.0
"""Standard deviations: a change beyond them is no noise (6e-7 two-sided)."""


@dataclass(frozen=True)
class Moved:
    """Result of a motion; positive pays out."""

    cable: float
    """By the motor's position and the profile, m."""
    turns: float
    """Of the motor."""
    sensor: float
    """By the length sensor, m; NaN where there is none."""


class Motions:
    """Moves one winch by small lengths at a slow speed."""

    def __init__(self, bench: Bench, name: str, speed: float) -> None:
        self._bench, self._name, self._speed = bench, name, speed
        self._winch = bench.winch[name]
        arm = abs(self._winch.cable.arm(bench.snapshot.winch[name].motor_angle))
        self.turn = _TURN * arm
        """Cable of one motor turn, m."""
        self.step = min(_STEP, self.turn)
        self.cell_noise = 0.0
        """Five standard deviations of the last tension, N."""

    def has_room(self, change: float) -> bool:
        """Whether the length limits allow this change (m, positive pays out)."""
        limits = self._winch.wiring.limits.length
        if limits is None:
            return True
        here = self._bench.snapshot.winch[self._name]
        # Before the first homing only the operator can say.
        return not here.length_known or limits[0] <= here.cable_length + change <= limits[1]

    def go(self, change: float) -> Moved:
        """Pay out, or with a negative length wind in; returns at rest and disabled."""
        before = self._bench.snapshot.winch[self._name]
        if before.length_known:
            self._winch.move_by(**directed(change), speed=self._speed)
        else:
            self._move_unhomed(before.motor_angle, change)
        self._bench.clock.sleep(_LOOK)
        after = self._bench.snapshot.winch[self._name]
        cable = self._winch.cable
        moved = Moved(
            cable.cable_length(after.motor_angle) - cable.cable_length(before.motor_angle),
            (after.motor_angle - before.motor_angle) / _TURN,
            after.length - before.length,
        )
        if abs(moved.cable - change) > _RESOLUTION + _AGREES * abs(change):
            raise NotPermitted(
                f"winch {self._name}: it should have {by_way(change)}, and by the motor it "
                f"{by_way(moved.cable)}; check the drive's counts per turn, the gear ratio, and "
                "whether something holds the motor"
            )
        return moved

    def _move_unhomed(self, angle: float, change: float) -> None:
        """Move by a length while no cable length is known, as slowly as a jog then may."""
        winch = self._winch
        limits = winch.wiring.limits
        speed = min(self._speed, limits.speed_unhomed) or self._speed
        target = winch.cable.cable_length(angle) + change
        move = PlannedMove(winch.cable, replace(limits, length=None), target, speed=speed)
        winch.permit(Direction.PAY_OUT if change > 0 else Direction.WIND_IN)
        move.prepare(angle)
        winch.begin(move)
        winch.wait()

    def check_sensor(self, moved: Moved) -> None:
        """Raise NotPermitted where the length sensor and the profile disagree."""
        if abs(moved.sensor - moved.cable) > _RESOLUTION + _AGREES * abs(moved.cable):
            raise NotPermitted(
                f"winch {self._name}: by the motor and the profile it {by_way(moved.cable)}, by "
                f"the length sensor it {by_way(moved.sensor)}; check increments_per_turn, gear "
                "ratio, drum radius and reeving"
            )

    def tension(self) -> float:
        """Mean of the cell over half a second, N; raises NotPermitted where it reads nothing."""
        clock = self._bench.clock
        end, values = clock.now() + _LOOK, []
        while clock.now() < end:
            values.append(self._bench.snapshot.winch[self._name].tension)
            clock.sleep(_PAUSE)
        good = [value for value in values if math.isfinite(value)]
        if len(good) < len(values) / 2:
            raise NotPermitted(
                f"winch {self._name}: the cell gives no reading; see `winchkit cell info`"
            )
        self.cell_noise = max(1e-3, _SIGMAS * statistics.pstdev(good))
        return statistics.fmean(good)


def by_way(length: float) -> str:
    """What a winch did with a length of cable (m, positive pays out), in words."""
    verb = "wound in" if length < 0 else "paid out"
    return f"{verb if abs(length) >= _SHOWN else 'moved'} {millimetres(abs(length))}"


def millimetres(length: float) -> str:
    """A length in mm."""
    return f"{length * 1e3:.1f} mm"
