"""Serving of one CAN bus of a simulated bench in real time."""

from __future__ import annotations

from collections.abc import Callable

from winchkit.sim.live.buses import CanPort

__all__ = ["TICK", "serve"]

TICK = 2e-3
"""Period at which the timers of simulated devices are evaluated, s."""


def serve(
    port: CanPort,
    clock: Callable[[], float],
    stopped: Callable[[], bool],
    *,
    deliver: Callable[[int, bytes], None],
    tick: Callable[[bool], None],
    late: Callable[[float], None],
) -> None:
    """Deliver frames when they arrive and tick every two milliseconds, until ``stopped``.

    ``tick`` takes whether no frame waits: before, a stall of this process would be taken for a loss
    of the master. ``late`` is called with each tick's lateness, s.
    """
    due = clock()
    while not stopped():
        frame = port.receive(max(0.0, due - clock()))
        if frame is not None:
            deliver(*frame)
        lateness = clock() - due
        if lateness >= 0:
            tick(frame is None)
            due = max(due + TICK, clock())
            late(lateness)
