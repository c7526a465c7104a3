"""Lines on standard error while a bench opens: set-up of drives, and what only hardware stops."""

from __future__ import annotations

import sys
from collections.abc import Callable

from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.clock import Clock
from winchkit.schema.bench import BenchSpec

Tell = Callable[[str], None]
_FIRST, _PERIOD = 2.0, 5.0
"""s: a drive with answers of some ms is set up within 1 s; who waits longer wants to know why."""


def to_stderr(line: str) -> None:
    """Write a line to standard error."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


class SetUpProgress:
    """Says after 2 s, and then every 5 s, which drive is being set up, and the answers so far."""

    def __init__(self, clock: Clock, count: int, tell: Tell) -> None:
        """Begin with none of ``count`` drives."""
        self._clock, self._count, self._tell = clock, count, tell
        self._place = 0
        self._next = clock.now() + _FIRST

    def set_up(self, name: str, axis: Cia402Axis) -> None:
        """Commission the next drive, that of the winch ``name``; raises what the axis raises."""
        self._place += 1
        start, requests = self._clock.now(), 0

        def answered() -> None:
            nonlocal requests
            requests += 1
            now = self._clock.now()
            if now < self._next:
                return
            self._next = now + _PERIOD
            self._tell(
                f"winch {name} ({axis.name}): setting up drive {self._place} of {self._count}: "
                f"{requests} SDO requests in {now - start:.1f} s"
            )

        axis.objects.on_transfer = answered
        try:
            axis.commission()
        finally:
            axis.objects.on_transfer = None


def tell_hardware(spec: BenchSpec) -> None:
    """Say on stderr which winches those are, and what stops them."""
    for name, winch in spec.winch.items():
        if winch.host_loss:
            to_stderr(
                f"winch {name}: its drive does not notice when this computer falls silent; what "
                f"stops the winch then is {winch.host_loss_description}"
            )
