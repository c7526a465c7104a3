"""Definition of an effect: a stage, parameters, a pure function, and a description.

A user effect is an object of this class in a Python file (``--effects mine.py``) or in the entry
point group ``winchkit.effects``. It is treated like the effects of the package.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from winchkit.errors import UsageError, suggest
from winchkit.model.stages import PARTS, ROBOT_STAGES, At, Stage

Values = Mapping[str, float]
Need = Literal[
    "cable", "layers", "guide", "pulley", "temperature", "load", "cable_force", "gearing", "robot",
    "axis", "ungeared", "half_turn", "torque", "prediction", "cell",
    "load_mass", "payloads", "inertia",
]  # fmt: skip
NEED_WORDS: Mapping[Need, str] = {
    "cable": "a cable in the profile ([cable], [[pulley]] or reference.cable_length)",
    "layers": "a drum that winds in layers (spiral or archimedean)",
    "guide": "a [guide] in the profile",
    "pulley": "a [[pulley]] in the profile",
    "temperature": "a temperature channel in every run",
    "load": "a load channel or load_mass",
    "cable_force": "a load, load_mass or tension",
    "gearing": "a [gearbox] with another ratio than 1",
    "robot": "a robot's profile",
    "axis": "a profile of kind 'axis' that turns, or runs without any force in a cable",
    "ungeared": "a profile of kind 'axis', or a winch without a gearbox",
    "half_turn": "a run in which the drum turns by half a turn at least",
    "torque": "a motor_torque channel",
    "prediction": "the torque that another model predicts (--predicted)",
    "load_mass": "load_mass in every run",
    "payloads": "load_mass in every run, of two sizes at least",
    "cell": "a load channel or load_mass, or a motor_torque that the tension predicts",
    "inertia": "the inertia in the profile ([motor] inertia)",
}
"""What an effect may need, in words: parts of the profile, channels, and range of motion."""
Output = Literal["cable_length", "tension", "motor_torque"]
Placement = Literal["one", "all", "platform"]
_SYMBOLS = {"axial_stiffness": "EA"}
_SHARES = ("gain_error", "ratio_error", "efficiency", "fraction")


@dataclass(frozen=True)
class Plausible:
    """Range of values that a real machine can have, and its reason."""

    low: float
    """Lowest value, in the parameter's unit or as a share of ``of``."""
    high: float
    """Highest value."""
    reason: str
    """Reason of the range, in words."""
    of: str = ""
    """Number of the profile that the range is relative to, such as ``drum.winding_radius``."""
    of_winch: bool = False
    """Whether it is one of winches; that of an axis, which moves its load itself, is not known."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, as files have it."""

    name: str
    """Key in a profile."""
    unit: str
    """Unit in a profile."""
    null: float
    """Value at which the effect vanishes; for a shape, the default."""
    typical: float
    """Typical size, in ``unit``: prior scale and secant step."""
    low: float = float("-inf")
    """Lower bound, in ``unit``."""
    high: float = float("inf")
    """Upper bound, in ``unit``."""
    role: Literal["amplitude", "shape", "nuisance", "fixed"] = "amplitude"
    """An amplitude scales the effect, a shape changes its form; a nuisance is fitted and no part of
    the law; a fixed one is not fitted."""
    reciprocal: bool = False
    """Fitted as 1/value, since the null is infinite (stiffnesses)."""
    grid: tuple[float, ...] = ()
    """Coarse grid of a shape for the scores."""
    onset: float = 0.0
    """For the time from which the effect acts: spacing at which it is scanned, s; else zero."""
    plausible: Plausible | None = None
    """Range of real machines; None where the bounds are all that is known."""
    whole: bool = False
    """A whole number (an order): scanned over the grid, not refined."""
    over: str = ""
    """Variable over whose range in the data the grid's shares (0 to 1) are placed."""
    along: str = ""
    """Variable whose range in the data multiplies the grid, for a shape that is an extent."""


def parameter_name(parameter: str) -> str:
    """Name of a parameter in texts: its symbol, else its words."""
    return _SYMBOLS.get(parameter, parameter.replace("_", " "))


def parameter_unit(parameter: str, unit: str) -> str:
    """Unit of a parameter in texts: per cent for shares, else its own."""
    return "%" if unit == "1" and parameter in _SHARES else unit


@dataclass(frozen=True)
class Dynamics:
    """Memory in continuous time, for simulation: the state is the parameter ``start`` at any time,
    and remains at a bound of it while its rate leads outwards.
    """

    value: Callable[[Any, At, Values], Any]
    """Value of the stage at a state, from the value before."""
    rate: Callable[[Any, At, Values], Any]
    """Derivative of the state by time; ``numpy.gradient(x, at.time)`` is exact here."""


@dataclass(frozen=True)
class Effect:
    """A physical effect that a model may contain."""

    id: str
    """Name in profiles and commands."""
    stage: Stage
    """Quantity that it changes."""
    parameters: tuple[Parameter, ...]
    """Their values are handed to ``apply``."""
    apply: Callable[[Any, At, Values], Any]
    """Value of the stage with the effect: a pure function, exactly its input at the null."""
    outputs: tuple[Output, ...]
    """Outputs that it changes."""
    what: str
    """Description in one sentence."""
    formula: str
    """Equation of the change."""
    source: str
    """Reference."""
    looks_like: str
    """Appearance in the residuals."""
    told_apart: str
    """Run that distinguishes it from the effects in ``confused_with``."""
    confused_with: tuple[str, ...] = ()
    """Effects that are easily mistaken for it."""
    family: str = ""
    """Group of effects of one physical cause."""
    contains: tuple[str, ...] = ()
    """Effects that are special cases of it and must not be in the same model."""
    part: str = ""
    """Part of the machine that has it; by default that of its stage."""
    variable: str = ""
    """Variable over which its law is a curve; empty with memory, or for a product of variables."""
    reduces_to: tuple[str, ...] = ()
    """Simpler laws that it becomes where its shape is not determined, the most usual one first."""
    needs: tuple[Need, ...] = ()
    """Channels and parts without which it is no candidate."""
    order: int = 0
    """Order of application among the effects of one stage."""
    polar: tuple[str, str] | None = None
    """Amplitude and phase fitted as a pair of cosine and sine amplitudes."""
    memory: bool = False
    """Has an initial state that may be fitted per run: parameter ``start`` of role ``fixed``,
    null 0."""
    carry: Callable[[Any, Any, At, Values], Any] | None = None
    """Computes the ``start`` of the next samples from the last values after and before the stage,
    for control, which processes single samples."""
    dynamics: Dynamics | None = None
    """Its memory in simulation, by :func:`winchkit.forward`."""
    undo: Callable[[Any, Any, Values], Any] | None = None
    """Signal before the stage from the signal after it and its times, (n,); for a delay or a filter
    of a reading, which changes no motion."""
    correct: Callable[[Any, At, Values], Any] | None = None
    """Value before the stage from the value after it, (n,), of an instrument whose reading is an
    input where no other is known: what is predicted from the reading has its errors."""
    rested: float = 0.0
    """``start`` of a machine after a long rest under its load."""
    left_out: str = ""
    """Reason why control cannot use it although it changes length or tension."""
    repeatable: bool = False
    """May be repeated with other orders."""
    probes: tuple[Mapping[str, float], ...] = field(default=())
    """Values whose secants form the signature where single parameters have no gradient."""
    impacts: Callable[[At, Values], NDArray[np.bool_]] | None = None
    """Samples (n,) near impacts, whose force and torque the effect does not predict."""
    possible: Callable[[Values], bool] | None = None
    """Whether a combination of values is valid, beyond the bounds of each."""
    single: Effect | None = None
    """Of a harmonic series: the effect of one order, see :mod:`winchkit.effects.series`."""
    on_robot: frozenset[Placement] = frozenset()
    """Places on a robot at rest: ``one`` line, ``all`` lines alike, both, or the ``platform``;
    empty for an effect that needs a motion."""
    in_motion: frozenset[Placement] = frozenset()
    """Places on a robot that only its trajectories show, poses at rest do not."""

    @property
    def not_in_control(self) -> str:
        """Reason why a winch's length and tension do not use it; empty where they do."""
        if self.left_out:
            return self.left_out
        if self.of_robots:
            return "a single winch has no such part"
        if self.stage is Stage.LENGTH_INSTRUMENT:
            return "it is an effect of the instrument, not of the cable"
        if self.stage > Stage.CELL:
            return "it changes the torque only"
        if self.memory and self.carry is None:
            return "it has memory and no function for its next state (Effect.carry)"
        return ""

    @property
    def is_delay(self) -> bool:
        """Whether its size is a time: a signal is late, or early."""
        return any(p.role == "amplitude" and p.unit == "s" for p in self.parameters)

    @property
    def place(self) -> tuple[tuple[str, str, str | None], ...]:
        """Part, output and variable (None without one) at which it acts, for each output."""
        part = self.part or PARTS[self.stage]
        return tuple((part, output, self.variable or None) for output in self.outputs)

    @property
    def polar_pairs(self) -> tuple[tuple[str, str], ...]:
        """Amplitudes with their phases: several in a harmonic series."""
        if self.polar is None:
            return ()
        size, phase = self.polar
        names = [p.name for p in self.parameters]
        numbers = [name.removeprefix(size) for name in names if name.startswith(size)]
        return tuple((size + n, phase + n) for n in numbers)

    def parameter(self, name: str) -> Parameter:
        """A parameter by name.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        Parameter
            The parameter; raises UsageError for a name that the effect lacks.
        """
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = [parameter.name for parameter in self.parameters]
        there = f"it has {', '.join(known)}" if known else "it has none"
        raise UsageError(
            f"effect '{self.id}' has no parameter '{name}'; {there}" + suggest(name, known)
        )

    def nested_with(self, other: Effect) -> bool:
        """Whether one of the two laws is a special case of the other.

        Parameters
        ----------
        other : Effect
            Another effect.

        Returns
        -------
        bool
            Whether the models are nested.
        """
        return other.id in self.contains or self.id in other.contains

    def places(self, *, moving: bool) -> frozenset[Placement]:
        """Places on a robot at rest, or on one in motion.

        Parameters
        ----------
        moving : bool
            Whether the robot moves.

        Returns
        -------
        frozenset of str
            Of ``one``, ``all`` and ``platform``; empty where the effect is not visible.
        """
        return self.on_robot | self.in_motion if moving else self.on_robot

    @property
    def of_robots(self) -> bool:
        """Whether only a robot can have it."""
        return self.stage in ROBOT_STAGES

    @property
    def null(self) -> dict[str, float]:
        """The values at which it vanishes."""
        return {p.name: p.null for p in self.parameters}


def told_apart(first: Effect, second: Effect) -> str:
    """Run that distinguishes two effects, from the card that names the other one; empty without
    one.
    """
    if second.id not in first.confused_with and first.id in second.confused_with:
        return second.told_apart
    return first.told_apart


_MOST = 1000.0
"""Highest order of a file, far above those tested (40): at 1 kHz it is aliased from half a turn a
second on."""
MOTOR_ORDERS = (*map(float, range(1, 13)), 18.0, 24.0, 36.0)
"""Orders per motor turn at which effects of poles, slots and teeth are tested on a robot's poses;
runs in motion are scanned for every order."""


def with_gain(signal: Any, at: At, values: Values) -> Any:
    """A signal (n,) with the ``gain_error`` of its instrument; as ``apply`` of an effect."""
    return signal * (1.0 + values["gain_error"])


def order_per_turn(orders: tuple[float, ...], typical: float) -> Parameter:
    """The parameter ``order``, tested at ``orders``; a free order would fit any periodic error."""
    return Parameter(
        "order", "1", null=1.0, typical=typical, low=1.0, high=_MOST,
        role="shape", grid=orders, whole=True,
    )  # fmt: skip
