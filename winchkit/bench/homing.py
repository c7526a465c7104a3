"""Homing: a drive finds its zero by itself, or is told which cable length is the present one."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from winchkit.bench.control.cable import RopeMap
from winchkit.bench.control.motion import Target
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.lifecycle import await_cycles
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.modes import Homing
from winchkit.drivers.can.cia402.profile_parameters import HERE, HomingSpec, check_homing
from winchkit.errors import DeviceRefused, DriveFault, NotPermitted, UsageError

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.bench.winch import Winch

__all__ = ["HomingMotion", "HomingRequest", "homing"]

_SHARE = 0.1
"""Of the winch's speed limit, at which it searches unless told otherwise."""
_SLOWER = 0.2
"""Of the search's speed, at which it approaches the zero."""
_SETTLE = 0.06
"""For which bits of an earlier homing may still stand, s."""
_JUMP = 1.0
"""A change of the motor angle in one cycle that is no motion but a new zero, rad."""
_SHOWN = 3
"""Cycles until a change of mode is seen in feedback and judged."""
_SAME = 2e-3
"""Of rope, within which a length counts as defined, m."""


@dataclass(frozen=True)
class HomingRequest:
    """What is asked for."""

    method: int | None = None
    """6098h; None searches nothing."""
    at: float | None = None
    """Cable length (m) at the zero that is found, or at the present place where none is sought."""
    speed: float | None = None
    """Of the rope while searching, m/s."""


class HomingAxis(Protocol):
    """What tells how far a homing is; ``Cia402Axis`` is one."""

    @property
    def homing(self) -> Homing:
        """By the drive's newest status word."""


class HomingMotion:
    """A motion that the drive makes itself; says how fast the rope goes, for supervision."""

    holds = False
    joins = False

    def __init__(self, axis: HomingAxis, rope: RopeMap, farthest: float = math.inf) -> None:
        """Give up once ``farthest`` (m) of rope have run in the search."""
        self.failure = ""
        """Why it found nothing, in words."""
        self._axis, self._rope, self._left = axis, rope, farthest
        self._begun = self._time = self._angle = math.nan

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin; the drive is enabled in the mode HM."""
        self._begun = self._time = time
        self._angle = angle

    def target(self, time: float, angle: float, _now: float) -> Target:
        """Keep bit 4 set until the drive says that it is over."""
        step, change = time - self._time, angle - self._angle
        self._time, self._angle = time, angle
        moves = step > 0 and abs(change) < _JUMP
        speed = change / step * self._rope.at(angle)[1] if moves else 0.0
        self._left -= abs(speed) * step
        state = self._axis.homing
        over = time - self._begun >= _SETTLE and state.over
        if over and state is not Homing.DONE:
            self.failure = "the drive says that it failed"
        elif not over and self._left < 0:
            self.failure = "no zero was found on twice the way between limits.length"
        return Target(0.0, None, speed, done=over or bool(self.failure), start=True)


def homing(bench: Bench, winch: Winch, asked: HomingRequest) -> Generator[None]:
    """Home a winch, yielding while there is something to wait for; closing it early stops it.

    Raises UsageError, NotPermitted, DeviceRefused for a method that the drive lacks, DriveFault
    where the homing fails, LimitTripped.
    """
    axis = bench.axes[winch.name]
    _check(winch, asked)
    _check_drive(axis, asked)
    bench.permit(winch.name, Direction.BOTH)
    try:
        zero = 0.0
        if asked.method is not None:
            yield from _run(bench, winch, asked.method, asked.speed, 0.0)
            zero = winch.snapshot.motor_angle
        if asked.at is not None:
            yield from _define(bench, winch, winch.motor_angle_at(asked.at) + zero)
    finally:
        if winch.moving:
            winch.stop()
        if axis.mode != axis.servo.motion_mode:
            bench.wait_at_rest((winch.name,))
            axis.switch_mode(axis.servo.motion_mode)
            # Until its PDOs show the mode again, any motion is refused.
            await_cycles(bench.loop, bench.clock, _SHOWN)


def _check(winch: Winch, asked: HomingRequest) -> None:
    if asked.method is None and asked.at is None:
        raise UsageError("a homing needs a method, or the cable length of the present place")
    limit = winch.wiring.limits.speed
    if asked.speed is not None and not 0 < asked.speed <= limit:
        raise NotPermitted(
            f"winch {winch.name}: a search at {asked.speed:g} m/s is not within its limit of "
            f"{limit:g} m/s"
        )
    if asked.at is not None and not math.isfinite(asked.at):
        raise UsageError("a cable length must be a finite number of metres")


def _check_drive(axis: Cia402Axis, asked: HomingRequest) -> None:
    """Refuse before anything moves what the drive lacks, named."""
    method = HERE[0] if asked.method is None else asked.method
    spec = HomingSpec(method, 1.0, 1.0, 1.0)
    check_homing(axis.objects, axis.servo, spec, defines=asked.at is not None)


def _define(bench: Bench, winch: Winch, angle: float) -> Generator[None]:
    """Let the present place have a motor angle (rad).

    Drives differ in the sign of the home offset (607Ch): by the standard's text the zero lies
    that far from home, by many a drive's manual home gets that position. What came of it decides.
    """
    wanted = winch.length_at(angle)
    for offset in (angle, -angle):
        yield from _run(bench, winch, None, None, offset)
        if abs(winch.cable_length - wanted) <= _SAME:
            return
    raise DriveFault(
        f"winch {winch.name}: after homing here the drive shows a cable length of "
        f"{winch.cable_length:.3f} m and not {wanted:.3f} m; it may not add its home offset "
        "(607Ch); set reference.motor_angle in the winch's profile instead"
    )


def _run(
    bench: Bench, winch: Winch, method: int | None, speed: float | None, offset: float
) -> Generator[None]:
    """One homing of the drive, by a method or at the present place, up to the disabled drive."""
    axis, limits = bench.axes[winch.name], winch.wiring.limits
    arm = abs(winch.rope.at(winch.snapshot.motor_angle)[1])
    fast = (speed or _SHARE * limits.speed) / arm
    ramp = limits.acceleration / arm
    _prepare(
        axis,
        [
            HomingSpec(number, fast, _SLOWER * fast, ramp, offset)
            for number in (HERE if method is None else (method,))
        ],
    )
    span = math.inf if limits.length is None else limits.length[1] - limits.length[0]
    motion = HomingMotion(axis, winch.rope, 2 * span)
    winch.begin(motion)
    while winch.moving:
        winch.raise_trouble()
        yield
    winch.raise_end()
    bench.wait_at_rest((winch.name,))
    if motion.failure:
        raise DriveFault(f"winch {winch.name}: homing failed: {motion.failure} ({axis.fault_text})")


def _prepare(axis: Cia402Axis, specs: list[HomingSpec]) -> None:
    """Prepare the first of these homings that the drive takes."""
    *others, last = specs
    for spec in others:
        try:
            axis.prepare_homing(spec)
        except DeviceRefused:
            continue
        return
    axis.prepare_homing(last)
