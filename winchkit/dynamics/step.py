"""One sample of a line as expressions: readings from the motion, and the memory of the effects.

An effect is traced on two samples, the one before and the present one, as for control
(:mod:`winchkit.estimation.cable_state`); its memory is what ``Effect.carry`` hands over. Directions
are those of :meth:`winchkit.model.line.Line.moments`, smooth at standstill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from winchkit.dynamics.balance import needs_a_step
from winchkit.dynamics.differences import with_exact_differences
from winchkit.dynamics.expression import Expression, symbol
from winchkit.dynamics.tracing import expression, traced
from winchkit.effects.effect import Values
from winchkit.effects.term import Term, act
from winchkit.errors import FileError, UsageError
from winchkit.model.line import Line
from winchkit.model.stages import At, Modifier
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

INPUTS = {
    "time": ("s", "since the start"),
    "motor_angle": ("rad", "of the motor"),
    "motor_rate": ("rad/s", "its first derivative"),
    "motor_acceleration": ("rad/s^2", "its second derivative"),
    "load": ("N", "tension at the platform"),
    "temperature": ("degC", "of the cable and the machine"),
    "measured_torque": ("N m", "of the motor, as its drive reports it"),
}
"""Inputs of a step with their units."""
OUTPUTS = {
    "cable_length": ("m", "free length with every effect on it, as its instrument reads it"),
    "tension": ("N", "reading of the load cell"),
    "motor_torque": ("N m", "predicted"),
    "arm": ("m/rad", "cable wound in per motor angle"),
}
PREDICTED = ("predicted_torque", "N m", "of your own model of the axis; 0 without one")
"""Input of an axis in place of the load, which has the same effect there: name, unit, meaning."""
BEFORE = "before_"
"""Prefix of the inputs of the sample before."""
RESERVED = {*INPUTS, PREDICTED[0], *(BEFORE + name for name in INPUTS), "before", "is_started"}
"""Names of the step itself, which no parameter or memory of an effect may have."""
_UNTRACED = (TypeError, ValueError, AttributeError, IndexError, FileError)
"""Errors of a function that needs numbers; the effect's own error is a FileError."""
_TEMPLATE = """\
static inline real {name}(real value, const {prefix}_input *at)
{{
    /* fill in: {formula} */
    return value;
}}"""


def inputs_of(profile: WinchProfile) -> dict[str, tuple[str, str, str]]:
    """Name, unit and meaning of each input by its symbol."""
    own = {"load": PREDICTED} if isinstance(profile, AxisProfile) else {}
    return {symbol: own.get(symbol, (symbol, *told)) for symbol, told in INPUTS.items()}


def outputs_of(profile: WinchProfile) -> dict[str, tuple[str, str]]:
    """Units and meaning of the outputs by name: of an axis the torque."""
    names = ["motor_torque"] if isinstance(profile, AxisProfile) else list(OUTPUTS)
    return {name: OUTPUTS[name] for name in names}


@dataclass(frozen=True)
class Constant:
    """A parameter of an effect as a named constant."""

    name: str
    value: float
    unit: str
    source: str
    """File and line."""


@dataclass(frozen=True)
class EffectMemory:
    """State of an effect between two samples."""

    name: str
    start: float
    after: Expression


@dataclass(frozen=True)
class LineSample:
    """One sample of a line."""

    outputs: dict[str, Expression]
    memories: tuple[EffectMemory, ...]
    constants: tuple[Constant, ...]
    at_rest: tuple[Expression, Expression]
    """Cable length and arm of ``motor_angle`` and ``load`` at rest, without memory."""
    nominal_angle: Expression
    """Motor angle at the cable length ``length`` without effects: start of the inverse."""


class _Recorder:
    """Modifiers of the terms on symbols; the memory that they hand over."""

    def __init__(self) -> None:
        self.memories: dict[str, EffectMemory] = {}

    def modifier(self, term: Term, values: Values) -> Modifier:
        effect = term.effect
        if effect.carry is None:
            return Modifier(effect.stage, lambda v, at: act(effect, values, v, at), effect.order)

        def with_memory(value: Any, at: At) -> Any:
            assert effect.carry is not None
            name = effect.id.replace("-", "_") + (f"_{at.pulley}" if at.pulley >= 0 else "")
            name += "_memory" * (name in RESERVED)
            own = {**values, "start": traced(symbol(name))}
            after = act(effect, own, value, at)
            end = expression(effect.carry(after, value, at, own))
            self.memories[name] = EffectMemory(name, float(term.values["start"]), end)
            return after

        return Modifier(effect.stage, with_memory, effect.order)


def step_of(profile: WinchProfile, terms: Sequence[Term], prefix: str = "winch") -> LineSample:
    """Trace one sample. Raises UsageError with the effects that have no step, and with a template
    to fill in, its names with ``prefix``."""
    refused = [term for term in terms if _is_untraced(profile, term)]
    if refused:
        names = ", ".join(term.effect.id for term in refused)
        effect = refused[0].effect
        template = _TEMPLATE.format(
            name=effect.id.replace("-", "_"), prefix=prefix, formula=effect.formula
        )
        raise UsageError(
            f"{names}: cannot be written as formulas of one sample (the function branches on the "
            "motion, needs other samples or the load of a run, or has no Effect.carry); remove it "
            f"from the profile, and add in the code:\n{template}"
        )
    constants: dict[str, Constant] = {}
    recorder = _Recorder()
    named = [(term, _values(profile, term, constants)) for term in terms]
    line = Line(profile, [recorder.modifier(term, values) for term, values in named])
    rows = {n: traced([symbol(BEFORE + n), symbol(n)]) for n in INPUTS}
    kinematics, outputs = _traced(line, rows)
    outputs["arm"] = expression(kinematics.arm[-1])
    resting = Line(profile, [t.modifier() for t in terms if not t.effect.memory])
    one = {n: traced([symbol(n)]) for n in ("motor_angle", "load")}
    none = traced([0.0])
    at = resting.moments(none, one["motor_angle"], none, one["load"], traced([20.0]))
    length, arm = resting.lengths_and_arms(at)
    nominal = expression(line.nominal_motor_angle(traced([symbol("length")])))
    shown, memories = outputs_of(profile), recorder.memories.values()
    roots = [*(outputs[name] for name in shown), *(m.after for m in memories)]
    exact = with_exact_differences(roots, {name: BEFORE + name for name in INPUTS})
    return LineSample(
        dict(zip(shown, exact, strict=False)),
        tuple(
            replace(m, after=new) for m, new in zip(memories, exact[len(shown) :], strict=True)
        ),
        tuple(constants.values()), (expression(length), expression(arm)), nominal,
    )  # fmt: skip


def _traced(line: Line, rows: dict[str, Any]) -> tuple[Any, dict[str, Expression]]:
    time, angle, rate, acceleration, load, temperature, torque = (rows[n] for n in INPUTS)
    at = line.moments(time, angle, rate, load, temperature)
    at = replace(at, motor_acceleration=acceleration, motor_torque=torque)
    kinematics = line.kinematics(at)
    drum_side = line.drum_tension(load, at)
    outputs = {
        "cable_length": line.indicated_length(at, kinematics),
        "tension": line.indicated_tension(at, drum_side),
        "motor_torque": line.indicated_torque(at, kinematics, drum_side),
    }
    return kinematics, {name: expression(value[-1]) for name, value in outputs.items()}


def _values(profile: WinchProfile, term: Term, constants: dict[str, Constant]) -> Values:
    """Values of a term as symbols, where its function does not need them as numbers."""
    prefix = term.effect.id.replace("-", "_")
    found, own = {}, dict[str, Constant]()
    table = next((t for t in profile.effect if t.id == term.effect.id), None)
    source = f"{table.path}:{table.line}" if table is not None else profile.name
    for p in term.effect.parameters:
        value = term.values[p.name]
        name = f"{prefix}_{p.name}"
        if p.whole or name in constants or name in RESERVED:
            found[p.name] = value
            continue
        found[p.name] = traced(symbol(name, value))
        own[name] = Constant(name, value, p.unit, source)
    if not _is_traced(profile, term, found):
        return term.values
    constants.update(own)
    return found


def _is_untraced(profile: WinchProfile, term: Term) -> bool:
    """Whether an effect has no formula of one sample and its memory: a run's load is no sample."""
    if {"load_mass", "payloads"} & set(term.effect.needs):
        return True
    if term.effect.carry is None:
        return needs_a_step(profile, term)
    return not _is_traced(profile, term, term.values)


def _is_traced(profile: WinchProfile, term: Term, values: Values) -> bool:
    """Whether an effect can be traced with these values."""
    try:
        line = Line(profile, [_Recorder().modifier(term, values)])
        _traced(line, {n: traced([symbol(BEFORE + n), symbol(n)]) for n in INPUTS})
    except _UNTRACED:
        return False
    return True
