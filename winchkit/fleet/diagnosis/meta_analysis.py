"""Meta-analysis over several winches: which effects they share, and whether of one size.

Every winch is diagnosed by itself. Homogeneity of a parameter is tested by Cochran's Q, which is
χ²(winches − 1) under one common value; means of heterogeneous winches take a variance between
winches by the moment estimate of DerSimonian and Laird.

References
----------
Cochran, W. G. (1954). Biometrics 10, 101-129.
DerSimonian, R., Laird, N. (1986). Controlled Clinical Trials 7, 177-188.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.results import Diagnosis, Place, Step
from winchkit.diagnosis.steps import place_text
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect, Parameter

_HOMOGENEITY_LEVEL = 0.01
"""Level of the homogeneity test."""
_LEAST_WINCHES = 3
"""Winches from which one may be outlying: of two that differ neither is."""
WINCHES_PER_OUTLYING = 4
"""At most one in this many winches may be outlying: of more, a few agree by chance."""
Member = tuple[str, tuple[float, ...]]
"""An effect with its orders, since cogging of two orders counts as two effects, or a place."""
_DECIDED = frozenset({"adequate", "explained"})
"""Verdicts beside which an effect that was not found is absent."""


@dataclass(frozen=True)
class Pooled:
    """Meta-analysis of one parameter of an effect, SI."""

    value: float
    """Mean over the homogeneous winches; over all where most are heterogeneous."""
    std: float
    """Standard deviation of the mean."""
    unit: str
    spread: float
    """Standard deviation between these winches (DerSimonian and Laird)."""
    chi_square: float
    """Cochran's Q of all winches."""
    degrees_of_freedom: int
    p_value: float
    """P-value of homogeneity; NaN with fewer than two winches."""
    outlying: tuple[str, ...] = ()
    """Outlying winches, without which the others are homogeneous."""

    @property
    def homogeneous(self) -> bool:
        """Whether homogeneity is not rejected at 1 %."""
        return not self.p_value < _HOMOGENEITY_LEVEL

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints; the outlying winches are its ``apart``."""
        values = {key: value for key, value in vars(self).items() if key != "outlying"}
        return {**values, "apart": list(self.outlying)}


@dataclass(frozen=True)
class SharedEffect:
    """An effect of some winches, and its parameters over them."""

    effects: tuple[str, ...]
    """Effects that remain possible for all of these winches, fewest parameters first; where
    only their place is common, the most frequent one."""
    winches: tuple[str, ...]
    """Winches in which it was found."""
    without: tuple[str, ...]
    """Winches whose runs would have detected this size and did not."""
    unsure: tuple[str, ...]
    """Winches about which neither can be said."""
    parameters: Mapping[str, Pooled]
    """Of the first effect."""
    place: Place | None = None
    """Where the steps act; None for effects without one."""
    by_place: bool = False
    """Whether only the place is common to these winches, and no effect."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        parameters = {
            name: pooled_parameter.to_json() for name, pooled_parameter in self.parameters.items()
        }
        return {
            "effects": list(self.effects),
            "place": None if self.place is None else vars(self.place),
            "by_place": self.by_place,
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
    return tuple(sorted(out, key=lambda effect: -len(effect.winches)))


def alarms(found: Mapping[str, Diagnosis], chances: Mapping[str, float]) -> dict[str, float]:
    """Probability 1 − (1 − p)^winches that noise alone makes at least one of all winches alarm
    (Šidák), of each winch with an alarm and without a step; p of lack of fit, NaN without
    repeats."""
    return {
        winch: 1 - (1 - min(chances[winch], 1.0)) ** len(found)
        for winch, one in found.items()
        if one.verdict not in _DECIDED and not one.steps and np.isfinite(chances[winch])
    }


def pooled(values: Mapping[str, tuple[float, float]], unit: str, *, reciprocal: bool) -> Pooled:
    """Mean over winches with homogeneity test and outlying winches; of 1/value where it is
    ``reciprocal``, in which the uncertainty is symmetric."""
    names = list(values)
    x, s = np.array(list(values.values())).T
    if reciprocal:
        x, s = 1 / x, s / x**2
    q, p_value = _cochran(x, s)
    rest = _homogeneous_subset(x, s)
    mean, std, spread = _mean(x[rest], s[rest])
    if reciprocal:
        mean, std, spread = 1 / mean, std / mean**2, spread / mean**2
    outlying = tuple(name for name, kept in zip(names, rest, strict=True) if not kept)
    return Pooled(mean, std, unit, spread, q, len(x) - 1, p_value, outlying)


def _together(named: list[tuple[str, Step]]) -> Iterator[tuple[list[Member], dict[str, Step]]]:
    """Steps of several winches that may be one effect, and the effects that all of them allow."""
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
        first_names = _names(next(iter(group.values())))
        common = [m for m in first_names if all(m in _names(s) for s in group.values())]
        yield sorted(common, key=lambda member: member != best), group
        left = [(w, step) for w, step in left if group.get(w) is not step]


def _members(step: Step) -> list[Member]:
    """What a step is followed by: a certain one by its name, another one by its place first."""
    if step.certain:
        return _names(step)[:1]
    places: list[Member] = [(place_text(step), ())] if step.place else []
    return [*places, *_names(step)]


def _names(step: Step) -> list[Member]:
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
    place = next((step.place[0] for step in steps.values() if step.place), None)
    by_place = not members
    if by_place:
        names = Counter(_names(step)[0] for step in steps.values())
        members = [max(names, key=names.__getitem__)]
    effect = catalogue[members[0][0]]
    parameters = {}
    for parameter in effect.parameters:
        # A phase refers to the zero of each winch and is not pooled.
        if not effect.polar or parameter.name != effect.polar[1]:
            known = _known_values(steps, effect.id, parameter.name)
            if known:
                unit, reciprocal = parameter.unit, parameter.reciprocal
                parameters[parameter.name] = pooled(known, unit, reciprocal=reciprocal)
    without: list[str] = []
    doubtful: list[str] = []
    for winch, diagnosis in found.items():
        if winch not in steps:
            absent = _would_detect(diagnosis, effect, parameters) and not _named_as_confusable(
                diagnosis, effect, catalogue
            )
            (without if absent else doubtful).append(winch)
    ids = tuple(name for name, _ in members)
    return SharedEffect(
        ids, tuple(steps), tuple(without), tuple(doubtful), parameters, place, by_place
    )


def _known_values(
    steps: Mapping[str, Step], effect: str, name: str
) -> dict[str, tuple[float, float]]:
    """Winches with a known value: name to value and standard deviation."""
    known = {w: s.parameters.get(effect, {}).get(name) for w, s in steps.items()}
    return {w: (e.value, e.std) for w, e in known.items() if e is not None and np.isfinite(e.std)}


def _would_detect(diagnosis: Diagnosis, effect: Effect, size: Mapping[str, Pooled]) -> bool:
    """Whether the runs of a winch would have detected an effect of this size."""
    if diagnosis.verdict not in _DECIDED:
        return False
    for shown in diagnosis.detectable:
        if shown.effect == effect.id and shown.parameter in size:
            parameter = effect.parameter(shown.parameter)
            there = _from_null(size[shown.parameter].value, parameter)
            return bool(there >= _from_null(shown.smallest, parameter))
    return False


def _named_as_confusable(diagnosis: Diagnosis, effect: Effect, catalogue: Catalogue) -> bool:
    """Whether a found effect may be this one under another law or name."""
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
    """Cochran's Q and its p-value."""
    if len(x) < 2 or not np.all(s > 0):
        return 0.0, float("nan")
    weight = 1 / s**2
    q = float(np.sum(weight * (x - np.average(x, weights=weight)) ** 2))
    return q, float(chdtrc(len(x) - 1, q))


def _homogeneous_subset(x: Array, s: Array) -> NDArray[np.bool_]:
    """Homogeneous winches after removal of one, or a quarter; all where that fails."""
    kept = np.ones(len(x), dtype=bool)
    while _cochran(x[kept], s[kept])[1] < _HOMOGENEITY_LEVEL:
        if len(x) < _LEAST_WINCHES or (~kept).sum() >= max(1, len(x) // WINCHES_PER_OUTLYING):
            return np.ones(len(x), dtype=bool)
        kept[_most_outlying(x, s, kept)] = False
    return kept


def _most_outlying(x: Array, s: Array, kept: NDArray[np.bool_]) -> int:
    """Winch whose removal decreases Q most."""
    q_without = {}
    for index in np.flatnonzero(kept):
        without = kept.copy()
        without[index] = False
        q_without[int(index)] = _cochran(x[without], s[without])[0]
    return min(q_without, key=lambda index: q_without[index])


def _mean(x: Array, s: Array) -> tuple[float, float, float]:
    """Mean, its standard deviation, and the standard deviation between winches."""
    if len(x) == 1 or not np.all(s > 0):
        return float(x[0]), float(s[0]), 0.0
    weight = 1 / s**2
    q, _ = _cochran(x, s)
    common = weight.sum() - np.sum(weight**2) / weight.sum()
    between = max(0.0, (q - (len(x) - 1)) / float(common))
    weight = 1 / (s**2 + between)
    mean = float(np.average(x, weights=weight))
    return mean, float(1 / np.sqrt(weight.sum())), float(np.sqrt(between))
