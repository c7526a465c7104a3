"""Equivalence sets: effects that these runs cannot distinguish from the named ones.

Each rival is refitted in the place of the named effect, under the larger of the noise and of what
the named model leaves unexplained (quasi-likelihood). It joins the set unless it is worse in
sample, Δχ² being above the square of a quantile of t (9 for well-known variances), and held out,
the difference over blocks of time being significant by random signs at 5 %. A law that is a simpler
one (:mod:`~winchkit.diagnosis.verdict.laws`) is no rival: the simpler law is.

References
----------
Wedderburn, R. W. M. (1974). Biometrika 61, 439-447.
Wilks, S. S. (1938). Ann. Math. Statist. 9, 60-62.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.exchange import RivalPlace
from winchkit.diagnosis.selection.orders import has_orders
from winchkit.diagnosis.selection.scores import Projected
from winchkit.diagnosis.verdict.laws import is_degenerate, largest_rise
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

_MOST_RIVALS = 6
"""Rivals that are refitted."""
_SCORE_MARGIN = 40.0
"""Explained χ² below that of the named effect, within which a rival is refitted."""
_MOST_MEMBERS = 4
"""Members of a set; further ones are named in a doubt. Radius, ratio and gain of the length
instrument are three names of one change, beside which there may be another law."""
_LEAST_SHARE = 0.5
"""Share of the named effect's decrease of χ² that a rival must reach."""
_TORQUE = {"motor_torque"}
_ONE_LOAD = 0.2
"""Range of the cable's force over its median up to which the runs have one load: less changes a
wave by less than the tenth that establishes a law."""
_UNKNOWN_CAUSE = 0.1
"""Share of the squared error above the noise that a rival may add: an unknown effect with a
correlation of 0.16 to the difference of the two would reverse it."""
_SIGN_FLIPS = 2000
"""Random signs of the block differences; computing cost."""
_INCOMPLETE = 0.25
"""Level of the preliminary test that the residual of the final model does not exceed the noise."""
_LEVEL = 0.05
"""Level of the likelihood-ratio test and of a difference held out; convention."""


@dataclass(frozen=True)
class EquivalenceSet:
    """Equivalence set of one addition, in an order that does not depend on noise.

    First are the effects with the fewest parameters; of these those that are not rejected against
    the best, those with the fewest measured inputs, and then the order of the catalogue. Last are
    those that fit worse, though by no more than an unknown cause may.
    """

    term: Term
    effects: tuple[str, ...]
    terms: tuple[Term, ...]
    """Each member with its fitted values, in the same order."""
    fits: tuple[Fit, ...]
    """Fit of each member beside all other effects."""
    angles: dict[str, float]
    """Angle between its signature and each rival's, rad."""
    further: tuple[str, ...]
    """Effects beyond four, which fit worst."""

    def beginning_with(self, term: Term, fit: Fit) -> EquivalenceSet:
        """The same set with a term of a final model first, beside which the others are compared. It
        may be none of them: a law that explained no more than a simpler one, but predicts better.
        """
        if term.effect.id not in self.effects:
            names = (term.effect.id, *self.effects)
            return replace(
                self, term=term, effects=names, terms=(term, *self.terms), fits=(fit, *self.fits)
            )
        order = sorted(range(len(self.effects)), key=lambda i: self.effects[i] != term.effect.id)
        terms = tuple(self.terms[i] for i in order)
        fits = tuple(self.fits[i] for i in order)
        names = tuple(self.effects[i] for i in order)
        return replace(self, term=terms[0], effects=names, terms=terms, fits=fits)


def equivalence_set(
    engine: SelectionEngine, final: Fit, noise: BandNoise, index: int
) -> EquivalenceSet:
    """Equivalence set of one term; a rival must reach half of the named effect's decrease of χ².

    All fits are compared under the larger of the noise and of the final model's residual, per band
    (:func:`~winchkit.diagnosis.regression.dispersion.overdispersed`): what the final model leaves
    unexplained is no evidence for one of two rivals. The true one loses more than t² times the
    variance with probability at most 1/740, t being the quantile for the degrees of freedom of the
    variances in which the two differ.
    """
    dispersed = overdispersed(engine.regression, final, noise)
    own_fit = engine.refit(final.hypothesis, dispersed)
    exchange = RivalPlace(engine, own_fit, dispersed, index)
    own, base, scores = final.hypothesis.terms[index], exchange.base, exchange.scores
    own_explained_ss = next(
        (s.explained_ss for s in scores if s.candidate.effect.id == own.effect.id), 0.0
    )
    rivals = [
        s
        for s in scores
        if s.candidate.effect.id != own.effect.id
        and (
            s.explained_ss > own_explained_ss - max(_SCORE_MARGIN, 0.1 * own_explained_ss)
            # The score of a delay is that of its usual size.
            or (own.effect.is_delay and s.candidate.effect.is_delay)
        )
    ][:_MOST_RIVALS]
    least = base.chi_square - _LEAST_SHARE * (base.chi_square - own_fit.chi_square)
    goal = own_fit.chi_square + largest_loss(np.inf)
    aim = own_fit.chi_square + largest_loss(float(dispersed.dof.min()))
    losses = held_out(engine.regression, own_fit, dispersed, engine.regression.blocks)
    members, left_out = [_Member(own, final, own_fit)], list[Fit]()

    def is_worse(fitted: Fit) -> bool:
        return fits_worse(engine.regression, fitted, own_fit, dispersed) and _predicts_worse(
            engine, fitted, losses, dispersed
        )

    for rival in rivals:
        trial = exchange.trial(rival, goal, least, aim)
        fitted = trial.fit
        if not np.isfinite(trial.criterion) or fitted.chi_square > least:
            continue
        residual = _where_explained(engine, fitted, own_fit, noise, own.effect.outputs)
        weighted = residual * dispersed.inverse_sigma(engine.regression)
        judged = replace(fitted, residual=residual, chi_square=float(weighted @ weighted))
        worse = is_worse(judged) and not _within_a_sample(engine, own, rival.candidate.effect)
        fits_less = not worse and judged.chi_square < fitted.chi_square and is_worse(fitted)
        member = _Member(fitted.hypothesis.terms[-1], fitted, fitted, fits_less)
        # A wave of any order is also every law with a period: its order is a number more.
        wider = own.effect.nested_with(member.term.effect) or has_orders(member.term.effect)
        joins = (
            not worse
            and not (wider and _adds_nothing(member, members[0]))
            and not _is_last_degenerate(engine, fitted, dispersed)
        )
        if joins or _waves_of_one_load(engine, own.effect, rival.candidate.effect):
            members.append(member)
        else:
            left_out.append(fitted)
    members = [
        m
        for m in members
        if not any(
            o.term.effect.id in m.term.effect.reduces_to and _adds_nothing(m, o) for o in members
        )
    ]
    members = _ordered(engine, members, dispersed)
    if not noise.from_repeats and excess_p_value(engine.regression, final, noise) < _INCOMPLETE:
        # Another effect may be missing: gravity beside friction that is an offset in one direction.
        alone = [m.term.effect for m in members]
        beside = [_beside_another(engine, fitted, alone, dispersed) for fitted in left_out]
        members += [
            m
            for m in beside
            if m is not None
            and not _predicts_worse(engine, m.compared, losses, dispersed)
            and not _is_last_degenerate(engine, m.fit, dispersed)
        ]
    members, further = _at_most_four(members, own)
    projected = engine.projected(base, dispersed)
    angles = {
        member.term.effect.id: _angle(projected, own.effect.id, member.term.effect.id)
        for member in members
        if member.term.effect.id != own.effect.id
    }
    terms = tuple(member.term for member in members)
    fits = tuple(member.fit for member in members)
    names = tuple(term.effect.id for term in terms)
    return EquivalenceSet(own, names, terms, fits, angles, further)


def _within_a_sample(engine: SelectionEngine, own: Term, rival: Effect) -> bool:
    """Whether two delays are shorter than the time between samples: what distinguishes a delay from
    a low-pass is of second order in it, as is the error of an acceleration from samples.
    """
    regression = engine.regression
    if not (
        own.effect.is_delay and rival.is_delay and isinstance(regression, TimeSeriesRegression)
    ):
        return False
    times = (abs(own.values[p.name]) for p in own.effect.parameters if p.role == "amplitude")
    steps = np.concatenate([np.diff(motion.time) for motion in regression.motions])
    return max(times) < float(np.median(steps))


def _is_last_degenerate(engine: SelectionEngine, fitted: Fit, noise: BandNoise) -> bool:
    """Whether the law of a fit's last effect is a simpler one."""
    return is_degenerate(engine, fitted, noise, len(fitted.hypothesis.terms) - 1)


@dataclass(frozen=True)
class _Member:
    term: Term
    """The effect with its values."""
    fit: Fit
    """Fit that is reported: of the named effect the final one."""
    compared: Fit
    """Fit under the variances of the comparison."""
    fits_less: bool = False
    """Whether it fits worse than the named effect, if not by more than an unknown cause may."""


def _where_explained(
    engine: SelectionEngine, rival: Fit, own: Fit, noise: BandNoise, acts_on: Sequence[str]
) -> Array:
    """Residual of a rival, which is that of the named model in outputs in which it adds too little
    to the squared error for an error of unknown cause to be evidence against it: a share of what
    that model leaves above the noise, all of it in outputs in which only the rival acts.
    """
    regression, residual = engine.regression, rival.residual.copy()
    known = noise.power[regression.band_of_row] * regression.share_of_row
    for output in {*rival.hypothesis.terms[-1].effect.outputs} & {*regression.outputs}:
        rows = np.r_[tuple(regression.rows_of([output]))]
        left = float(np.sum(own.residual[rows] ** 2 - known[rows]))
        share = _UNKNOWN_CAUSE if output in acts_on else 1.0
        if float(np.sum(rival.residual[rows] ** 2 - own.residual[rows] ** 2)) < share * left:
            residual[rows] = own.residual[rows]
    return residual


def _predicts_worse(engine: SelectionEngine, rival: Fit, losses: Array, noise: BandNoise) -> bool:
    """Whether held-out losses per block exceed those of the named effect, one-sided; the sorted
    differences have the same signs whatever the order of the runs.
    """
    excess = np.sort(held_out(engine.regression, rival, noise, engine.regression.blocks) - losses)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], size=(_SIGN_FLIPS, len(excess)))
    return bool(np.mean(signs @ excess >= excess.sum()) <= _LEVEL)


def _waves_of_one_load(engine: SelectionEngine, own: Effect, rival: Effect) -> bool:
    """Whether two waves over the motor angle differ by the load only, of which the runs have one.

    A cogging is constant, the others are in proportion to the torque. What friction and inertia
    make of that under one load depends on the side on which they act, which is unknown.
    """
    known, waves = set(engine.regression.outputs), (own, rival)
    if not all(has_orders(e.single or e) and {*e.outputs} & known == _TORQUE for e in waves):
        return False
    forces = np.concatenate([at.tension for at in engine.regression.motions])
    low, middle, high = np.quantile(np.abs(forces), [0.05, 0.5, 0.95])
    return bool(high - low < _ONE_LOAD * middle)


def _beside_another(
    engine: SelectionEngine, rival: Fit, members: Sequence[Effect], noise: BandNoise
) -> _Member | None:
    """A rival with the further effect that explains most of what it leaves; None without one. That
    effect is no member, contains none and reduces to none: it would explain the same without the
    rival.
    """
    own = rival.hypothesis.terms[-1]
    for item in engine.scores(rival, noise):
        effect = item.candidate.effect
        if item.net_gain <= 0.0:
            return None
        containing = {effect.id, *effect.contains, *effect.reduces_to}
        if containing & {member.id for member in (own.effect, *members)}:
            continue
        trial = engine.trial(rival, item, noise)
        labels = [term.effect.id for term in trial.fit.hypothesis.terms]
        if not np.isfinite(trial.criterion) or labels.count(own.effect.id) != 1:
            return None
        place = labels.index(own.effect.id)
        others = trial.fit.hypothesis.without(place)
        term = trial.fit.hypothesis.terms[place]
        both = engine.refit(others.with_term(term, engine.regression.n_runs), noise)
        return _Member(both.hypothesis.terms[-1], both, both)
    return None


def _adds_nothing(rich: _Member, simple: _Member) -> bool:
    """Whether a likelihood-ratio test (Wilks) at 5 % does not prefer a law with more parameters."""
    counts = [
        Coordinates(m.term.effect).n_parameters + sum(map(len, m.compared.hypothesis.starts))
        for m in (rich, simple)
    ]
    gain = max(0.0, simple.compared.chi_square - rich.compared.chi_square)
    more = counts[0] - counts[1]
    return more > 0 and bool(chdtrc(more, gain) > _LEVEL)


def _ordered(
    engine: SelectionEngine, members: Sequence[_Member], noise: BandNoise
) -> list[_Member]:
    """Members in the order of :class:`EquivalenceSet`."""
    best: dict[int, Fit] = {}
    for member in members:
        count = Coordinates(member.term.effect).n_parameters
        if count not in best or member.compared.chi_square < best[count].chi_square:
            best[count] = member.compared

    def key(member: _Member) -> tuple[bool, int, bool, int, int]:
        effect = member.term.effect
        count = Coordinates(effect).n_parameters
        worse = fits_worse(engine.regression, member.compared, best[count], noise)
        place = engine.place_in_catalogue(effect.id)
        return member.fits_less, count, worse, len(effect.needs), place

    return sorted(members, key=key)


def _at_most_four(members: Sequence[_Member], own: Term) -> tuple[list[_Member], tuple[str, ...]]:
    """The first member, the named effect and those that fit best, in their order; ids of the
    others.
    """
    order = range(len(members))
    kept = sorted(
        order, key=lambda i: (i > 0, members[i].term is not own, members[i].compared.chi_square)
    )[:_MOST_MEMBERS]
    further = tuple(members[i].term.effect.id for i in order if i not in kept)
    return [members[i] for i in sorted(kept)], further


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


def with_first_members(
    engine: SelectionEngine, final: Fit, noise: BandNoise, sets: Sequence[EquivalenceSet]
) -> tuple[Fit, list[EquivalenceSet]]:
    """The model of the first members of all sets, refitted together, and the sets beside it; the
    given model where it predicts an output worse by more than 2 %.
    """
    hypothesis, first = final.hypothesis, engine.n_initial_terms
    for index, each in enumerate(sets, start=first):
        if each.effects[0] != hypothesis.terms[index].effect.id:
            hypothesis = hypothesis.exchanged(index, each.terms[0], engine.regression.n_runs)
    if hypothesis is not final.hypothesis:
        together = engine.refit(hypothesis, noise)
        if largest_rise(engine, together, final, noise) <= 1 / RELEVANT_RATIO:
            final = together
    own = final.hypothesis.terms[first:]
    return final, [each.beginning_with(term, final) for each, term in zip(sets, own, strict=True)]


def pairs_of(sets: Sequence[EquivalenceSet]) -> list[tuple[Term, Term]]:
    """Pairs of effects that these runs cannot distinguish."""
    return [(c.term, rival) for c in sets for rival in c.terms if rival is not c.term]
