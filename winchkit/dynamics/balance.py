"""Balance of torques of a winch or an axis, solved for the motor's acceleration.

The line predicts the motor torque of a motion; traced on symbols its prediction is an expression of
the motion and of the states of the effects. The acceleration is that at which it equals the torque
of the motor. The load of a winch moves with the unstrained cable, as in the prediction: elongation
and frame change the length that is read, not the motion.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from winchkit.dynamics.drives import signal
from winchkit.dynamics.expression import (
    Expression,
    derivative,
    number,
    rate,
    substituted,
    symbol,
    symbols_of,
)
from winchkit.dynamics.tracing import expression, traced
from winchkit.effects.term import Term, modifiers_of
from winchkit.errors import UsageError
from winchkit.model.line import Line, Motion
from winchkit.model.stages import At, Modifier, Stage
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.units import GRAVITY

_PIECES = 3
"""Newton steps for a torque that is piecewise linear in the acceleration, as friction by the load:
one for each sign of the load and one to reach the right piece."""
ON_MOTION = frozenset(
    {Stage.DRUM_ANGLE, Stage.DRUM, Stage.WOUND, Stage.LOAD, Stage.CABLE_WEIGHT, Stage.PULLEY}
) | {Stage.GEARBOX, Stage.MOTOR, Stage.TORQUE_CONSTANT, Stage.TORQUE_SIGNAL}
"""Stages between the motor's torque and its motion; the others change readings only."""


@dataclass(frozen=True)
class EffectState:
    """State of an effect with memory."""

    term: Term
    name: str
    """Symbol of the state; ``open_`` and it: 1 where it may change, 0 where it is held."""
    low: float
    high: float
    start: float

    @property
    def open(self) -> str:
        """Symbol that is 1 where the state changes and 0 where it is held at a bound."""
        return f"open_{self.name}"


@dataclass(frozen=True)
class Balance:
    """Expressions of the motion under a motor torque, of the symbols ``time``, ``angle``,
    ``speed``, ``direction`` of the motor, −1 to 1, its ``torque`` as its drive reports it, and
    those of the signal ``load`` and of ``states``."""

    acceleration: Expression
    """Of the motor, rad/s²."""
    inertia: Expression
    """Derivative of the torque by it, kg m²."""
    load: Expression
    """Tension at the platform, N."""
    load_at_rest: float | None
    """Of a known mass, N."""
    rates: tuple[Expression, ...]
    """Of the states, 1/s, without their bounds."""
    states: tuple[EffectState, ...]

    @property
    def is_directed(self) -> bool:
        """Whether the direction of the motion changes the balance, so that a standstill may."""
        names = symbols_of([self.acceleration, *self.rates])
        return "direction" in names or bool(self.states)


class _Tracer:
    """Modifiers of the terms on symbols, and the states that they bring."""

    def __init__(self) -> None:
        self.states: dict[str, EffectState] = {}
        self.rates: dict[str, Expression] = {}

    def modifier(self, term: Term) -> Modifier:
        if term.effect.dynamics is None or _vanishes(term):
            return term.modifier()

        def apply_state(value: Any, at: At) -> Any:
            return self._through(term, value, at)

        return Modifier(term.effect.stage, apply_state, term.effect.order)

    def _through(self, term: Term, value: Any, at: At) -> Any:
        effect = term.effect
        assert effect.dynamics is not None
        start = effect.parameter("start")
        name = f"state_{effect.id.replace('-', '_')}" + (f"_{at.pulley}" if at.pulley >= 0 else "")
        state = EffectState(term, name, start.low, start.high, term.values["start"])
        values = {**term.values, "start": traced([symbol(name)])}
        self.states[name] = state
        self.rates[name] = expression(effect.dynamics.rate(value, at, values))
        return effect.dynamics.value(value, at, values)


def balance(
    profile: WinchProfile,
    terms: Iterable[Term],
    load_mass: float | None = None,
    *,
    is_load_known: bool = False,
) -> Balance:
    """The balance of a profile with its effects, under a mass, kg, a known load, or none; a mass of
    an axis is its payload. Raises
    UsageError with the names of effects that no step is known of, and for a profile without
    inertia."""
    acting = [t for t in terms if t.effect.stage in ON_MOTION and t.effect.undo is None]
    _refuse(profile, acting)
    tracer = _Tracer()
    line = Line(profile, [tracer.modifier(term) for term in acting])
    at = _moment(line)
    kinematics = line.kinematics(at)
    opened = {n: symbol(s.open) * tracer.rates[n] for n, s in tracer.states.items()}
    length = expression(kinematics.free_length)
    load = signal("load") if is_load_known else number(0.0)
    at = replace(at, payload=load_mass)
    if isinstance(profile, AxisProfile):
        load_mass = None
    if load_mass is not None:
        falling = rate(rate(length, opened), opened)
        load = number(load_mass) * (number(GRAVITY) - falling)
    at = replace(at, tension=traced([load]))
    known = at.tension if load_mass is not None or is_load_known else None
    drum_side = line.drum_side(Motion(at, None, known, None), kinematics)  # type: ignore[arg-type]
    needed = expression(line.indicated_torque(at, kinematics, drum_side))
    inertia = derivative(needed, "acceleration")
    if inertia.operation == "number" and inertia.value <= 0.0:
        raise UsageError(
            f"profile '{profile.name}' has no inertia: add the effect rotor-inertia"
            + ("" if isinstance(profile, AxisProfile) else ", or give the load's mass")
        )
    accelerated, own = number(0.0), inertia
    for _ in range(_PIECES if "acceleration" in symbols_of([inertia]) else 1):
        there, own = substituted([needed, inertia], {"acceleration": accelerated})
        accelerated = accelerated + (symbol("torque") - there) / own
    (load, *rates) = substituted([load, *tracer.rates.values()], {"acceleration": accelerated})
    weight = None if load_mass is None else load_mass * GRAVITY
    return Balance(accelerated, own, load, weight, tuple(rates), tuple(tracer.states.values()))


def refuse_load(profile: WinchProfile, terms: Iterable[Term], load_mass: float) -> None:
    """Raise UsageError for a load, kg, on an axis that carries none."""
    if isinstance(profile, AxisProfile) and not any("payloads" in t.effect.needs for t in terms):
        raise UsageError(
            f"profile '{profile.name}' is an axis without a cable, and a load of {load_mass:g} kg "
            "would hang on it: leave the load out, or add the effect joint-payload"
        )


def _vanishes(term: Term) -> bool:
    """Whether the first amplitude is at its null: there is no memory then."""
    first = next(p for p in term.effect.parameters if p.role == "amplitude")
    return term.values[first.name] == first.null


def _moment(line: Line) -> At:
    """Symbols of one sample."""
    acceleration = symbol("acceleration")
    speed = symbol("speed", rate=acceleration)
    angle, time = symbol("angle", rate=speed), symbol("time", rate=number(1.0))
    time_, angle_, speed_, none = (traced([x]) for x in (time, angle, speed, number(0.0)))
    at = line.moments(time_, angle_, speed_, none, none)
    direction = traced([symbol("direction")])
    return replace(
        at,
        motor_acceleration=traced([acceleration]),
        motor_direction=direction,
        direction=direction * float(line.profile.gearbox.direction),
    )


def _refuse(profile: WinchProfile, terms: Iterable[Term]) -> None:
    """Raise UsageError with the effects that depend on earlier samples and have no dynamics."""
    stuck = [t.effect.id for t in terms if t.effect.dynamics is None and needs_a_step(profile, t)]
    if stuck:
        raise UsageError(
            f"{', '.join(stuck)}: no step is declared, so that the motion cannot be integrated "
            "with it; declare Effect.dynamics, or remove it from the profile"
        )


def needs_a_step(profile: WinchProfile, term: Term) -> bool:
    """Whether an effect's value depends on earlier samples, or cannot be traced at all."""
    line = Line(profile)
    early, late = (traced([symbol(f"{name}{k}") for name in _CHANNELS]) for k in (0, 1))
    rows = [traced([a, b]) for a, b in zip(early, late, strict=True)]
    at = replace(
        line.moments(*rows[:5]), motor_acceleration=rows[5], motor_direction=rows[6],
        direction=rows[7], motor_torque=rows[8], payload=1.0, pulley=0, wrap=1.0,
    )  # fmt: skip
    line = Line(profile, modifiers_of([term]))
    try:
        kinematics = line.kinematics(at)
        drum_side = line.drum_tension(at.tension, at)
        outputs = (
            kinematics.free_length, line.indicated_length(at, kinematics), drum_side,
            line.indicated_tension(at, drum_side),
            line.indicated_torque(at, kinematics, drum_side),
        )  # fmt: skip
        last = [expression(x[-1]) for x in outputs]
    except (TypeError, ValueError, AttributeError, IndexError):
        return True
    return any(name.endswith("0") for name in symbols_of(last))


_CHANNELS = (
    "time", "angle", "speed", "tension", "temperature", "acceleration", "direction", "cable",
    "torque",
)  # fmt: skip
