"""Brings a bench back after trips, faults and lost buses; enables nothing.

The latch is cleared last, once nothing forbids motion: a reset that fails leaves it as it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.snapshot import Direction, Phase
from winchkit.bench.hardware import Wired
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.errors import LimitTripped, MotionError, NoReply, NotPermitted, WinchkitError
from winchkit.schema.bench import BenchSpec

_POLL = 0.01
"""s: two or more cycles at the usual 4 ms."""
_FIRST_FEEDBACK = 2.0
"""s: the first SYNC comes within a cycle; drives map their PDOs within some tenths."""
_FIRST_READING = 1.5
"""s: several time-outs of a slow line; more would delay a bench with a dead cell."""
_REST_TIME = 5.0
"""s: five times the ramp from 1 m/s with 1 m/s² (rule of thumb)."""
_HANGS = 1.0
"""s beyond the cycles: a process that stands still for less goes on by itself (a trip for late
cycles reports it)."""
_RESET_TIME = 2.0
"""s: twice the time that a controller gives its drive."""


@contextmanager
def stopped_after(stop: Callable[[], None]) -> Iterator[None]:
    """Call ``stop`` at the end of the block; an error of the block, the cause, comes first."""
    try:
        yield
    except BaseException:
        with suppress(MotionError):
            stop()
        raise
    stop()


def await_cycles(loop: ControlLoop, clock: Clock, count: int) -> None:
    """Let the loop take notice of what was just ordered; raises WinchkitError when it hangs."""
    loop.require_other_thread("waiting")
    start, deadline = loop.count, clock.now() + _HANGS + count * loop.cycle
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
    """Give every sensor time for its first answer; a silent one is reported when it matters."""
    deadline, waiting = clock.now() + _FIRST_READING, list(sensors)
    while any(item.latest is None and item.problem is None for item in waiting):
        if clock.now() > deadline:
            return
        clock.sleep(_POLL)


def await_rest(
    loop: ControlLoop,
    names: Iterable[str],
    clock: Clock,
    *,
    unless: Callable[[str], bool] = lambda _name: False,
) -> None:
    """Return when these winches, less ``unless``, are disabled at rest; raises MotionError."""
    deadline = clock.now() + _REST_TIME
    controllers = {name: loop.winches[name].controller for name in names}
    await_cycles(loop, clock, 2)
    while loop.alive:
        assert loop.snapshot is not None, "it has had a cycle"
        seen = loop.snapshot.winch
        busy = [
            name
            for name, item in controllers.items()
            if (item.phase is not Phase.DISABLED or seen[name].phase is not Phase.DISABLED)
            and not unless(name)
        ]
        if not busy:
            return
        if clock.now() > deadline:
            for name in busy:
                controllers[name].stop()
            tripped = "".join(f"; {trip}" for trip in loop.snapshot.tripped)
            raise MotionError(
                f"winch {busy[0]} did not come to rest within {_REST_TIME:g} s (drive: "
                f"{seen[busy[0]].state}); use the emergency stop and look at the drive{tripped}"
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


_UNHEARD = (
    "boot-up",
    "heartbeat",
    "nmt",
    "mode",
    "feedback",
    "unresponsive",
    "computer",
    "bus",
    "second master",
)
"""Trips after which a drive may have lost its set-up."""


@dataclass(frozen=True)
class _ResetFindings:
    """What a reset finds, before it waits for anything."""

    unheard: frozenset[str]
    """Winches with a trip of :data:`_UNHEARD`; "" among them for one of the whole bench."""
    lost: frozenset[str]
    """Winches whose drives say that they have lost their set-up."""
    reopened: frozenset[str]
    """Winches whose bus went down and was opened again."""
    silent: bool
    """Whether the host sends no heartbeat."""


_SET_UP_ANEW: Mapping[str, Callable[[_ResetFindings, str], bool]] = {
    "it was not heard": lambda found, name: name in found.unheard,
    "the bench was not heard, and it has lost its set-up": lambda found, name: (
        "" in found.unheard and name in found.lost
    ),
    "its bus was opened again": lambda found, name: name in found.reopened,
    "it missed the heartbeat; its watchdog is proved anew": lambda found, _name: found.silent,
}
"""Cases in which a drive is set up anew by a reset, besides that it restarts meanwhile."""


def reset(wired: Wired, spec: BenchSpec, clock: Clock) -> list[str]:
    """Clear trips and drive faults, open buses that went down, set lost drives up again.

    Returns what was cleared, in words. Raises LimitTripped naming what still forbids any motion,
    or what tripped after the drives were found free of faults; NotPermitted where the control loop
    has failed or the latch file cannot be written; ConnectionLost.
    """
    if wired.loop.broken is not None:
        raise NotPermitted(
            "the control loop has failed and only sends stops; close the bench, open it again, "
            "then reset"
        )
    loop, axes = wired.loop, wired.axes
    assert loop.snapshot is not None, "an open bench has had a cycle"
    seen = loop.snapshot
    cleared = [str(trip) for trip in seen.tripped]
    for name, axis in axes.items():
        # What somebody else commands during the reset keeps it from succeeding.
        axis.second_master.forget()
        axis.position.forget_jump()
        loop.winches[name].rested.forget()
    found = _ResetFindings(
        unheard=frozenset(t.winch for t in (*seen.tripped, *seen.blocked) if t.kind in _UNHEARD),
        lost=frozenset(name for name, axis in axes.items() if axis.lost_set_up),
        reopened=_on_reopened(wired, spec),
        silent=not loop.beating,
    )
    lost = _with_disturbed(
        (name for name in axes if any(case(found, name) for case in _SET_UP_ANEW.values())), axes
    )
    # The last feedback of a drive without its mapping stays: only commissioning reads anew. So it
    # is with a drive that turns out meanwhile to have restarted.
    await_rest(
        loop,
        [name for name in axes if name not in lost],
        clock,
        unless=lambda name: axes[name].lost_set_up,
    )
    lost = _with_disturbed([*lost, *(name for name in axes if axes[name].lost_set_up)], axes)
    if not (loop.beating or found.silent):
        raise LimitTripped(
            "a drive did not obey the stop that the reset waited for, and the host's heartbeat "
            "ended; look at the drives, then reset again"
        )
    _set_up(lost, wired, clock)
    faults = {
        name: axis.fault_text for name, axis in axes.items() if axis.state is DriveState.FAULT
    }
    reported = {trip.winch for trip in seen.tripped if trip.kind == "fault"}
    cleared += [
        f"winch {name}: drive fault: {faults[name]}" for name in faults if name not in reported
    ]
    clear_faults(loop, clock)
    for axis in axes.values():
        axis.emergencies.in_force.clear()
    boot_ups = {name: axis.heartbeat.boot_ups for name, axis in axes.items()}
    meanwhile = [t for t in loop.supervisor.acknowledge(boot_ups) if t not in seen.tripped]
    cleared += [
        str(trip) for trip in meanwhile if not (trip.kind in _UNHEARD and trip.winch in lost)
    ]
    try:
        await_cycles(loop, clock, 3)
        still = [trip for trip in loop.snapshot.blocked if trip.blocks is Direction.BOTH]
        if still:
            raise LimitTripped("reset done, but still blocked: " + "; ".join(map(str, still)))
        loop.clear_latch()
    finally:
        loop.supervisor.withdraw()
    loop.forget_warnings()
    await_cycles(loop, clock, 2)
    if loop.snapshot.tripped:
        raise LimitTripped(
            "tripped anew during the reset: " + "; ".join(map(str, loop.snapshot.tripped))
        )
    return cleared


def _set_up(lost: Sequence[str], wired: Wired, clock: Clock) -> None:
    """Commission drives anew, with heartbeats, which no drive ends that obeys no stop meanwhile."""
    loop, axes = wired.loop, wired.axes
    loop.listening, loop.beating = False, True
    try:
        for name in lost:
            axes[name].commission()
        if any(axes[name].host.disturbs for name in lost):
            for name in lost:
                axes[name].host.settle()
        await_feedback(loop, axes, clock)
        await_rest(loop, lost, clock)
    finally:
        loop.listening = True


def _with_disturbed(lost: Iterable[str], axes: Mapping[str, Cia402Axis]) -> list[str]:
    """These drives, or all where the proof of one of them is a silence towards all."""
    own = set(lost)
    if any(axes[name].host.disturbs for name in own):
        return list(axes)
    return [name for name in axes if name in own]


def _on_reopened(wired: Wired, spec: BenchSpec) -> frozenset[str]:
    """Open buses that went down again; returns the winches on them."""
    down = {name for name, bus in wired.buses.items() if bus.fault}
    for name in down:
        wired.buses[name].reopen()
    return frozenset(name for name, winch in spec.winch.items() if winch.servo.bus in down)
