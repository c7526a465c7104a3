"""Which effects the data cannot tell apart from the ones found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from winchkit.arrays import Array
from winchkit.diagnosis.regression.cross_validation import held_out
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.exchange import Exchange
from winchkit.diagnosis.selection.scores import Projected
from winchkit.diagnosis.selection.signatures import Candidate
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = [
    "Confusion",
    "confusion_of",
    "is_unseen",
    "pairs_of",
]

_VISIBLE = 1.0
"""Noncentrality below which a difference is told from noise in one case of six."""
_MATTERS = 0.02
"""Share of the effect, rms: a bend that is less makes no difference to anyone."""


def is_unseen(engine: SelectionEngine, final: Fit, noise: Noise, index: int, rival: Effect) -> bool:
    """Whether a richer ``rival`` of the term at ``index``, in its usual shape and as large as
    that, would differ from it, though by less than the noise."""
    candidate = _usual(engine, rival)
    if candidate is None:
        return False
    regression, inverse_sigma = engine.regression, noise.inverse_sigma(engine.regression)
    hypothesis = final.hypothesis
    without = hypothesis.without(index)
    here = regression.change(without)
    own = (regression.change(hypothesis) - here) * inverse_sigma
    explained = orthonormal(final.jacobian * inverse_sigma[:, None])
    differs = False
    for usual_step in candidate.usual_steps:
        values = {**rival.null, **candidate.shape, **usual_step}
        column = regression.change(without.with_term(Term(rival, values), regression.n_runs)) - here
        column = column * inverse_sigma
        size = float(column @ column)
        column = column * (float(column @ own) / size) if size else column
        left = column - explained @ (explained.T @ column)
        if float(left @ left) > _VISIBLE:
            return False
        bend = column - own
        differs = differs or float(bend @ bend) > _MATTERS**2 * float(own @ own)
    return differs


def _usual(engine: SelectionEngine, effect: Effect) -> Candidate | None:
    """The candidate's point of its grid that is nearest to its usual shape."""
    candidates = [a for a in engine.signatures.candidates if a.effect.id == effect.id]
    usual = {p.name: p.typical for p in Coordinates(effect).shapes}

    def away(candidate: Candidate) -> float:
        places = [(x, usual[name]) for name, x in candidate.shape.items() if usual.get(name)]
        return float(sum(abs(np.log(x / typical)) for x, typical in places))

    return min(candidates, key=away, default=None)


_RIVALS = 6
_NEAR = 40.0
_ALIKE = 9.0
"""Squares by which what is true may be worse than what is not: by chance in one case of 700."""
_SHARE = 0.5
_NEARLY = 0.75
_LEVEL = 0.05
_FLIPS = 2000


@dataclass(frozen=True)
class Confusion:
    """One step: the set of effects that explain the data alike, the parsimonious one first."""

    term: Term
    effects: tuple[str, ...]
    terms: tuple[Term, ...]
    """Each member with its fitted values, in the same order."""
    angles: dict[str, float]
    """Angle between its signature and each rival's, rad."""


def confusion_of(engine: SelectionEngine, final: Fit, noise: Noise, index: int) -> Confusion:
    """Refit the final model with each rival in place of one term, and compare block by block."""
    place = Exchange(engine, final, noise, index)
    own, base, scores = place.own, place.base, place.scores
    mine = next((s.explained_ss for s in scores if s.candidate.effect.id == own.effect.id), 0.0)
    n_parameters = Coordinates(own.effect).n_parameters
    rivals = [
        s
        for s in scores
        if s.candidate.effect.id != own.effect.id and s.explained_ss > mine - max(_NEAR, 0.1 * mine)
    ][:_RIVALS]
    rivals += [
        s for s in scores if _drifts_alike(s.candidate.effect, own.effect) and s not in rivals
    ]
    blocks = engine.regression.blocks
    ours = held_out(engine.regression, final, noise, blocks)
    members: list[tuple[int, float, Term]] = [(n_parameters, final.chi_square, own)]
    for rival in rivals:
        trial = place.trial(rival, final.chi_square + _ALIKE)
        fitted = trial.fit
        if not np.isfinite(trial.criterion):
            continue
        if base.chi_square - fitted.chi_square < _SHARE * (base.chi_square - final.chi_square):
            continue
        term = fitted.hypothesis.terms[-1]
        size = Coordinates(term.effect).n_parameters
        counted = _richer(engine, final, noise, index, fitted)
        if counted is None:
            theirs = held_out(engine.regression, fitted, noise, blocks)
            alike = fitted.chi_square < final.chi_square + _ALIKE
            counted = alike or _flip_chance(theirs - ours) > _LEVEL
        if counted or _stands_for(engine, fitted, final, base, index):
            members.append((size, fitted.chi_square, term))
    ordered = [term for _, _, term in sorted(members, key=lambda m: (m[0], round(m[1], 3)))]
    projected = engine.projected(base, noise)
    angles = {
        term.effect.id: _angle(projected, own.effect.id, term.effect.id)
        for term in ordered
        if term.effect.id != own.effect.id
    }
    return Confusion(own, tuple(t.effect.id for t in ordered), tuple(ordered), angles)


def _richer(
    engine: SelectionEngine, final: Fit, noise: Noise, index: int, fitted: Fit
) -> bool | None:
    """Whether a rival with more numbers counts; None where it has no more, or is kindred.

    A carded one that explains as much counts: creep beside a drift with temperature, a guide whose
    detour is as straight as a wrong ratio. Only the prior belief in few numbers would tell them
    apart, and no run yet.
    """
    own, rival = final.hypothesis.terms[index].effect, fitted.hypothesis.terms[-1].effect
    more = Coordinates(rival).n_parameters - Coordinates(own).n_parameters
    if more > 0 and _carded(rival, own) and not rival.nested_with(own):
        return fitted.chi_square < final.chi_square + _ALIKE
    if more > 0 and not _kindred(rival, own):
        bent = engine.regression.has_known_loads and own.id in rival.contains
        return _leant_to(final, fitted, more) or (
            bent and is_unseen(engine, final, noise, index, rival)
        )
    return None


def _stands_for(engine: SelectionEngine, fitted: Fit, final: Fit, base: Fit, index: int) -> bool:
    """Whether a simpler law of the family is what the runs show, as far as they get.

    A Stribeck curve whose extra never falls within the runs is a dry friction that is not quite
    constant: for which of many reasons they do not tell.
    """
    own, rival = final.hypothesis.terms[index], fitted.hypothesis.terms[-1].effect
    shown = own.effect.visible
    if shown is None or any(shown(at, own.values) for at in engine.regression.motions):
        return False
    simpler = Coordinates(rival).n_parameters < Coordinates(own.effect).n_parameters
    related = bool(own.effect.family) and rival.family == own.effect.family
    return (
        simpler
        and related
        and base.chi_square - fitted.chi_square > _NEARLY * (base.chi_square - final.chi_square)
    )


def _kindred(rival: Effect, own: Effect) -> bool:
    """Whether one law of a family may stand for the other, neither being a case of the other."""
    return bool(own.family) and rival.family == own.family and not rival.nested_with(own)


def _carded(rival: Effect, own: Effect) -> bool:
    """Whether the cards say that one is easily taken for the other."""
    return rival.id in own.confused_with or own.id in rival.confused_with


def _leant_to(simple: Fit, rich: Fit, more: int) -> bool:
    """Whether the data lean to a law with more unknowns, though not enough to ask for it.

    Such a law is worth its price only far beyond chance. Between the two the simple name alone
    would claim what the data rather deny.
    """
    states = [sum(len(start) for start in f.hypothesis.starts) for f in (simple, rich)]
    unknowns = max(1, more + states[1] - states[0])
    return bool(chi2.sf(simple.chi_square - rich.chi_square, unknowns) < _LEVEL)


def _drifts_alike(rival: Effect, own: Effect) -> bool:
    """Whether a rival that creeps is, by the cards, easily taken for this effect."""
    creeps = rival.memory and any(p.role == "shape" and p.unit == "s" for p in rival.parameters)
    return creeps and _carded(rival, own)


def _flip_chance(worse: Array) -> float:
    """Chance that a rival's blocks are worse by this much on average, by flipping signs."""
    random = np.random.default_rng(1)
    signs = random.choice([-1.0, 1.0], size=(_FLIPS, len(worse)))
    return float(np.mean(signs @ worse >= worse.sum()))


def _angle(projected: Projected, first: str, second: str) -> float:
    """Smallest angle between the whitened, projected signatures of two effects, rad."""
    best = 0.0
    candidates = projected.signatures.candidates
    for a in (candidate for candidate in candidates if candidate.effect.id == first):
        for b in (candidate for candidate in candidates if candidate.effect.id == second):
            best = max(best, _cosine(projected.inner, a.columns, b.columns))
    return float(np.arccos(min(1.0, best)))


def _cosine(inner: Array, a: slice, b: slice) -> float:
    """Largest canonical correlation of two sets of columns."""
    roots = []
    for own in (a, b):
        values, vectors = np.linalg.eigh(inner[own, own])
        kept = values > 1e-12 * max(float(values[-1]), 1e-300)
        roots.append(vectors[:, kept] / np.sqrt(values[kept]))
    across = roots[0].T @ inner[a, b] @ roots[1]
    return float(np.linalg.svd(across, compute_uv=False)[0]) if across.size else 0.0


def pairs_of(sets: Sequence[Confusion]) -> list[tuple[Term, Term]]:
    """The effects that runs so far cannot tell apart, two by two."""
    return [(c.term, rival) for c in sets for rival in c.terms if rival is not c.term]
