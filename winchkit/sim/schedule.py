"""Schedule of a motion programme: runs with their moves and loads over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import copysign, sqrt

from winchkit.errors import Fault, FileError, UsageError, suggest
from winchkit.schema.bench import LimitSpec
from winchkit.schema.programme import ALL, Programme, ProgrammeStep


@dataclass(frozen=True)
class SCurve:
    """A move of ``distance`` from rest to rest; SI units of the moved coordinate (m or rad)."""

    distance: float
    jerk: float
    jerk_time: float
    """Duration of each of the four segments with jerk, s."""
    constant_time: float
    """Duration of constant acceleration, s."""
    cruise_time: float

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return 4 * self.jerk_time + 2 * self.constant_time + self.cruise_time

    def at(self, time: float) -> tuple[float, float]:
        """Distance and speed at ``time``; constant outside the move."""
        if time < 0.0:
            return 0.0, 0.0
        if time >= self.duration:
            return self.distance, 0.0
        sign = copysign(1.0, self.distance)
        half = 0.5 * self.duration
        if time > half:
            gone, speed = self._rise(self.duration - time)
            return self.distance - sign * gone, sign * speed
        gone, speed = self._rise(time)
        return sign * gone, sign * speed

    def _rise(self, time: float) -> tuple[float, float]:
        """Distance and speed in the first half, both positive."""
        gone = speed = acceleration = 0.0
        for jerk, length in (
            (self.jerk, self.jerk_time),
            (0.0, self.constant_time),
            (-self.jerk, self.jerk_time),
        ):
            t = min(time, length)
            gone += t * (speed + t * (acceleration / 2 + t * jerk / 6))
            speed += t * (acceleration + t * jerk / 2)
            acceleration += t * jerk
            time -= t
        return gone + time * speed, speed


def plan(distance: float, speed: float, acceleration: float, jerk: float) -> SCurve:
    """Plan the fastest symmetric S-curve over ``distance`` within the three positive limits.

    Raises UsageError for a limit that is not positive.
    """
    for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk)):
        if not value > 0:
            raise UsageError(f"{name} limit {value:g} must be positive")
    length = abs(distance)
    jerk_time = min(acceleration / jerk, sqrt(speed / jerk), (length / (2 * jerk)) ** (1 / 3))
    # Half the move without cruise covers v (2 tj + tc) / 2 at peak speed v = j tj (tj + tc).
    peak = jerk * jerk_time
    constant = 0.0
    if peak > 0:
        by_speed = speed / peak - jerk_time
        by_length = (sqrt(jerk_time**2 + 4 * length / peak) - 3 * jerk_time) / 2
        constant = max(0.0, min(by_speed, by_length))
    top = peak * (jerk_time + constant)
    cruise = max(0.0, length / top - (2 * jerk_time + constant)) if top > 0 else 0.0
    return SCurve(distance, jerk, jerk_time, constant, cruise)


_JERK_TIME = 0.4
"""Rise time of an acceleration without another limit of jerk, s."""
_NOTHING = (
    "the programme has neither a move nor a hold: a repeat starts at the length where it ends; add "
    "a step to another length, or a hold"
)
ASK_PAUSE = 20.0
"""Time of an operator to attach a load, s."""


@dataclass(frozen=True)
class Leg:
    """One step: moves of cable length with a common start, or a hold."""

    duration: float
    moves: Mapping[str, SCurve] = field(default_factory=dict)


@dataclass(frozen=True)
class RunPlan:
    """One run: initial lengths, loads and moves."""

    start: Mapping[str, float]
    """Cable length of every winch, m."""
    load_mass: Mapping[str, float]
    """Known mass on every winch, kg."""
    legs: tuple[Leg, ...]
    elapsed: float
    """Start since that of the programme, pauses included, s."""
    temperature: Mapping[str, float] = field(default_factory=dict)
    """Temperatures that were requested, by winch, degC."""
    warmed: float = 0.0
    """Time of that request since the start of the programme, s."""

    @property
    def duration(self) -> float:
        """Length of the run, s."""
        return sum(leg.duration for leg in self.legs)


class _StepTimes:
    """Evaluates the steps with the resulting lengths, loads and times."""

    def __init__(
        self, limits: Mapping[str, LimitSpec], length: dict[str, float], load: dict[str, float]
    ) -> None:
        self.limits = limits
        self.length = length
        self.load = load
        self.elapsed = self.warmed = 0.0
        self.temperature: dict[str, float] = {}
        self.legs: list[Leg] = []
        self.plans: list[RunPlan] = []
        self._begin()

    def _begin(self) -> None:
        self._start = dict(self.length)
        self.legs = []

    def end_run(self) -> None:
        """Close the run of the legs so far, if there are any."""
        if self.legs:
            run = RunPlan(
                self._start,
                dict(self.load),
                tuple(self.legs),
                self.elapsed,
                dict(self.temperature),
                self.warmed,
            )
            self.plans.append(run)
            self.elapsed += run.duration
        self._begin()

    def take(self, step: ProgrammeStep, winches: Sequence[str]) -> None:
        """Schedule one step for the winches that it names."""
        if step.load_mass is not None and any(
            self.load[name] != step.load_mass for name in winches
        ):
            self.end_run()
            self.load.update(dict.fromkeys(winches, step.load_mass))
        if step.temperature is not None and any(
            self.temperature.get(name) != step.temperature for name in winches
        ):
            self.end_run()
            self.temperature.update(dict.fromkeys(winches, step.temperature))
            self.warmed = self.elapsed
        if step.ask is not None:
            self.elapsed += ASK_PAUSE
        elif step.hold is not None:
            self.legs.append(Leg(step.hold))
        else:
            self._move(step, winches)

    def _move(self, step: ProgrammeStep, winches: Sequence[str]) -> None:
        moves = {}
        for name in winches:
            here, limit = self.length[name], self.limits[name]
            goal = step.to if step.to is not None else here + (step.by or 0.0)
            speed = min(step.speed or limit.speed, limit.speed)
            acceleration = min(step.acceleration or limit.acceleration, limit.acceleration)
            moves[name] = plan(goal - here, speed, acceleration, acceleration / _JERK_TIME)
            self.length[name] = goal
        duration = max(move.duration for move in moves.values())
        if duration > 0:
            self.legs.append(Leg(duration, moves))


def schedule(
    programme: Programme,
    limits: Mapping[str, LimitSpec],
    length: Mapping[str, float],
    load_mass: Mapping[str, float],
) -> list[RunPlan]:
    """Schedule all repeats of a programme, with a new run at every change of load.

    ``length``, ``load_mass``: initial cable length, m, and mass, kg, by winch. Returns: the first
    run starts at the length where a repeat ends, so that all repeats have the same motion. Raises
    FileError for a step of an unknown winch or beyond a winch's length limits, and for a programme
    without motion and hold.
    """
    _check_names(programme, list(limits))
    layout = _StepTimes(limits, dict(length), dict(load_mass))
    for index, step in enumerate(programme.step):
        layout.take(step, _winches(step, limits))
        _check_place(programme, index, layout)
    fixed = any(step.to is not None for step in programme.step)
    layout = _StepTimes(limits, layout.length if fixed else dict(length), dict(load_mass))
    for _ in range(programme.repeat):
        for step in programme.step:
            layout.take(step, _winches(step, limits))
        layout.end_run()
    if not layout.plans:
        raise FileError(Fault(_NOTHING, programme.name, key="step"))
    return layout.plans


def _winches(step: ProgrammeStep, limits: Mapping[str, LimitSpec]) -> list[str]:
    return list(limits) if step.winch == ALL else [step.winch]


def _check_names(programme: Programme, known: list[str]) -> None:
    faults = [
        Fault(
            f"no winch '{step.winch}' on this bench; it has {', '.join(known)}"
            + suggest(step.winch, known),
            programme.name,
            key=f"step[{index}].winch",
        )
        for index, step in enumerate(programme.step)
        if step.winch != ALL and step.winch not in known
    ]
    if faults:
        raise FileError(faults)


def _check_place(programme: Programme, index: int, layout: _StepTimes) -> None:
    for name, limit in layout.limits.items():
        here = layout.length[name]
        if limit.length is not None and not limit.length[0] <= here <= limit.length[1]:
            low, high = limit.length
            raise FileError(
                Fault(
                    f"winch {name} would be at {here:g} m, outside its limits {low:g} m to "
                    f"{high:g} m; change the step or the bench's limits.length",
                    programme.name,
                    key=f"step[{index}]",
                )
            )
