"""The set-point handshake of profile position (PP): control bit 4 against status bit 12."""

from __future__ import annotations

from enum import Enum

from winchkit.drivers.can.modes import AT_ONCE, START

__all__ = ["SetPoint"]

_ACKNOWLEDGED = 1 << 12


class _Step(Enum):
    IDLE = 0
    PLACED = 1
    RAISED = 2


class SetPoint:
    """Hands targets over one at a time, each by a rising edge that the drive acknowledges.

    The target stands on the bus a cycle before bit 4 rises, and until that is acknowledged: the
    two may travel in different PDOs, and no drive may take an edge with the target before.
    """

    def __init__(self) -> None:
        self._offered = 0
        self._step = _Step.IDLE

    def reset(self, actual: int) -> None:
        """The axis is not enabled: it holds its place until a target differs from it."""
        self._offered, self._step = actual, _Step.IDLE

    def step(self, target: int | None, status: int) -> tuple[int, int]:
        """Bits for the control word and the target to send (counts); None asks for no move."""
        acknowledged = bool(status & _ACKNOWLEDGED)
        if self._step is _Step.PLACED:
            self._step = _Step.RAISED
        elif self._step is _Step.RAISED:
            self._step = _Step.IDLE if acknowledged else _Step.RAISED
        elif target is not None and target != self._offered and not acknowledged:
            self._offered, self._step = target, _Step.PLACED
        return (START | AT_ONCE if self._step is _Step.RAISED else 0), self._offered
