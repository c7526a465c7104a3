"""Serving of one CAN bus of a simulated bench in real time."""

from __future__ import annotations

from collections.abc import Callable

from winchkit.sim.live.buses import CanPort

__all__ = ["TICK", "serve"]

TICK = 2e-3
"""Period at which the timers of simulated devices are evaluated, s."""
_FRAMES_AT_ONCE = 500


def serve(
    port: CanPort,
    clock: Callable[[], float],
    stopped: Callable[[], bool],
    *,
    deliver: Callable[[int, bytes], None],
    beat: Callable[[], None],
    tick: Callable[[], None],
    late: Callable[[float], None],
) -> None:
    """Deliver frames when they arrive and tick every two milliseconds, until ``stopped``.

    Waiting frames are taken before the tick, so that a stall of this process is not taken for a
    loss of the master; ``beat`` sends the heartbeats that are due meanwhile. ``late`` is called
    with each tick's lateness, s.
    """
    due = clock()
    while not stopped():
        frame = port.receive(max(0.0, due - clock()))
        for _ in range(_FRAMES_AT_ONCE):
            if frame is None:
                break
            deliver(*frame)
            if clock() > due:
                beat()
            frame = port.receive(0.0)
        lateness = clock() - due
        if lateness >= 0:
            tick()
            due = max(due + TICK, clock())
            late(lateness)
