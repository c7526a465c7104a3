"""What a motion programme declares: moves, holds and questions to the operator, in order."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.schema.quantity import (
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveMass,
    PositiveSpeed,
)

__all__ = ["Programme", "Step"]


@dataclass(frozen=True)
class Step:
    """One step: exactly one of ``to``, ``by``, ``hold`` and ``ask`` is given."""

    winch: str = "all"
    to: Length | None = None
    """Cable length to go to, m."""
    by: Length | None = None
    """Change of cable length, m."""
    speed: PositiveSpeed | None = None
    acceleration: PositiveAcceleration | None = None
    hold: PositiveDuration | None = None
    ask: str | None = None
    """What the operator is asked to do; waits for the answer."""
    load_mass: PositiveMass | None = None
    """The known weight that hangs on the rope from this step on, kg."""


@dataclass(frozen=True)
class Programme:
    """A motion programme; the whole list of steps runs ``repeat`` times."""

    name: str
    step: tuple[Step, ...]
    repeat: int = 1
    description: str = ""
