"""Serving of one CAN bus of a simulated bench in real time."""

from __future__ import annotations

from collections.abc import Callable

from winchkit.sim.live.buses import CanPort

TICK = 2e-3
"""Period at which the timers of simulated devices are evaluated, s."""


def serve(
    port: CanPort,
    clock: Callable[[], float],
    stopped: Callable[[], bool],
    *,
    deliver: Callable[[int, bytes, float], None],
    tick: Callable[[bool, float], None],
    late: Callable[[float], None],
) -> None:
    """Deliver frames when they arrive and tick every two milliseconds, until ``stopped``.

    A frame acts at the instant at which it arrived, however long it waited here for its turn: else
    a busy computer would change the motion. So ``deliver`` and ``tick`` take how long ago their
    instant was, s. ``tick`` takes besides whether no frame waits: before, a stall of this process
    would be taken for a loss of the master. ``late`` is called with each tick's lateness, s.
    """
    due = clock()
    while not stopped():
        frame = port.receive(max(0.0, due - clock()))
        waited = 0.0 if frame is None else port.waited
        received = clock()
        if frame is not None:
            deliver(*frame, waited)
        lateness = clock() - due
        if lateness >= 0:
            tick(frame is None, 0.0 if frame is None else waited + clock() - received)
            due = max(due + TICK, clock())
            late(lateness)
