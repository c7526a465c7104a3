"""Contents of a motion programme: moves, holds and operator requests, in order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from winchkit.schema.quantity import (
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveMass,
    PositiveSpeed,
    Quantity,
    Temperature,
    Whole,
)
from winchkit.schema.table import Rule, Table

ALL = "all"
"""Name that stands for all winches of a bench, in programmes and commands."""
_RUN_UP = 0.1
"""Distance over which the first position of a programme is approached, m."""
STEP_ACTIONS = ("to", "by", "hold", "ask")


@dataclass(frozen=True)
class ProgrammeStep(Table):
    """One step: exactly one of ``to``, ``by``, ``hold`` and ``ask`` is given."""

    winch: str = ALL
    to: Annotated[float, Quantity("length", 0.0, why="a cable length is at least 0")] | None = None
    """Cable length to go to, m."""
    by: Length | None = None
    """Change of cable length, m."""
    speed: PositiveSpeed | None = None
    acceleration: PositiveAcceleration | None = None
    hold: PositiveDuration | None = None
    ask: str | None = None
    """Request to the operator; the programme waits for the answer."""
    load_mass: PositiveMass | None = None
    """Known mass on the cable from this step on, kg."""
    temperature: Temperature | None = None
    """Temperature of cable and machine from this step on, degC."""

    def rules(self) -> Iterator[Rule]:
        """A step has one action, and only keys of this action."""
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
        for key in ("load_mass", "temperature"):
            if getattr(self, key) is not None and given[0] != "ask":
                yield key, f"belongs to a step with 'ask', not to '{given[0]}'"

    @property
    def words(self) -> str:
        """The step in words."""
        if self.ask is not None:
            return f"ask: {self.ask}"
        if self.hold is not None:
            return f"hold {self.hold:g} s"
        where = f"to {self.to:g} m" if self.to is not None else f"by {self.by:g} m"
        return f"{'all winches' if self.winch == ALL else f'winch {self.winch}'} {where}"

    def asks_beyond(self, hanging: float | None, warm: float | None) -> bool:
        """Whether it requests a load or a temperature other than the present ones."""
        if self.ask is None:
            return False
        told = self.load_mass is not None or self.temperature is not None
        return (
            not told
            or self.load_mass not in (None, hanging)
            or self.temperature not in (None, warm)
        )


@dataclass(frozen=True)
class Programme(Table):
    """A motion programme; the whole list of steps runs ``repeat`` times."""

    name: str
    step: tuple[ProgrammeStep, ...]
    repeat: Annotated[int, Whole(1, 1_000_000)] = 1
    description: str = ""

    def approach(self, winch: str) -> tuple[float, ...]:
        """Cable lengths (m) from which and to which a winch moves before the first repeat.

        The second is the length at which a repeat ends, approached from the same side, so that all
        repeats have the same motion. Empty where the final length is unknown.
        """
        here: float | None = None
        before: float | None = None
        for step in self.step:
            if step.winch not in (ALL, winch) or (step.to is None and step.by is None):
                continue
            goal = step.to if step.to is not None else None
            if goal is None and here is not None:
                goal = here + (step.by or 0.0)
            if goal is not None and goal != here:
                before, here = here, goal
        if here is None:
            return ()
        if before is None:
            return (here,)
        return here + max(-_RUN_UP, min(_RUN_UP, before - here)), here

    def rules(self) -> Iterator[Rule]:
        """A programme has at least one step."""
        if not self.step:
            yield "step", "a programme needs at least one [[step]]"
