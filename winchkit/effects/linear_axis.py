"""Effects on a linear axis: the same laws with N, N s/m and kg, and with ``force`` and ``mass``.

The model has 1 m for 1 rad, so that the numbers are those of the rotary law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import wraps
from typing import Any

from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Dynamics, Effect, Parameter
from winchkit.schema.linear_axis import PARAMETERS, UNITS
from winchkit.schema.profiles.winch import WinchProfile

_ROTARY = {linear: rotary for rotary, linear in PARAMETERS.items()}


def catalogue_of(profile: WinchProfile, catalogue: Catalogue) -> Catalogue:
    """Effects, empirical ones included, with the units of a profile: a linear axis has N and m."""
    return catalogue.mapped(linear_effect) if profile.is_linear else catalogue


def linear_effect(effect: Effect) -> Effect:
    """An effect with the parameters of a linear axis."""
    phases = {phase for _, phase in effect.polar_pairs}
    parameters = tuple(_linear(item, is_phase=item.name in phases) for item in effect.parameters)
    if parameters == effect.parameters:
        return effect
    return replace(
        effect,
        parameters=parameters,
        apply=_with_names(effect.apply),
        carry=None if effect.carry is None else _with_names(effect.carry),
        dynamics=None
        if (law := effect.dynamics) is None
        else Dynamics(_with_names(law.value), _with_names(law.rate)),
        undo=None if effect.undo is None else _with_names(effect.undo),
        correct=None if effect.correct is None else _with_names(effect.correct),
        impacts=None if effect.impacts is None else _with_names(effect.impacts),
        possible=None if effect.possible is None else _with_names(effect.possible),
        probes=tuple(
            {PARAMETERS.get(name, name): value for name, value in probe.items()}
            for probe in effect.probes
        ),
        single=None if effect.single is None else linear_effect(effect.single),
    )


def _linear(parameter: Parameter, *, is_phase: bool) -> Parameter:
    unit = parameter.unit if is_phase else UNITS.get(parameter.unit, parameter.unit)
    if parameter.whole and parameter.name.startswith("order"):
        unit = "rad/m"
    return replace(parameter, name=PARAMETERS.get(parameter.name, parameter.name), unit=unit)


def _with_names(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of an effect, whose values (its last argument) have the names of a linear axis."""

    @wraps(function)
    def named(*arguments: Any) -> Any:
        return function(*arguments[:-1], _renamed(arguments[-1]))

    return named


def _renamed(values: Mapping[str, float]) -> dict[str, float]:
    return {_ROTARY.get(name, name): value for name, value in values.items()}
