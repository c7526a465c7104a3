"""Brings a bench back after trips, faults and lost buses; enables nothing.

The latch is cleared last, once nothing forbids motion: a reset that fails leaves it as it was.
"""

from __future__ import annotations

from winchkit.bench.snapshot import Direction
from winchkit.bench.waiting import await_cycles, await_feedback, await_rest, clear_faults
from winchkit.bench.wiring import Wired
from winchkit.drivers.can.cia402 import State
from winchkit.drivers.clock import Clock
from winchkit.errors import LimitTripped, NotPermitted
from winchkit.schema.bench import BenchSpec

__all__ = ["reset"]

_UNHEARD = (
    "boot-up",
    "heartbeat",
    "nmt",
    "mode",
    "feedback",
    "deaf",
    "computer",
    "bus",
    "second master",
)
"""Trips after which a drive may have lost its set-up."""


def reset(wired: Wired, spec: BenchSpec, clock: Clock) -> list[str]:
    """Clear trips and drive faults, open buses that went down, set lost drives up again.

    Returns what was cleared, in words. Raises LimitTripped naming what still forbids any motion,
    NotPermitted where the control loop has failed or the latch file cannot be written,
    ConnectionLost.
    """
    if wired.loop.broken is not None:
        raise NotPermitted(
            "the control loop has failed and only sends stops; close the bench, open it again, "
            "then reset"
        )
    wired.loop.listening = False
    try:
        return _reset(wired, spec, clock)
    finally:
        wired.loop.listening = True


def _reset(wired: Wired, spec: BenchSpec, clock: Clock) -> list[str]:
    loop, axes = wired.loop, wired.axes
    assert loop.snapshot is not None, "an open bench has had a cycle"
    seen = loop.snapshot
    cleared = [str(trip) for trip in seen.tripped]
    for axis in axes.values():
        # What somebody else commands during the reset keeps it from succeeding.
        axis.forget_second_master()
    troubled = {trip.winch for trip in (*seen.tripped, *seen.blocked) if trip.kind in _UNHEARD}
    if "" in troubled:
        troubled = {name for name in axes if axes[name].lost_set_up} | troubled - {""}
    troubled |= _on_reopened(wired, spec)
    if not loop.beating:
        # Every drive has missed the heartbeat, and its watchdog is proved anew.
        troubled, loop.beating = set(axes), True
    if any(axes[name].host.disturbs for name in troubled):
        # The proof of one is a silence towards all: each of them is set up anew.
        troubled = set(axes)
    lost = [name for name in axes if name in troubled]
    # What a drive without its mapping said last stays: only commissioning tells how it is.
    await_rest(loop, [name for name in axes if name not in lost], clock)
    for name in lost:
        axes[name].commission()
    if any(axes[name].host.disturbs for name in lost):
        for name in lost:
            axes[name].host.settle()
    await_feedback(loop, axes, clock)
    await_rest(loop, lost, clock)
    faults = {name: axis.fault_text for name, axis in axes.items() if axis.state is State.FAULT}
    told = {trip.winch for trip in seen.tripped if trip.kind == "fault"}
    cleared += [f"winch {name}: drive fault: {faults[name]}" for name in faults if name not in told]
    clear_faults(loop, clock)
    for axis in axes.values():
        axis.forget_alarms()
    loop.supervisor.acknowledge({name: axis.heartbeat.boot_ups for name, axis in axes.items()})
    await_cycles(loop, clock, 3)
    still = [trip for trip in loop.snapshot.blocked if trip.blocks is Direction.BOTH]
    if still:
        raise LimitTripped("still not free to move: " + "; ".join(map(str, still)))
    loop.clear_latch()
    loop.forget_warnings()
    await_cycles(loop, clock, 2)
    return cleared


def _on_reopened(wired: Wired, spec: BenchSpec) -> set[str]:
    """Open buses that went down again; returns the winches on them."""
    down = {name for name, bus in wired.buses.items() if bus.fault}
    for name in down:
        wired.buses[name].reopen()
    return {name for name, winch in spec.winch.items() if winch.servo.bus in down}
