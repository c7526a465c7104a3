"""What the winches of a recording have in common, and what one of them has alone.

Every winch is diagnosed by itself; here their answers are held beside each other. Whether all have
the same size of an effect is Cochran's test: if they have, the squares of their distances from the
common mean, in standard deviations, are chi-square distributed (Biometrics 10, 1954, 101). The mean
of winches that differ bears by how much they do (DerSimonian and Laird, Controlled Clinical Trials
7, 1986, 177).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from winchkit.arrays import Array
from winchkit.diagnosis.results import Diagnosis, Step
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect, Parameter

__all__ = ["Pooled", "SharedEffect", "alarms", "pooled", "shared_effects"]

_ALIKE = 0.01
"""Winches of one size seem to differ in one case of a hundred."""
_FEWEST = 3
"""Of two that differ neither is the odd one."""
_PART = 4
"""Of so many winches one may be odd: of more, some few agree by chance."""
Member = tuple[str, tuple[float, ...]]
"""An effect and its orders: cogging of two orders is two effects."""


@dataclass(frozen=True)
class Pooled:
    """One parameter of an effect over the winches that have it, SI."""

    value: float
    """Mean over the winches that agree; over all where most do not."""
    std: float
    """Of that mean."""
    unit: str
    spread: float
    """Standard deviation by which winches of that mean differ beyond their own uncertainties."""
    chi_square: float
    """Of all winches about their mean."""
    degrees_of_freedom: int
    p_value: float
    """That winches of one size differ so much; NaN with fewer than two."""
    apart: tuple[str, ...] = ()
    """The one or few winches that differ from all others, which agree."""

    @property
    def alike(self) -> bool:
        """Whether nothing speaks against one size in all winches."""
        return not self.p_value < _ALIKE


@dataclass(frozen=True)
class SharedEffect:
    """An effect that some winches have: which, and what of it they have in common."""

    effects: tuple[str, ...]
    """What no winch's runs exclude, as in a step of a diagnosis; the parsimonious one first."""
    winches: tuple[str, ...]
    """Winches in which it was found."""
    without: tuple[str, ...]
    """Winches that would have shown it at this size and do not have it."""
    unsure: tuple[str, ...]
    """Winches of which neither can be said."""
    parameters: Mapping[str, Pooled]
    """Of the first effect."""

    def to_json(self) -> dict[str, Any]:
        """As the command prints it."""
        parameters = {
            name: {**vars(p), "apart": list(p.apart)} for name, p in self.parameters.items()
        }
        return {
            "effects": list(self.effects),
            "winches": list(self.winches),
            "without": list(self.without),
            "unsure": list(self.unsure),
            "parameters": parameters,
        }


def shared_effects(
    found: Mapping[str, Diagnosis], catalogue: Catalogue
) -> tuple[SharedEffect, ...]:
    """Effects over winches (name to diagnosis), those of most winches first."""
    named = [(winch, step) for winch, answer in found.items() for step in answer.steps]
    out = [_shared(members, steps, found, catalogue) for members, steps in _together(named)]
    return tuple(sorted(out, key=lambda shared: -len(shared.winches)))


def alarms(found: Mapping[str, Diagnosis], chances: Mapping[str, float]) -> dict[str, float]:
    """How likely noise makes one of so many winches alarm as much as each that has no name.

    ``chances`` is how likely it makes that one winch (NaN where no repeat tells): of eight winches
    of which nothing is missing, one alarms eight times as often as one alone.
    """
    return {
        winch: 1 - (1 - min(chances[winch], 1.0)) ** len(found)
        for winch, one in found.items()
        if one.verdict in {"partly", "unknown"} and not one.steps and np.isfinite(chances[winch])
    }


def pooled(values: Mapping[str, tuple[float, float]], unit: str, *, reciprocal: bool) -> Pooled:
    """A mean over winches (name to value and standard deviation) and whether they agree.

    A ``reciprocal`` value is pooled as 1/value, in which its uncertainty is even.
    """
    names = list(values)
    x, s = np.array(list(values.values())).T
    if reciprocal:
        x, s = 1 / x, s / x**2
    square, p_value = _cochran(x, s)
    rest = _majority(x, s)
    mean, std, spread = _mean(x[rest], s[rest])
    if reciprocal:
        mean, std, spread = 1 / mean, std / mean**2, spread / mean**2
    apart = tuple(name for name, kept in zip(names, rest, strict=True) if not kept)
    return Pooled(mean, std, unit, spread, square, len(x) - 1, p_value, apart)


def _together(named: list[tuple[str, Step]]) -> Iterator[tuple[list[Member], dict[str, Step]]]:
    """Steps of several winches that may be one effect, and the effects that they all allow."""
    left = list(named)
    while left:
        in_winches: dict[Member, set[str]] = {}
        first: dict[Member, int] = {}
        for winch, step in left:
            for at, member in enumerate(_members(step)):
                in_winches.setdefault(member, set()).add(winch)
                first[member] = first.get(member, 0) + (at == 0)
        best = max(in_winches, key=lambda m: (len(in_winches[m]), first[m]))
        group: dict[str, Step] = {}
        for winch, step in left:
            if best in _members(step):
                group.setdefault(winch, step)
        others = [m for m in _members(next(iter(group.values()))) if m != best]
        yield (
            [best, *(m for m in others if all(m in _members(s) for s in group.values()))],
            group,
        )
        left = [(w, step) for w, step in left if group.get(w) is not step]


def _members(step: Step) -> list[Member]:
    return [
        (e, tuple(v.value for n, v in step.parameters.get(e, {}).items() if n == "order"))
        for e in step.effects
    ]


def _shared(
    members: Sequence[Member],
    steps: Mapping[str, Step],
    found: Mapping[str, Diagnosis],
    catalogue: Catalogue,
) -> SharedEffect:
    effect = catalogue[members[0][0]]
    parameters = {}
    for parameter in effect.parameters:
        # A phase counts from each winch's own zero.
        if not effect.polar or parameter.name != effect.polar[1]:
            told = _told(steps, effect.id, parameter.name)
            if told:
                unit, reciprocal = parameter.unit, parameter.reciprocal
                parameters[parameter.name] = pooled(told, unit, reciprocal=reciprocal)
    without: list[str] = []
    unsure: list[str] = []
    for winch, diagnosis in found.items():
        if winch not in steps:
            lacks = _would_show(diagnosis, effect, parameters) and not _kin(
                diagnosis, effect, catalogue
            )
            (without if lacks else unsure).append(winch)
    ids = tuple(name for name, _ in members)
    return SharedEffect(ids, tuple(steps), tuple(without), tuple(unsure), parameters)


def _told(steps: Mapping[str, Step], effect: str, name: str) -> dict[str, tuple[float, float]]:
    """Winches that know a value, with it and its standard deviation."""
    known = {w: s.parameters.get(effect, {}).get(name) for w, s in steps.items()}
    return {w: (e.value, e.std) for w, e in known.items() if e is not None and np.isfinite(e.std)}


def _would_show(diagnosis: Diagnosis, effect: Effect, size: Mapping[str, Pooled]) -> bool:
    """Whether a winch that was not found to have an effect of this size would have shown it."""
    if diagnosis.verdict in {"partly", "unknown"}:
        return False
    for shown in diagnosis.detectable:
        if shown.effect == effect.id and shown.parameter in size:
            parameter = effect.parameter(shown.parameter)
            there = _from_null(size[shown.parameter].value, parameter)
            return bool(there >= _from_null(shown.smallest, parameter))
    return False


def _kin(diagnosis: Diagnosis, effect: Effect, catalogue: Catalogue) -> bool:
    """Whether something was found that may be this effect by another law or name."""
    named = [catalogue[name] for step in diagnosis.steps for name in step.effects]
    return any(
        (effect.family and other.family == effect.family)
        or other.id in effect.confused_with
        or effect.id in other.confused_with
        for other in named
    )


def _from_null(value: float, parameter: Parameter) -> float:
    return abs(1 / value) if parameter.reciprocal else abs(value - parameter.null)


def _cochran(x: Array, s: Array) -> tuple[float, float]:
    """Chi-square of values about their weighted mean, and how likely it is by chance."""
    if len(x) < 2 or not np.all(s > 0):
        return 0.0, float("nan")
    weight = 1 / s**2
    square = float(np.sum(weight * (x - np.average(x, weights=weight)) ** 2))
    return square, float(chi2.sf(square, len(x) - 1))


def _majority(x: Array, s: Array) -> NDArray[np.bool_]:
    """Winches left when one, or a quarter, is taken away so that the rest agree; else all."""
    kept = np.ones(len(x), dtype=bool)
    while _cochran(x[kept], s[kept])[1] < _ALIKE:
        if len(x) < _FEWEST or (~kept).sum() >= max(1, len(x) // _PART):
            return np.ones(len(x), dtype=bool)
        kept[_worst(x, s, kept)] = False
    return kept


def _worst(x: Array, s: Array, kept: NDArray[np.bool_]) -> int:
    """The winch whose absence brings the others nearest to agreement."""
    squares = {}
    for index in np.flatnonzero(kept):
        without = kept.copy()
        without[index] = False
        squares[int(index)] = _cochran(x[without], s[without])[0]
    return min(squares, key=lambda index: squares[index])


def _mean(x: Array, s: Array) -> tuple[float, float, float]:
    """Mean, its standard deviation, and the spread between winches beyond their uncertainties."""
    if len(x) == 1 or not np.all(s > 0):
        return float(x[0]), float(s[0]), 0.0
    weight = 1 / s**2
    square, _ = _cochran(x, s)
    common = weight.sum() - np.sum(weight**2) / weight.sum()
    between = max(0.0, (square - (len(x) - 1)) / float(common))
    weight = 1 / (s**2 + between)
    mean = float(np.average(x, weights=weight))
    return mean, float(1 / np.sqrt(weight.sum())), float(np.sqrt(between))
