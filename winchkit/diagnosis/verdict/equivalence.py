"""Equivalence sets: effects that these runs cannot distinguish from the named ones.

Each rival is refitted in the place of the named effect, under the larger of the noise and of what
the named model leaves unexplained (quasi-likelihood). It joins the set if Δχ² is below the square
of a quantile of t, 9 for well-known variances, or if its held-out losses per block are not
significantly larger by a sign-flip test at 5 %; a law with more parameters if a likelihood-ratio
test is significant although BIC prefers the simpler one, or if its curvature is not detectable.
Waves over the motor angle join where they differ by the load alone and the runs have one.

References
----------
Pitman, E. J. G. (1937). J. R. Statist. Soc. Suppl. 4, 119-130.
Wedderburn, R. W. M. (1974). Biometrika 61, 439-447.
Wilks, S. S. (1938). Ann. Math. Statist. 9, 60-62.
Hansen, P. R., Lunde, A., Nason, J. M. (2011). Econometrica 79, 453-497.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.regression.cross_validation import held_out
from winchkit.diagnosis.regression.dispersion import (
    excess_p_value,
    fits_worse,
    largest_loss,
    overdispersed,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.exchange import Exchange
from winchkit.diagnosis.selection.orders import has_orders
from winchkit.diagnosis.selection.scores import Projected
from winchkit.diagnosis.selection.signatures import Candidate
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = [
    "EquivalenceSet",
    "equivalence_set",
    "is_below_noise",
    "pairs_of",
]

_LEAST_NONCENTRALITY = 1.0
"""Noncentrality below which a difference is significant at 5 % in at most one case of six."""
_LEAST_DIFFERENCE = 0.02
"""Rms difference over the effect below which it is negligible."""
_MOST_RIVALS = 6
"""Rivals that are refitted."""
_SCORE_MARGIN = 40.0
"""Explained χ² below that of the named effect, within which a rival is refitted."""
_LEAST_SHARE = 0.5
"""Share of the named effect's decrease of χ² that a rival must reach."""
_SHARE_OF_SIMPLER_LAW = 0.75
"""Share of the decrease of χ² from which a simpler law of the family joins the set."""
_TORQUE = {"motor_torque"}
_ONE_LOAD = 0.2
"""Range of the cable's force over its median up to which the runs have one load: less changes a
wave by less than the tenth that establishes a law."""
_LEVEL = 0.05
"""Level of the sign-flip and of the likelihood-ratio test; convention."""
_INCOMPLETE = 0.25
"""Level of the preliminary test that the residual of the final model does not exceed the noise."""
_SIGN_FLIPS = 2000
"""Sign flips; computing cost; a p-value of 5 % has a standard error of 0.5 %."""


def is_below_noise(
    engine: SelectionEngine, final: Fit, noise: Noise, index: int, rival: Effect
) -> bool:
    """Whether a richer ``rival`` differs from the term at ``index``, though not detectably.

    The rival has its usual shape and the size of the term. It differs by more than 2 % rms, and the
    noncentrality of the difference, fitted unknowns projected out, is below 1.
    """
    candidate = _usual(engine, rival)
    if candidate is None:
        return False
    regression, inverse_sigma = engine.regression, noise.inverse_sigma(engine.regression)
    hypothesis = final.hypothesis
    without = hypothesis.without(index)
    base_change = regression.change(without)
    own = (regression.change(hypothesis) - base_change) * inverse_sigma
    explained = orthonormal(final.jacobian * inverse_sigma[:, None])
    differs = False
    for usual_step in candidate.usual_steps:
        values = {**rival.null, **candidate.shape, **usual_step}
        column = (
            regression.change(without.with_term(Term(rival, values), regression.n_runs))
            - base_change
        )
        column = column * inverse_sigma
        size = float(column @ column)
        column = column * (float(column @ own) / size) if size else column
        remaining = column - explained @ (explained.T @ column)
        if float(remaining @ remaining) > _LEAST_NONCENTRALITY:
            return False
        difference = column - own
        differs = differs or float(difference @ difference) > _LEAST_DIFFERENCE**2 * float(
            own @ own
        )
    return differs


def _usual(engine: SelectionEngine, effect: Effect) -> Candidate | None:
    """Candidate at the grid point nearest to its usual shape."""
    candidates = [a for a in engine.signatures.candidates if a.effect.id == effect.id]
    usual = {p.name: p.typical for p in Coordinates(effect).shapes}

    def distance(candidate: Candidate) -> float:
        ratios = [(x, usual[name]) for name, x in candidate.shape.items() if usual.get(name)]
        return float(sum(abs(np.log(x / typical)) for x, typical in ratios))

    return min(candidates, key=distance, default=None)


@dataclass(frozen=True)
class EquivalenceSet:
    """Equivalence set of one addition, in an order that does not depend on noise.

    Effects with the fewest parameters first, of these the ones that the data do not reject against
    the best of them, those with the fewest measured inputs first, in the order of the
    catalogue.
    """

    term: Term
    effects: tuple[str, ...]
    terms: tuple[Term, ...]
    """Each member with its fitted values, in the same order."""
    fits: tuple[Fit, ...]
    """Fit of each member beside all other effects."""
    angles: dict[str, float]
    """Angle between its signature and each rival's, rad."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """Further effect beside which a member explains as much, for members that need one."""

    def beginning_with(self, effect: str) -> EquivalenceSet:
        """The same set with another member first, beside which the others are compared."""
        order = sorted(range(len(self.effects)), key=lambda i: self.effects[i] != effect)
        terms = tuple(self.terms[i] for i in order)
        fits = tuple(self.fits[i] for i in order)
        names = tuple(self.effects[i] for i in order)
        return replace(self, term=terms[0], effects=names, terms=terms, fits=fits)

    def only(self, effects: Collection[str]) -> EquivalenceSet:
        """The same set without other members than ``effects``."""
        kept = [i for i, effect in enumerate(self.effects) if effect in effects]
        terms, fits = [self.terms[i] for i in kept], [self.fits[i] for i in kept]
        own = self.term if self.term in terms else terms[0]
        names = tuple(term.effect.id for term in terms)
        # Angles from the signature of an effect that has left the set are not those of another.
        angles = {n: self.angles[n] for n in names if n in self.angles and self.term in terms}
        beside = {n: self.beside[n] for n in names if n in self.beside}
        return EquivalenceSet(own, names, tuple(terms), tuple(fits), angles, beside)


def equivalence_set(
    engine: SelectionEngine, final: Fit, noise: Noise, index: int
) -> EquivalenceSet:
    """Equivalence set of one term of the final model.

    Parameters
    ----------
    engine
        Data, candidates and folds of the search.
    final, noise
        Final fit and its noise.
    index
        Of the term in the hypothesis.

    Returns
    -------
    EquivalenceSet
        Members with their fits.

    Notes
    -----
    All fits are compared under the larger of the noise and of the final model's residual, per band
    (:func:`~winchkit.diagnosis.regression.dispersion.overdispersed`): what the final model leaves
    unexplained is no evidence for one of two rivals. Of a true and a wrong effect the true one
    loses more than t² times the variance with probability at most 1/740, t being the quantile for
    the degrees of freedom of the variances in which the two differ.

    Where, without repeats, the final model may leave more than the noise, another effect may be
    missing. A rival that is worse alone then joins the set, after all others, if it predicts blocks
    of time as well beside the further effect that explains most of what it leaves: gravity beside a
    friction that is an offset in runs of one direction.

    Every rival is compared with the named effect at 5 % by itself; there is no correction for the
    number of rivals. A rival must reach half of the named effect's decrease of χ².
    """
    dispersed = overdispersed(engine.regression, final, noise)
    own_fit = engine.refit(final.hypothesis, dispersed)
    exchange = Exchange(engine, own_fit, dispersed, index)
    own, base, scores = final.hypothesis.terms[index], exchange.base, exchange.scores
    own_explained_ss = next(
        (s.explained_ss for s in scores if s.candidate.effect.id == own.effect.id), 0.0
    )
    rivals = [
        s
        for s in scores
        if s.candidate.effect.id != own.effect.id
        and s.explained_ss > own_explained_ss - max(_SCORE_MARGIN, 0.1 * own_explained_ss)
    ][:_MOST_RIVALS]
    rivals += [
        s
        for s in scores
        if _confusable_by_drift(s.candidate.effect, own.effect) and s not in rivals
    ]
    own_losses = held_out(engine.regression, own_fit, dispersed, engine.regression.blocks)
    least = base.chi_square - _LEAST_SHARE * (base.chi_square - own_fit.chi_square)
    goal = own_fit.chi_square + largest_loss(np.inf)
    aim = own_fit.chi_square + largest_loss(float(dispersed.dof.min()))
    compared, worse = [own_fit], list[Fit]()
    for rival in rivals:
        trial = exchange.trial(rival, goal, least, aim)
        fitted = trial.fit
        if not np.isfinite(trial.criterion) or fitted.chi_square > least:
            continue
        joins = _richer_law_joins(engine, own_fit, dispersed, index, fitted)
        if joins is None:
            joins = (
                _waves_of_one_load(engine, own.effect, rival.candidate.effect)
                or not fits_worse(engine.regression, fitted, own_fit, dispersed)
                or _predicts_as_well(engine, fitted, own_losses, dispersed)
            )
        if joins or _reduces_to(engine, fitted, own_fit, base, index):
            compared.append(fitted)
        else:
            worse.append(fitted)
    members = [
        _Member(own, final, own_fit) if f is own_fit else _Member(f.hypothesis.terms[-1], f, f)
        for f in compared
    ]
    members = _ordered(engine, members, dispersed)
    if not noise.from_repeats and excess_p_value(engine.regression, final, noise) < _INCOMPLETE:
        alone = [member.term.effect for member in members]
        beside = [_beside_another(engine, rival, alone, dispersed) for rival in worse]
        members += [
            member
            for member in beside
            if member is not None
            and _predicts_as_well(engine, member.compared, own_losses, dispersed)
        ]
    projected = engine.projected(base, dispersed)
    angles = {
        member.term.effect.id: _angle(projected, own.effect.id, member.term.effect.id)
        for member in members
        if member.term.effect.id != own.effect.id
    }
    terms = tuple(member.term for member in members)
    fits = tuple(member.fit for member in members)
    further = {m.term.effect.id: m.beside for m in members if m.beside}
    return EquivalenceSet(own, tuple(t.effect.id for t in terms), terms, fits, angles, further)


@dataclass(frozen=True)
class _Member:
    term: Term
    """The effect with its values."""
    fit: Fit
    """Fit that is reported: of the named effect the final one."""
    compared: Fit
    """Fit under the variances of the comparison."""
    beside: str = ""
    """Further effect without which it explains less."""


def _predicts_as_well(engine: SelectionEngine, rival: Fit, losses: Array, noise: Noise) -> bool:
    """Whether held-out losses per block are not significantly larger than those of another fit."""
    own = held_out(engine.regression, rival, noise, engine.regression.blocks)
    return _sign_flip_p_value(own - losses) > _LEVEL


def _beside_another(
    engine: SelectionEngine, rival: Fit, members: Sequence[Effect], noise: Noise
) -> _Member | None:
    """A rival with the further effect that explains most of what it leaves; None without one.

    The further effect is no member of the set and contains none: that would explain the same
    without the rival.
    """
    own = rival.hypothesis.terms[-1]
    for item in engine.scores(rival, noise):
        effect = item.candidate.effect
        if item.net_gain <= 0.0:
            return None
        if {effect.id, *effect.contains} & {member.id for member in (own.effect, *members)}:
            continue
        trial = engine.trial(rival, item, noise)
        labels = [term.effect.id for term in trial.fit.hypothesis.terms]
        if not np.isfinite(trial.criterion) or labels.count(own.effect.id) != 1:
            return None
        place = labels.index(own.effect.id)
        others = trial.fit.hypothesis.without(place)
        term = trial.fit.hypothesis.terms[place]
        both = engine.refit(others.with_term(term, engine.regression.n_runs), noise)
        return _Member(both.hypothesis.terms[-1], both, both, beside=effect.id)
    return None


def _ordered(engine: SelectionEngine, members: Sequence[_Member], noise: Noise) -> list[_Member]:
    """Members in the order of :class:`EquivalenceSet`."""
    best: dict[int, Fit] = {}
    for member in members:
        count = Coordinates(member.term.effect).n_parameters
        if count not in best or member.compared.chi_square < best[count].chi_square:
            best[count] = member.compared

    def key(member: _Member) -> tuple[int, bool, int, int]:
        effect = member.term.effect
        count = Coordinates(effect).n_parameters
        worse = fits_worse(engine.regression, member.compared, best[count], noise)
        return count, worse, len(effect.needs), engine.place_in_catalogue(effect.id)

    return sorted(members, key=key)


def _richer_law_joins(
    engine: SelectionEngine, final: Fit, noise: Noise, index: int, fitted: Fit
) -> bool | None:
    """Whether a rival with more parameters joins the set; None where other rules apply.

    A rival that is listed as confusable joins where it explains as much: creep beside a drift with
    temperature, a cable guide beside a wrong ratio. Only the penalty separates the two.
    """
    own, rival = final.hypothesis.terms[index].effect, fitted.hypothesis.terms[-1].effect
    more = Coordinates(rival).n_parameters - Coordinates(own).n_parameters
    if more > 0 and _listed_as_confusable(rival, own) and not rival.nested_with(own):
        return not fits_worse(engine.regression, fitted, final, noise)
    if more > 0 and not _same_family(rival, own):
        nearly_linear = engine.regression.has_known_loads and own.id in rival.contains
        return _weakly_preferred(final, fitted, more) or (
            nearly_linear and is_below_noise(engine, final, noise, index, rival)
        )
    return None


def _waves_of_one_load(engine: SelectionEngine, own: Effect, rival: Effect) -> bool:
    """Whether two waves over the motor angle differ by the load only, of which the runs have one.

    A cogging is constant, a ripple of the torque constant and a transmission error are in
    proportion to the torque. What friction and inertia make of that under one load depends on the
    side on which they act, which nobody knows.
    """
    known, waves = set(engine.regression.outputs), (own, rival)
    if not all(has_orders(e.single or e) and {*e.outputs} & known == _TORQUE for e in waves):
        return False
    forces = np.concatenate([at.tension for at in engine.regression.motions])
    low, middle, high = np.quantile(np.abs(forces), [0.05, 0.5, 0.95])
    return bool(high - low < _ONE_LOAD * middle)


def _reduces_to(engine: SelectionEngine, fitted: Fit, final: Fit, base: Fit, index: int) -> bool:
    """Whether a simpler law of the family explains the same within the range of these runs.

    Within the speeds of a run that never reach the falling part of a Stribeck curve, it is a
    Coulomb friction that is not quite constant.
    """
    own, rival = final.hypothesis.terms[index], fitted.hypothesis.terms[-1].effect
    visible = own.effect.visible
    if visible is None or any(visible(at, own.values) for at in engine.regression.motions):
        return False
    simpler = Coordinates(rival).n_parameters < Coordinates(own.effect).n_parameters
    related = bool(own.effect.family) and rival.family == own.effect.family
    return (
        simpler
        and related
        and base.chi_square - fitted.chi_square
        > _SHARE_OF_SIMPLER_LAW * (base.chi_square - final.chi_square)
    )


def _same_family(rival: Effect, own: Effect) -> bool:
    """Whether two laws are of one family, neither containing the other."""
    return bool(own.family) and rival.family == own.family and not rival.nested_with(own)


def _listed_as_confusable(rival: Effect, own: Effect) -> bool:
    """Whether the catalogue lists the two as confusable."""
    return rival.id in own.confused_with or own.id in rival.confused_with


def _weakly_preferred(simple: Fit, rich: Fit, more: int) -> bool:
    """Likelihood-ratio test significant at 5 %, for a law that BIC does not prefer."""
    states = [sum(len(start) for start in f.hypothesis.starts) for f in (simple, rich)]
    unknowns = max(1, more + states[1] - states[0])
    return bool(chdtrc(unknowns, max(0.0, simple.chi_square - rich.chi_square)) < _LEVEL)


def _confusable_by_drift(rival: Effect, own: Effect) -> bool:
    """Whether a rival with a time constant is listed as confusable with this effect."""
    creeps = rival.memory and any(p.role == "shape" and p.unit == "s" for p in rival.parameters)
    return creeps and _listed_as_confusable(rival, own)


def _sign_flip_p_value(excess_losses: Array) -> float:
    """P-value of larger losses per block by random signs, one-sided.

    Parameters
    ----------
    excess_losses : (blocks,) array
        Held-out χ² of the rival less that of the named effect.

    Notes
    -----
    Share of 2000 random assignments of signs whose sum reaches the observed one. Exact level under
    differences that are symmetric about zero and independent.
    """
    random = np.random.default_rng(1)
    signs = random.choice([-1.0, 1.0], size=(_SIGN_FLIPS, len(excess_losses)))
    return float(np.mean(signs @ excess_losses >= excess_losses.sum()))


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


def pairs_of(sets: Sequence[EquivalenceSet]) -> list[tuple[Term, Term]]:
    """Pairs of effects that these runs cannot distinguish."""
    return [(c.term, rival) for c in sets for rival in c.terms if rival is not c.term]
