"""What a bench waits for, and for how long: its drives, its sensors, its own control loop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from winchkit.bench.loop import ControlLoop
from winchkit.bench.snapshot import Phase
from winchkit.drivers.can.axis import Cia402Axis
from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import MotionError, NoReply, WinchkitError

__all__ = ["await_cycles", "await_feedback", "await_rest", "await_sensors", "clear_faults"]

_POLL = 0.01
_FIRST_FEEDBACK = 2.0
_FIRST_READING = 1.5
_REST_TIME = 5.0
_HANGS = 1.0
_RESET_TIME = 2.0


def await_cycles(loop: ControlLoop, clock: Clock, count: int) -> None:
    """Let the loop take notice of what was just ordered; raises WinchkitError when it hangs."""
    start, deadline = loop.count, clock.now() + _HANGS
    while loop.alive and loop.count < start + count:
        if clock.now() > deadline:
            raise WinchkitError("the control loop hangs; the drives stop by their heartbeat")
        clock.sleep(loop.cycle / 2)


def await_feedback(loop: ControlLoop, axes: Mapping[str, Cia402Axis], clock: Clock) -> None:
    """Wait until every drive answers to SYNC; raises NoReply."""
    deadline = clock.now() + _FIRST_FEEDBACK
    for name, axis in axes.items():
        while axis.feedback is None or loop.snapshot is None:
            if loop.failure is not None:
                raise loop.failure
            if clock.now() > deadline:
                raise NoReply(
                    f"winch {name} ({axis.name}): the drive answers SDO but sends no PDOs on "
                    f"SYNC within {_FIRST_FEEDBACK:g} s; check its PDO mapping and SYNC id 80h"
                )
            clock.sleep(_POLL)
    await_cycles(loop, clock, 2)


def await_sensors(sensors: Iterable[Sensor], clock: Clock) -> None:
    """Give every sensor time for its first answer; a silent one is told when it matters."""
    deadline, waiting = clock.now() + _FIRST_READING, list(sensors)
    while any(item.latest is None and item.problem is None for item in waiting):
        if clock.now() > deadline:
            return
        clock.sleep(_POLL)


def await_rest(loop: ControlLoop, names: Iterable[str], clock: Clock) -> None:
    """Return when these winches are disabled and stand still; raises MotionError if not."""
    deadline = clock.now() + _REST_TIME
    controllers = {name: loop.winches[name].controller for name in names}
    await_cycles(loop, clock, 2)
    while loop.alive:
        assert loop.snapshot is not None, "it has had a cycle"
        seen = loop.snapshot.winch
        busy = [
            name
            for name, item in controllers.items()
            if item.phase is not Phase.DISABLED or seen[name].phase is not Phase.DISABLED
        ]
        if not busy:
            return
        if clock.now() > deadline:
            for name in busy:
                controllers[name].stop()
            raise MotionError(
                f"winch {busy[0]} did not come to rest within {_REST_TIME:g} s (drive: "
                f"{seen[busy[0]].state}); use the emergency stop and look at the drive"
            )
        clock.sleep(_POLL)


def clear_faults(loop: ControlLoop, clock: Clock) -> None:
    """Let every drive clear its fault, and give it time for that."""
    controllers = [parts.controller for parts in loop.winches.values()]
    for controller in controllers:
        controller.reset()
    await_cycles(loop, clock, 3)
    deadline = clock.now() + _RESET_TIME
    while clock.now() < deadline and any(c.phase is Phase.RESETTING for c in controllers):
        clock.sleep(_POLL)
