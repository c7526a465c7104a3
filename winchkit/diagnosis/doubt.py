"""Doubt in what was found: names that a curve without any name beats are not given."""

from __future__ import annotations

from collections.abc import Iterator

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.inquiry import Inquiry
from winchkit.diagnosis.nameless import Curve, best_curve
from winchkit.diagnosis.search import Found
from winchkit.diagnosis.verdict import Judgement, withheld
from winchkit.effects.bind import Term

__all__ = ["doubted"]

_SLIGHT = 1e-3
"""Share of what a name explains by which the physics of a real part may differ from its formula."""


def doubted(inquiry: Inquiry, found: Found, judgement: Judgement) -> Judgement:
    """The judgement, or one that names nothing where a nameless curve explains more.

    Every addition is doubted alone, beside the others, and all of them together.
    """
    if judgement.verdict != "explained":
        return judgement
    final, noise = found.final, found.noise
    added = final.hypothesis.terms[inquiry.given :]
    whole = inquiry.refit(found.begin.hypothesis, noise)
    for terms, base in _without(inquiry, found, whole):
        outputs = sorted({output for term in terms for output in term.effect.outputs})
        curve = best_curve(inquiry.problem, base, noise, outputs, inquiry.price)
        pays = inquiry.criterion(base) - inquiry.criterion(final)
        if curve and curve.pays > pays + max(inquiry.price, _SLIGHT * pays):
            share = (base.cost - final.cost) / (whole.cost - final.cost)
            others = [term.label for term in added if term not in terms]
            return withheld(inquiry, found, min(1.0, share), _words(terms, others, curve))
    return judgement


def _without(inquiry: Inquiry, found: Found, whole: Fit) -> Iterator[tuple[list[Term], Fit]]:
    """What is doubted together, and the fit without it."""
    hypothesis = found.final.hypothesis
    added = range(inquiry.given, len(hypothesis.terms))
    yield list(hypothesis.terms[inquiry.given :]), whole
    for index in added if len(added) > 1 else ():
        base = inquiry.refit(hypothesis.without(index), found.noise)
        yield [hypothesis.terms[index]], base


def _words(terms: list[Term], others: list[str], curve: Curve) -> str:
    """Why nothing is named."""
    names = ", ".join(term.label for term in terms)
    place, variable = curve.place.replace("_", " "), curve.variable.replace("_", " ")
    beside = f" beside {', '.join(others)}" if others else ""
    return (
        f"closest, but not named: {names}{beside}; an unknown curve of the {place} over the "
        f"{variable} explains more than that does"
    )
