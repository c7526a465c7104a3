"""Homing: a drive finds its zero by itself, or gets the present cable length."""

from __future__ import annotations

import math
from collections.abc import Generator
from contextlib import suppress

from winchkit.bench.control.homing_motion import HomingMotion, HomingRequest
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.host import WinchHost
from winchkit.bench.lifecycle import await_cycles
from winchkit.bench.winch import Winch
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.profile_parameters import HERE, HomingSpec, check_homing
from winchkit.errors import (
    DeviceRefused,
    DriveFault,
    MotionError,
    NoReply,
    NotPermitted,
    UsageError,
)

_SHARE = 0.1
"""Of the winch's speed limit, at which it searches by default."""
_SLOWER = 0.2
"""Of the search's speed, at which it approaches the zero."""
_SHOWN = 3
"""Cycles until a change of mode is seen in feedback and judged."""
_SAME = 2e-3
"""Of cable, within which a length counts as defined, m."""
_UNFINISHED = "a homing has set another zero, and ended before the length by it was known"


def homing(bench: WinchHost, winch: Winch, asked: HomingRequest) -> Generator[None]:
    """Home a winch, yielding while there is something to wait for; closing it early stops it.

    Raises UsageError, NotPermitted, DeviceRefused for a method that the drive lacks, DriveFault
    where the homing fails, LimitTripped.
    """
    axis = bench.axes[winch.name]
    _check(winch, asked)
    if asked.method is not None:
        check_homing(axis.objects, axis.servo, HomingSpec(asked.method, 1.0, 1.0, 1.0))
    if asked.method is None:
        winch.permit_at_rest()
    else:
        winch.permit(Direction.BOTH)
    try:
        zero = 0.0
        if asked.method is not None:
            yield from _run(bench, winch, asked.method, asked.speed, 0.0)
            zero = winch.snapshot.motor_angle
        if asked.at is not None:
            yield from _define(bench, winch, winch.motor_angle_at(asked.at) + zero)
        axis.position.note_zero()
    except (MotionError, NoReply, DeviceRefused):
        winch.raise_trouble()  # the cause, where something has tripped
        raise
    finally:
        if winch.moving:
            winch.stop()
        # The reset sets up a drive that restarted or fell silent, its mode included.
        if axis.mode != axis.servo.motion_mode and not axis.lost_set_up:
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
    least, greatest = winch.capacity
    if asked.at is not None and not least <= asked.at <= greatest:
        raise NotPermitted(
            f"winch {winch.name}: its drum cannot have paid out {asked.at:g} m: by the profile "
            f"{max(0.0, least):g} to {greatest:.3f} m; give the present length, or mend "
            "wound_turns and cable_length in [reference] of the profile"
        )


def _define(bench: WinchHost, winch: Winch, angle: float) -> Generator[None]:
    """Let the present place have a motor angle (rad), by a zero here where the drive keeps none.

    Drives differ in the sign of the home offset (607Ch): by the standard's text the zero lies
    that far from home, by many a drive's manual home gets that position. What came of it decides.
    """
    axis = bench.axes[winch.name]
    if axis.drive is not None and not axis.drive.keeps_zero:
        axis.define_position(angle)
        await_cycles(bench.loop, bench.clock, _SHOWN)
        return
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
    bench: WinchHost, winch: Winch, method: int | None, speed: float | None, offset: float
) -> Generator[None]:
    """One homing of the drive, by a method or at the present place, up to the disabled drive."""
    axis, limits = bench.axes[winch.name], winch.wiring.limits
    arm = abs(winch.cable.at(winch.snapshot.motor_angle)[1])
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
    motion = HomingMotion(axis, winch.cable, 2 * span)
    winch.begin(motion)
    while winch.moving:
        winch.raise_trouble()
        yield
    winch.raise_end()
    bench.wait_at_rest((winch.name,))
    if motion.failure:
        raise DriveFault(f"winch {winch.name}: homing failed: {motion.failure} ({axis.fault_text})")
    axis.position.note_zero(_UNFINISHED)


def _prepare(axis: Cia402Axis, specs: list[HomingSpec]) -> None:
    """Prepare the first of these homings that the drive takes."""
    for spec in specs[:-1]:
        with suppress(DeviceRefused):
            axis.prepare_homing(spec)
            return
    axis.prepare_homing(specs[-1])
