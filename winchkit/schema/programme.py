"""What a motion programme declares: moves, holds and questions to the operator, in order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from winchkit.schema.quantity import (
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveMass,
    PositiveSpeed,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table

__all__ = ["Programme", "Step"]

STEP_ACTIONS = ("to", "by", "hold", "ask")


@dataclass(frozen=True)
class Step(Table):
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

    def rules(self) -> Iterator[Rule]:
        """A step does one thing, and has the keys of that thing."""
        given = [key for key in STEP_ACTIONS if getattr(self, key) is not None]
        if len(given) != 1:
            had = f"; it has {' and '.join(given)}" if given else ""
            yield "", f"a step has exactly one of {', '.join(STEP_ACTIONS)}{had}"
            return
        moves = given[0] in {"to", "by"}
        if moves and self.speed is None:
            yield "speed", 'missing; a move needs it, such as speed = "0.2 m/s"'
        if not moves:
            for key in ("speed", "acceleration"):
                if getattr(self, key) is not None:
                    yield key, f"belongs to a move, not to '{given[0]}'"
        if self.load_mass is not None and given[0] != "ask":
            yield "load_mass", f"belongs to a step with 'ask', not to '{given[0]}'"


@dataclass(frozen=True)
class Programme(Table):
    """A motion programme; the whole list of steps runs ``repeat`` times."""

    name: str
    step: tuple[Step, ...]
    repeat: WholeNumber = 1
    description: str = ""

    def rules(self) -> Iterator[Rule]:
        """A programme without a step does nothing."""
        if not self.step:
            yield "step", "a programme needs at least one [[step]]"
