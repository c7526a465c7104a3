"""Moves several winches as one: planned to last equally long, started in one cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.motion import StartGate
from winchkit.bench.winch import Winch
from winchkit.drivers.clock import Clock
from winchkit.errors import MotionError, UsageError

_POLL = 0.01
"""s: delay with which the others are stopped after one has ended early."""


def begin_together(
    loop: ControlLoop,
    lengths: Mapping[Winch, float],
    speed: float | None,
    acceleration: float | None,
    *,
    hold: bool,
) -> None:
    """Begin a move of each winch to its cable length (m), all over the time of the longest.

    The drives are enabled in the same cycles, hold their places until the last of them is
    enabled, and start in the same cycle. Nothing begins unless every move is allowed.
    """
    if not lengths:
        raise UsageError("a common move needs at least one winch")
    moves = {
        winch: winch.planned(length, speed, acceleration, hold=hold)
        for winch, length in lengths.items()
    }
    longest = max(move.duration for move in moves.values())
    gate = StartGate([partial(winch.ready_for, move) for winch, move in moves.items()])
    for move in moves.values():
        move.stretch(longest)
    with loop.ordering:
        for winch, move in moves.items():
            winch.begin(move, gate)


def wait_together(loop: ControlLoop, winches: Sequence[Winch], clock: Clock) -> None:
    """Return when all are done; where one ends early the others are stopped and it is raised."""
    while any(winch.moving for winch in winches):
        for winch in winches:
            _check(loop, winch, winches)
        clock.sleep(_POLL)
    for winch in winches:
        winch.wait()


def _check(loop: ControlLoop, winch: Winch, winches: Sequence[Winch]) -> None:
    """Stop all where one that has ended did not arrive, or was taken over."""
    try:
        if winch.moving:
            winch.raise_trouble()
        else:
            winch.raise_end()
    except MotionError:
        with loop.ordering:
            for each in (one for one in winches if one.commanded_here):
                loop.winches[each.name].controller.stop()
        raise
