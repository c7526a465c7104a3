"""Empirical effects: a free curve over one variable, for a residual of unknown cause.

They are not candidates of a diagnosis, since a free curve fits any residual. A user adds one by
name to see how far it reduces the error, until its cause is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Need, Output, Parameter, Values, order_per_turn
from winchkit.model.stages import At, Stage
from winchkit.model.variables import ANGLES, COMPOUND, VARIABLE_UNITS, VARIABLES
from winchkit.schema.linear_axis import CHANNELS, rotary_name

KNOTS = 9
"""Knots of a curve over one variable; twice as many over two variables."""
_VALUE = "value_"
_ORDERS = tuple(float(order) for order in range(1, 41))
_BOUND = 1e6
"""SI: a bound that no curve reaches (1000 km, 1 MN), for optimisers that need one."""
_AT: Mapping[Output, tuple[Stage, str, float]] = {
    "cable_length": (Stage.LENGTH_INSTRUMENT, "m", 1e-4),
    "tension": (Stage.CELL, "N", 0.5),
    "motor_torque": (Stage.TORQUE_SIGNAL, "N m", 5e-3),
}
"""Stage of a curve, its unit, and its typical size, by output."""
_NEEDS: Mapping[str, tuple[Need, ...]] = {
    "load": ("cable_force",),
    "tension": ("cable_force",),
    "directed_load": ("cable_force",),
    "directed_tension": ("cable_force",),
    "temperature": ("temperature",),
}


def empirical_id(output: str, variable: str) -> str:
    """Id ``empirical-OUTPUT-VARIABLE`` (with hyphens) of the curve of an output over a variable;
    the names may be those of a linear axis.
    """
    return shown_id(rotary_name(output), rotary_name(variable))


def shown_id(output: str, variable: str) -> str:
    """The same with the names of a result: ``empirical-force-position`` on a linear axis."""
    return f"empirical-{output}-{variable}".replace("_", "-")


def variable_of(effect: Effect) -> str:
    """The variable of an empirical effect."""
    return next(v for o in _AT for v in VARIABLES if empirical_id(o, v) == effect.id)


def knots(values: Values) -> Array:
    """Knots of the curve, (knots,)."""
    return np.linspace(values["low"], values["high"], len(heights(values)))


def heights(values: Values) -> list[float]:
    """The curve's values at its knots."""
    return [value for name, value in values.items() if name.startswith(_VALUE)]


def placed(effect: Effect, low: float, high: float) -> Effect:
    """A spline over the range of the data, ``low`` to ``high``; an effect over an angle is
    unchanged.
    """
    ends = {"low": (low,), "high": (high,)}
    parameters = tuple(replace(p, grid=ends.get(p.name, p.grid)) for p in effect.parameters)
    return replace(effect, parameters=parameters)


def _over_turns(output: Output, variable: str) -> Effect:
    _, unit, typical = _AT[output]

    def apply(value: Array, at: At, values: Values) -> Array:
        turned = values["order"] * VARIABLES[variable](at) + values["phase"]
        return value + values["amplitude"] * np.sin(turned)

    plain = _plain(output, variable, "a sin(k x + p)")
    return replace(
        plain,
        apply=apply,
        parameters=(
            Parameter("amplitude", unit, null=0.0, typical=typical, low=0.0, high=_BOUND),
            Parameter("phase", "rad", null=0.0, typical=1.0),
            order_per_turn(_ORDERS, typical=1.0),
        ),
        polar=("amplitude", "phase"),
    )


def _spline(output: Output, variable: str) -> Effect:
    _, unit, typical = _AT[output]
    count = 2 * KNOTS if variable in COMPOUND else KNOTS
    names = [f"{_VALUE}{index}" for index in range(1, count + 1)]

    def apply(value: Array, at: At, values: Values) -> Array:
        curve = np.array([values[name] for name in names])
        if not curve.any():
            return value
        added: Array = np.interp(VARIABLES[variable](at), knots(values), curve)
        return value + added

    own = VARIABLE_UNITS[variable]
    ends = tuple(
        Parameter(name, own, null=null, typical=1.0, role="shape", whole=True)
        for name, null in (("low", 0.0), ("high", 1.0))
    )
    sizes = tuple(
        Parameter(name, unit, null=0.0, typical=typical, low=-_BOUND, high=_BOUND) for name in names
    )
    plain = _plain(output, variable, f"straight lines between {count} values from low to high")
    return replace(plain, apply=apply, parameters=(*ends, *sizes))


def _plain(output: Output, variable: str, formula: str) -> Effect:
    """Description of an empirical effect."""
    over = variable.replace("_", " ")
    return Effect(
        id=empirical_id(output, variable),
        stage=_AT[output][0],
        parameters=(),
        apply=lambda value, at, values: value,
        outputs=(output,),
        what=f"Cause unknown: a curve over the {over}, fitted to the data.",
        formula=f"x = {over}: {formula}",
        source="the user's data, without a physical model",
        looks_like=f"The residual of the {output.replace('_', ' ')} over the {over}.",
        told_apart="Find its cause: 'winchkit effects new' writes a file to start from.",
        needs=_NEEDS.get(variable, ()),
        repeatable=True,
        order=9,
        left_out="its cause is unknown and may be the instrument",
    )


EMPIRICAL: Mapping[str, Effect] = {
    effect.id: effect
    for output in _AT
    for variable in VARIABLES
    for effect in [(_over_turns if variable in ANGLES else _spline)(output, variable)]
}
"""By id, e.g. ``empirical-motor-torque-drum-angle``."""
LINEAR_IDS: Mapping[str, str] = {
    shown: own
    for output in _AT
    for variable in VARIABLES
    for own in [empirical_id(output, variable)]
    for shown in [shown_id(CHANNELS.get(output, output), CHANNELS.get(variable, variable))]
    if shown != own
}
"""Id by that with the names of a linear axis."""
