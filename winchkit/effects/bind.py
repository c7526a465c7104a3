"""Binding of effects to a profile: ``[[effect]]`` tables and shorthands as terms with values."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect, Parameter
from winchkit.effects.linear_axis import catalogue_of
from winchkit.effects.term import Term, modifiers_of
from winchkit.errors import Fault, FileError, UsageError, suggest
from winchkit.model.line import Line
from winchkit.schema.profiles.winch import SHORTHANDS, EffectTable, WinchProfile
from winchkit.units import dimension_of, parse

_BESIDE_PARAMETERS = {"id", "fitted"}


def line_of(profile: WinchProfile, catalogue: Catalogue | None = None) -> Line:
    """The line that a profile declares; raises FileError with every fault of its effects."""
    return Line(profile, modifiers_of(terms_of(profile, catalogue)))


def terms_of(profile: WinchProfile, catalogue: Catalogue | None = None) -> tuple[Term, ...]:
    """Terms of a profile, shorthands first. Raises FileError with every fault."""
    terms, faults = _bind(profile, catalogue or load_catalogue())
    if faults:
        raise FileError(faults)
    return tuple(terms)


def check_profile(profile: WinchProfile, catalogue: Catalogue | None = None) -> list[Fault]:
    """Every fault of the effects that a profile declares, with its line of the file."""
    return _bind(profile, catalogue or load_catalogue())[1]


def _bind(profile: WinchProfile, catalogue: Catalogue) -> tuple[list[Term], list[Fault]]:
    catalogue = catalogue_of(profile, catalogue)
    terms = list(_shorthands(profile, catalogue))
    faults: list[Fault] = []
    for table in profile.effect:
        if table.id not in catalogue:
            message = not_in(catalogue, table.id)
            faults.append(Fault(message, table.path, table.line, "effect.id"))
            continue
        effect = catalogue[table.id]
        if effect.of_robots:
            message = "is an effect of a robot; declare it in the profile of kind 'robot'"
            faults.append(Fault(message, table.path, table.line, f"effect {table.id}"))
            continue
        if not effect.repeatable and any(term.effect.id == effect.id for term in terms):
            message = "is declared twice; only an effect with an order may be repeated"
            faults.append(Fault(message, table.path, table.line, f"effect {table.id}"))
        values, wrong = values_of(effect, table)
        faults.extend(wrong)
        pulleys = getattr(profile, "pulley", ())
        if values.get("pulley", 0) > len(pulleys):
            message = f"is number {values['pulley']:g} of {len(pulleys)} [[pulley]] of the profile"
            faults.append(Fault(message, table.path, table.line, f"effect {effect.id}.pulley"))
        terms.append(Term(effect, values))
    return terms, faults


def not_in(catalogue: Catalogue, effect_id: str) -> str:
    """Message on an unknown effect, with similar names and the way to load a user effect."""
    near = suggest(effect_id, [effect.id for effect in catalogue])
    own = 'a user effect needs its file: --effects FILE.py, or effects = ["FILE.py"] in a bench'
    return f"no effect '{effect_id}'{near}; {own}"


def _shorthands(profile: WinchProfile, catalogue: Catalogue) -> Iterator[Term]:
    """Shorthand keys of a profile, whose names are those of the parameters, as effects."""
    for key, effect_id in SHORTHANDS.items():
        part, _, name = key.partition(".")
        value = getattr(getattr(profile, part), name)
        if value is not None:
            yield Term(catalogue[effect_id], catalogue[effect_id].null | {name: value})


def values_of(effect: Effect, table: EffectTable) -> tuple[dict[str, float], list[Fault]]:
    """Values of a table in SI, missing ones at their null, and their faults."""
    values, faults = dict(effect.null), []
    names = [p.name for p in effect.parameters]
    for key, raw in table.values.items():
        if key in _BESIDE_PARAMETERS:
            continue
        place = f"effect {effect.id}.{key}"
        if key not in names:
            message = f"unknown key; it has {', '.join(names)}{suggest(key, names)}"
            faults.append(Fault(message, table.path, table.line, place))
            continue
        try:
            values[key] = _quantity(raw, effect.parameter(key))
        except UsageError as error:
            faults.append(Fault(str(error), table.path, table.line, place))
    return values, faults


def _quantity(raw: object, parameter: Parameter) -> float:
    value = parse(raw, dimension_of(parameter.unit) or "ratio")
    if not parameter.low <= value <= parameter.high:
        raise UsageError(
            f"'{raw}' lies outside {parameter.low:g} to {parameter.high:g} {parameter.unit}"
        )
    if not (isfinite(value) or value == parameter.null):
        raise UsageError(f"'{raw}' must be finite")
    if parameter.whole and value != round(value):
        raise UsageError(f"'{raw}' must be a whole number")
    return value
