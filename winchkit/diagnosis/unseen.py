"""Whether the data could show at all by how much a richer law differs from the one that was found.

A straight law is a case of a bent one. Where no bend of a usual size would rise above the noise,
that the straight law is enough says nothing of the bend, and its name alone would claim to.
"""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.inquiry import Inquiry
from winchkit.diagnosis.noise import Noise, orthonormal
from winchkit.diagnosis.signature import Atom
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Effect

__all__ = ["is_unseen"]

_VISIBLE = 1.0
"""Noncentrality below which a difference is told from noise in one case of six."""
_MATTERS = 0.02
"""Share of the effect, rms: a bend that is less makes no difference to anyone."""


def is_unseen(inquiry: Inquiry, final: Fit, noise: Noise, index: int, rival: Effect) -> bool:
    """Whether a richer ``rival`` of the term at ``index``, in its usual shape and as large as
    that, would differ from it, though by less than the noise."""
    atom = _usual(inquiry, rival)
    if atom is None:
        return False
    problem, weight = inquiry.problem, noise.weight(inquiry.problem)
    hypothesis = final.hypothesis
    without = hypothesis.without(index)
    here = problem.change(without)
    own = (problem.change(hypothesis) - here) * weight
    explained = orthonormal(final.jacobian * weight[:, None])
    differs = False
    for secant in atom.secants:
        values = {**rival.null, **atom.shape, **secant}
        column = problem.change(without.with_term(Term(rival, values), problem.runs)) - here
        column = column * weight
        size = float(column @ column)
        column = column * (float(column @ own) / size) if size else column
        left = column - explained @ (explained.T @ column)
        if float(left @ left) > _VISIBLE:
            return False
        bend = column - own
        differs = differs or float(bend @ bend) > _MATTERS**2 * float(own @ own)
    return differs


def _usual(inquiry: Inquiry, effect: Effect) -> Atom | None:
    """The candidate's point of its grid that is nearest to its usual shape."""
    atoms = [a for a in inquiry.signatures.atoms if a.effect.id == effect.id]
    usual = {p.name: p.typical for p in Coordinates(effect).shapes}

    def away(atom: Atom) -> float:
        places = [(x, usual[name]) for name, x in atom.shape.items() if usual.get(name)]
        return float(sum(abs(np.log(x / typical)) for x, typical in places))

    return min(atoms, key=away, default=None)
