"""What an effect is: a stage, parameters, a pure function, and words.

A user's own effect is one such object in a Python file (``--effects mine.py``) or behind the
entry point group ``winchkit.effects``; it takes part in everything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from winchkit.model.stages import ROBOT_STAGES, At, Stage

__all__ = [
    "MOTOR_ORDERS",
    "Effect",
    "Need",
    "Parameter",
    "Placement",
    "Values",
    "order_per_turn",
    "told_apart",
]

Values = Mapping[str, float]
Need = Literal[
    "cable", "layers", "guide", "pulley", "temperature", "load", "rope_force", "gearing", "robot"
]
Output = Literal["cable_length", "tension", "motor_torque"]
Placement = Literal["one", "all", "platform"]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, as files give it."""

    name: str
    unit: str
    null: float
    """Value at which the effect vanishes; for a shape, the default."""
    typical: float
    """Size that is usual, in ``unit``: prior scale and secant step."""
    low: float = float("-inf")
    high: float = float("inf")
    role: Literal["amplitude", "shape", "fixed"] = "amplitude"
    """A shape says how an effect looks, an amplitude how large it is; a fixed one is not fitted."""
    reciprocal: bool = False
    """Fitted as 1/value, since the null is infinite (stiffnesses)."""
    grid: tuple[float, ...] = ()
    """Coarse values of a shape to score at."""
    whole: bool = False
    """A whole number (an order): scanned over the grid, never refined."""


@dataclass(frozen=True)
class Effect:
    """A physical phenomenon that a model lacks or has."""

    id: str
    stage: Stage
    parameters: tuple[Parameter, ...]
    apply: Callable[[Any, At, Values], Any]
    """Value of the stage with the effect: pure, exactly the value given at the null."""
    outputs: tuple[Output, ...]
    """Outputs that it changes."""
    what: str
    formula: str
    source: str
    looks_like: str
    told_apart: str
    """Which run separates it from what it is confused with."""
    confused_with: tuple[str, ...] = ()
    family: str = ""
    contains: tuple[str, ...] = ()
    """Effects that are special cases of it and must not stand beside it."""
    needs: tuple[Need, ...] = ()
    order: int = 0
    polar: tuple[str, str] | None = None
    """Amplitude and phase fitted as a pair of cosine and sine amplitudes."""
    memory: bool = False
    """Starts in a state that a run may fit: parameter ``start`` of role ``fixed``, null 0."""
    carry: Callable[[Any, Any, At, Values], float] | None = None
    """The ``start`` of what follows, from its last value after and before it: for control, which
    takes a run sample by sample."""
    rested: float = 0.0
    """``start`` of a machine that has stood for long under its load."""
    left_out: str = ""
    """Why control cannot use it although it changes length or tension, in words."""
    repeatable: bool = False
    """May stand several times, with other orders."""
    probes: tuple[Mapping[str, float], ...] = field(default=())
    """Values whose secants make the signature where single parameters have no gradient."""
    shakes: Callable[[At, Values], NDArray[np.bool_]] | None = None
    """Samples (n,) around which it jerks force and torque by how much nobody knows."""
    visible: Callable[[At, Values], bool] | None = None
    """Whether a motion gets so far that it looks like what it is called, and like nothing else."""
    possible: Callable[[Values], bool] | None = None
    """Whether values make sense together, where the bounds of each cannot say it."""
    on_robot: frozenset[Placement] = frozenset()
    """How it acts on a robot that stands: on ``one`` line, on ``all`` lines alike, on either, or on
    the ``platform``; empty where it takes a motion to show."""

    @property
    def not_in_control(self) -> str:
        """Why a winch's length and tension do not use it, in words; empty where they do."""
        if self.left_out:
            return self.left_out
        if self.of_robots:
            return "a winch by itself has no such part"
        if self.stage is Stage.LENGTH_INSTRUMENT:
            return "it is in the instrument, not in the rope"
        if self.stage > Stage.CELL:
            return "it changes the torque only"
        if self.memory and self.carry is None:
            return "it has a memory and does not say what it carries on (Effect.carry)"
        return ""

    def parameter(self, name: str) -> Parameter:
        """A parameter by name."""
        return next(p for p in self.parameters if p.name == name)

    def nested_with(self, other: Effect) -> bool:
        """Whether one of the two laws is a case of the other."""
        return other.id in self.contains or self.id in other.contains

    @property
    def of_robots(self) -> bool:
        """Whether only a robot can have it."""
        return self.stage in ROBOT_STAGES

    @property
    def null(self) -> dict[str, float]:
        """The values at which it vanishes."""
        return {p.name: p.null for p in self.parameters}


def told_apart(first: Effect, second: Effect) -> str:
    """Which run separates two effects: by the card that names the other one."""
    if second.id not in first.confused_with and first.id in second.confused_with:
        return second.told_apart
    return first.told_apart


_MOST = 1000.0
MOTOR_ORDERS = (*map(float, range(1, 13)), 18.0, 24.0, 36.0)
"""Orders per motor turn at which poles, slots and teeth are looked for."""


def order_per_turn(orders: tuple[float, ...], typical: float) -> Parameter:
    """The parameter ``order``, looked for at ``orders``; a free one would fit anything periodic."""
    return Parameter(
        "order", "1", null=1.0, typical=typical, low=1.0, high=_MOST,
        role="shape", grid=orders, whole=True,
    )  # fmt: skip
