"""Doubt in what was found: names that a curve without any name beats are not given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.inquiry import Inquiry
from winchkit.diagnosis.nameless import Beside, Curve, best_curve
from winchkit.diagnosis.resolution import rounded
from winchkit.diagnosis.search import Found, without_term
from winchkit.diagnosis.verdict import Judgement, judge, withheld
from winchkit.effects.bind import Term

__all__ = ["judge_and_doubt"]

_SLIGHT = 1e-3
"""Share of what a name explains by which the physics of a real part may differ from its formula."""


def judge_and_doubt(inquiry: Inquiry, found: Found) -> Judgement:
    """The judgement of what was found, less the names that a nameless curve beats.

    All additions are doubted together, then each beside the others. One that is beaten is
    dropped; where too much is then left, nothing is named.
    """
    judgement = judge(inquiry, found)
    if judgement.verdict != "explained":
        return judgement
    final = found.final
    added = range(inquiry.given, len(final.hypothesis.terms))
    terms = final.hypothesis.terms[inquiry.given :]
    curve, _ = _beaten(inquiry, found, added)
    if curve:
        return withheld(inquiry, found, 1.0, _words(terms, terms, curve))
    for index in reversed(added) if len(added) > 1 else ():
        curve, taken = _beaten(inquiry, found, [index])
        if not curve:
            continue
        doubted = final.hypothesis.terms[index : index + 1]
        without = judge_and_doubt(inquiry, without_term(inquiry, found, index))
        if without.verdict == "explained":
            return replace(without, notes=(*without.notes, _words(doubted, doubted, curve)))
        share = taken / (_beside(inquiry, found, added).cost - _beside(inquiry, found, ()).cost)
        return withheld(inquiry, found, min(1.0, share), _words(terms, doubted, curve))
    return judgement


def _beside(inquiry: Inquiry, found: Found, indices: Sequence[int]) -> Beside:
    """What is left without some terms, the others free about where they are.

    Not fitted anew: a lag that stands in for a lost friction is far from where both are right.
    Nor is what sampling may have rounded held against a name.
    """
    problem, final = inquiry.problem, found.final
    hypothesis = final.hypothesis
    others, own = hypothesis, np.zeros(len(final.vector), dtype=bool)
    for index in sorted(indices, reverse=True):
        own |= problem.unknowns_of(index, hypothesis)
        others = others.without(index)
    lost = problem.change(hypothesis) - problem.change(others) if indices else 0.0
    free = np.column_stack([final.jacobian[:, ~own], rounded(problem, hypothesis)])
    return Beside(final.residual + lost, free, found.noise.weight(problem))


def _beaten(inquiry: Inquiry, found: Found, indices: Sequence[int]) -> tuple[Curve | None, float]:
    """A curve that pays better than terms do, if there is one; whitened squares they take."""
    problem, final = inquiry.problem, found.final
    terms = [final.hypothesis.terms[index] for index in indices]
    outputs = sorted({output for term in terms for output in term.effect.outputs})
    beside = _beside(inquiry, found, indices)
    taken = beside.cost - _beside(inquiry, found, ()).cost
    pays = taken - inquiry.price * inquiry.freedom(final.hypothesis, indices)
    curve = best_curve(problem, beside, outputs)
    if curve and curve.pays > pays + max(inquiry.price, _SLIGHT * taken):
        return curve, taken
    return None, taken


def _words(terms: Sequence[Term], doubted: Sequence[Term], curve: Curve) -> str:
    """Why names are not given."""
    place, variable = curve.place.replace("_", " "), curve.variable.replace("_", " ")
    than = "" if len(doubted) == len(terms) else f" than {_names(doubted)}"
    return (
        f"closest, but not named: {_names(terms)}; an unknown curve of the {place} over the "
        f"{variable} explains more{than}"
    )


def _names(terms: Sequence[Term]) -> str:
    return ", ".join(term.label for term in terms)
