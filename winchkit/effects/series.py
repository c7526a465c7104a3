"""Harmonic series: one effect with several whole orders, and the same as single orders in files.

The parameters of the first order have the names of the effect, those of the n-th order the suffix
``_n``: ``amplitude``, ``phase``, ``order``, ``amplitude_2``, ``phase_2``, ``order_2``, …
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import gcd
from typing import Any

from winchkit.effects.effect import Parameter, Values
from winchkit.effects.term import Term
from winchkit.model.stages import At

_ORDER = "order"


def harmonic_series(terms: Sequence[Term]) -> Term:
    """Terms of one effect, single orders or series with the main order first, as one series."""
    singles = [single for term in terms for single, _ in single_orders(term)]
    if len(singles) == 1:
        return singles[0]
    single = singles[0].effect
    count = len(singles)

    def apply(value: Any, at: At, values: Values) -> Any:
        for index in range(count):
            own = {p.name: values[_numbered(p.name, index)] for p in single.parameters}
            value = single.apply(value, at, own)
        return value

    parameters = tuple(
        _at_order(parameter, index, term.values[_ORDER])
        for index, term in enumerate(singles)
        for parameter in single.parameters
    )
    values = {
        _numbered(name, index): value
        for index, term in enumerate(singles)
        for name, value in term.values.items()
    }
    return Term(replace(single, parameters=parameters, apply=apply, single=single), values)


def single_orders(
    term: Term, std: Mapping[str, float] | None = None
) -> Iterator[tuple[Term, dict[str, float]]]:
    """The orders of a term as terms of their own, each with its standard deviations."""
    std, single = dict(std or {}), term.effect.single
    if single is None:
        yield term, std
        return
    for index in range(len(term.effect.parameters) // len(single.parameters)):
        names = {p.name: _numbered(p.name, index) for p in single.parameters}
        values = {name: term.values[own] for name, own in names.items()}
        yield (Term(single, values), {name: std[own] for name, own in names.items() if own in std})


def orders_of(term: Term) -> tuple[int, ...]:
    """Whole orders of a term; empty for an effect without an order."""
    return tuple(
        int(single.values[_ORDER]) for single, _ in single_orders(term) if _ORDER in single.values
    )


def fundamentals(orders: Sequence[int]) -> tuple[int, ...]:
    """At most two numbers of which every order is a multiple, such as pole pairs and slots.

    The greatest common divisor where it is above 1; else the smallest order and the greatest common
    divisor of its non-multiples; empty where that is 1 or there are fewer than 3 orders.
    """
    if len(orders) < 3:
        return ()
    common = gcd(*orders)
    if common > 1:
        return (common,)
    first = min(orders)
    others = [order for order in orders if order % first]
    second = gcd(*others) if others else 1
    return (first, second) if first > 1 and second > 1 else ()


def _numbered(name: str, index: int) -> str:
    return name if index == 0 else f"{name}_{index + 1}"


def _at_order(parameter: Parameter, index: int, order: float) -> Parameter:
    """A parameter of one order of a series; the order itself does not change."""
    own = replace(parameter, name=_numbered(parameter.name, index))
    return replace(own, null=order, typical=order, grid=(order,)) if parameter.whole else own
