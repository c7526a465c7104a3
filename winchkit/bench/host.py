"""Interface of a bench to its winches and their homing."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from typing import Protocol

from winchkit.bench.cells.desk import CellDesk
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.snapshot import BenchSnapshot, Direction
from winchkit.bench.remote.commander import Commanders
from winchkit.bench.tracker import TrackerReceiver
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.clock import Clock


class WinchHost(Protocol):
    """The bench of a winch: clock, state, permissions, and what concerns all winches."""

    clock: Clock
    loop: ControlLoop
    axes: Mapping[str, Cia402Axis]
    """Drive by winch."""
    commanders: Commanders
    cells: CellDesk

    @property
    def tracker(self) -> TrackerReceiver | None:
        """The tracker of its robot; None where none is declared."""

    @property
    def snapshot(self) -> BenchSnapshot:
        """Newest state of the whole bench."""

    def permit(self, winch: str, direction: Direction) -> None:
        """Raise what forbids this motion of a winch; return when it is allowed."""

    def permit_tension(self, winch: str) -> None:
        """Raise where a winch may not control its tension beside those that do."""

    def permit_at_rest(self, winch: str) -> None:
        """Raise what forbids to enable a winch's drive, even at rest."""

    def raise_trouble(self) -> None:
        """Raise the error that has stopped the bench, if there is one."""

    def stop_with(self, name: str, *, wait: bool = True) -> None:
        """Ramp a winch to rest, and with it those that stop together with it."""

    def wait_at_rest(self, names: Iterable[str]) -> None:
        """Return when these winches are disabled and stand still; raises MotionError if not."""

    def homing(self, winch: str, request: HomingRequest) -> Generator[None]:
        """Home a winch, yielding while there is something to wait for."""
