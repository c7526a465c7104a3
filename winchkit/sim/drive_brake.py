"""The holding brake of a simulated drive, and the time that it takes to open and to close."""

from __future__ import annotations

from math import inf

__all__ = ["HoldingBrake"]


class HoldingBrake:
    """Opens ``release`` s after power comes, closes ``apply`` s after it goes.

    Where the motor stands still when its power is to go, it holds the load until the brake does.
    Without a brake (``fitted`` false) nothing holds.
    """

    def __init__(self, *, fitted: bool, release: float = 0.0, apply: float = 0.0) -> None:
        self.closed = fitted
        self.holding = False
        """Whether the motor holds the load while the brake closes."""
        self._fitted, self._release, self._apply = fitted, release, apply
        self._powered = 0.0
        self._off = inf

    def power(self, dt: float) -> None:
        """Power is on for another ``dt`` s."""
        self._off, self.holding = 0.0, False
        self.closed = self._fitted and self._powered < self._release
        self._powered += dt

    def off(self, dt: float, *, still: bool, cut: bool) -> None:
        """Power is to be off for another ``dt`` s; ``cut`` is off at once, come what may."""
        if not self._fitted:
            return
        if self._powered:
            self.holding = still and not self.closed
        self._powered = 0.0
        self.closed = self.closed or self._off >= self._apply
        self.holding = self.holding and not self.closed and not cut
        self._off += dt
