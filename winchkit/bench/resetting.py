"""Brings a bench back after trips, faults and lost buses; enables nothing."""

from __future__ import annotations

from winchkit.bench.snapshot import Direction
from winchkit.bench.waiting import await_cycles, await_feedback, await_rest, clear_faults
from winchkit.bench.wiring import Wired
from winchkit.drivers.clock import Clock
from winchkit.errors import LimitTripped
from winchkit.schema.bench import BenchSpec

__all__ = ["reset"]

_UNHEARD = ("boot-up", "heartbeat", "nmt", "mode", "feedback", "deaf")
"""Trips after which a drive may have lost its set-up."""


def reset(wired: Wired, spec: BenchSpec, clock: Clock) -> None:
    """Clear trips and drive faults, open buses that went down, set lost drives up again.

    Raises LimitTripped naming what still forbids any motion, ConnectionLost.
    """
    wired.loop.listening = False
    try:
        _reset(wired, spec, clock)
    finally:
        wired.loop.listening = True


def _reset(wired: Wired, spec: BenchSpec, clock: Clock) -> None:
    loop, axes = wired.loop, wired.axes
    assert loop.snapshot is not None, "an open bench has had a cycle"
    seen = loop.snapshot
    troubled = {trip.winch for trip in (*seen.tripped, *seen.blocked) if trip.kind in _UNHEARD}
    troubled |= _on_reopened(wired, spec)
    if not loop.beating:
        # Every drive has missed the heartbeat, and its watchdog is proved anew.
        troubled, loop.beating = set(axes), True
    lost = [name for name in axes if name in troubled]
    # What a drive without its mapping said last stays: only commissioning tells how it is.
    await_rest(loop, [name for name in axes if name not in lost], clock)
    for name in lost:
        axes[name].commission()
    await_feedback(loop, axes, clock)
    await_rest(loop, lost, clock)
    clear_faults(loop, clock)
    loop.supervisor.reset({name: axis.heartbeat.boot_ups for name, axis in axes.items()})
    await_cycles(loop, clock, 3)
    still = [trip for trip in loop.snapshot.blocked if trip.blocks is Direction.BOTH]
    if still:
        raise LimitTripped("still not free to move: " + "; ".join(map(str, still)))


def _on_reopened(wired: Wired, spec: BenchSpec) -> set[str]:
    """Open buses that went down again; returns the winches on them."""
    down = {name for name, bus in wired.buses.items() if bus.fault}
    for name in down:
        wired.buses[name].reopen()
    return {name for name, winch in spec.winch.items() if winch.servo.bus in down}
