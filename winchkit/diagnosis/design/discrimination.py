"""Discrimination of two effects by a further run, on candidate programmes that are simulated.

For each candidate programme one effect is simulated; the noncentrality λ is the squared length, in
units of the noise, that no size of the other effect can imitate there and in the runs so far. The
noise is that of the diagnosis, per frequency, and the power that of its limit on Δχ².

References
----------
Hunter, W. G., Reiner, A. M. (1965). Technometrics 7, 307-323.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chndtr

from winchkit.arrays import Array
from winchkit.diagnosis.design.programmes import candidates, range_of_runs
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.dispersion import largest_loss
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise, bands_at
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.results import NextRun
from winchkit.effects.effect import told_apart
from winchkit.effects.term import Term

SEPARATED_AT = 3.841
"""95 % quantile of χ² with one degree of freedom, for poses."""
Weights = Callable[[Regression], Array]
"""1/σ of every row of a regression, (n_rows,)."""
_MOST_OFFERS = 2
"""Programmes that are offered per pair; rule of thumb."""
_WEIGHED = ", with load_mass"
"""Of a programme that is simulated with known loads where the runs have none."""
LEAST_POWER = 0.2
"""Least power of a programme or of poses that are offered."""


@dataclass(frozen=True)
class Information:
    """Information of the runs so far on two effects, as a triangular factor."""

    shared_columns: Array
    """Columns that later runs share: offset and parameters of the second effect."""
    signature: Array
    """Column of the first effect."""
    residual_ss: float
    """λ of the runs so far alone."""


def weights_of(regression: TimeSeriesRegression, noise: BandNoise) -> Weights:
    """1/σ at the frequencies of further runs, with the noise of the runs so far.

    σ² is larger by the ratio of the limits of Δχ² for its degrees of freedom and for infinitely
    many: the limit is then that of a known variance in every band.
    """
    limits = np.array([largest_loss(float(dof)) for dof in noise.dof])
    power = noise.power * limits / largest_loss(np.inf)
    rate = {segment.output: segment.band.rate for segment in regression.segments}

    def weights(other: Regression) -> Array:
        variance = power[bands_at(regression.bands, other)]
        for segment in other.segments:
            # The density of the noise is given, of which a coefficient has half the rate.
            variance[segment.rows] *= segment.band.rate / rate[segment.output]
        return np.asarray(1 / np.sqrt(variance))

    return weights


def next_runs(
    regression: TimeSeriesRegression, pairs: Sequence[tuple[Term, Term]], weights: Weights
) -> tuple[NextRun, ...]:
    """At most two programmes per pair that separate it best per minute, with their power.

    Where no programme helps, the text is that of the effect's
    card, with NaN power.
    """
    if not pairs:
        return ()
    out: list[NextRun] = []
    dataset = regression.dataset
    programmes = list(candidates(dataset, range_of_runs(dataset)))
    for first, second in pairs:
        offers, known = [], information_of(regression, first, second, weights)
        for kind, programme in programmes:
            minutes = programme.dataset.recordings[0].signals.time[-1] / 60
            noncentrality = separation(programme, first, second, weights, known=known)
            offers.append((noncentrality / minutes, power_to_separate(noncentrality), kind.name))
        # Of programmes with equal power the one with the largest λ per minute comes first.
        offers.sort(key=lambda offer: (-round(offer[1], 2), -offer[0]))
        names = (first.effect.id, second.effect.id)
        useful = [offer for offer in offers if offer[1] >= LEAST_POWER][:_MOST_OFFERS]
        weighed = _WEIGHED if _is_of_an_input(regression, first, second) else ""
        out += [NextRun(names, name + weighed, power) for _, power, name in useful]
        if not useful:
            # No motion separates them: the advice of the catalogue, whose power is not known.
            out.append(NextRun(names, told_apart(first.effect, second.effect), float("nan")))
    return tuple(out)


def _is_of_an_input(regression: TimeSeriesRegression, first: Term, second: Term) -> bool:
    """Whether one effect is of a cell whose reading stands for the load."""
    unknown = all(recording.raw.load is None for recording in regression.dataset.recordings)
    return unknown and any(term.effect.correct is not None for term in (first, second))


def power_of(noncentrality: float, required: float = SEPARATED_AT) -> float:
    """Power P(χ²'(1, λ) > required) of a χ² test with one degree of freedom."""
    return float(1 - chndtr(required, 1, max(noncentrality, 0.0)))


def power_to_separate(noncentrality: float) -> float:
    """Power of a run of a winch against the limit of Δχ² beyond which a rival leaves the set."""
    return power_of(noncentrality, largest_loss(np.inf))


def separation(
    regression: Regression,
    first: Term,
    second: Term | None,
    weights: Weights,
    *,
    known: Information | None = None,
    repeats: int = 1,
) -> float:
    """Noncentrality λ of the first effect where the second, if there is one, may have any size.

    With ``known``, the information of the runs so far, the
    result is the increase of λ by the programme: the second effect has one size there and here.
    """
    rows = _rows(regression, first, second, weights)
    if rows is None:
        return 0.0
    own, shared_columns, signature = (np.asarray(np.sqrt(repeats) * part) for part in rows)
    if known is None:
        return _residual_ss(np.column_stack([own, shared_columns]), signature)
    above = np.zeros((len(known.signature), own.shape[1]))
    columns = np.block([[above, known.shared_columns], [own, shared_columns]])
    return max(
        0.0, _residual_ss(columns, np.concatenate([known.signature, signature])) - known.residual_ss
    )


def information_of(
    regression: Regression, first: Term, second: Term | None, weights: Weights
) -> Information | None:
    """Information of a problem's runs on two effects; None where a prediction is not finite."""
    rows = _rows(regression, first, second, weights)
    if rows is None:
        return None
    own, shared_columns, signature = rows
    triangle = np.asarray(np.linalg.qr(np.column_stack([own, shared_columns, signature]), mode="r"))
    kept = triangle[own.shape[1] :, own.shape[1] :]
    return Information(kept[:, :-1], kept[:, -1], _residual_ss(kept[:, :-1], kept[:, -1]))


def _rows(
    regression: Regression, first: Term, second: Term | None, weights: Weights
) -> tuple[Array, Array, Array] | None:
    """Whitened columns of a run's own states, of all runs and of the first effect; None where a
    prediction is not finite."""
    weight = weights(regression)
    signature = regression.change(Hypothesis().with_term(first, regression.n_runs)) * weight
    rival = Hypothesis()
    if second is not None:
        rival = rival.with_term(second, regression.n_runs)
    rival_columns = regression.jacobian(regression.vector(rival), rival) * weight[:, None]
    if not (np.isfinite(rival_columns).all() and np.isfinite(signature).all()):
        return None
    states = sum(len(start) for start in rival.starts)
    nuisances, offset = regression.nuisance_columns.shape[1], regression.n_run_offsets
    own = [
        *(i for i in range(nuisances) if i != offset or not regression.fits_offset),
        *range(rival_columns.shape[1] - states, rival_columns.shape[1]),
    ]
    parameter_columns = rival_columns[:, nuisances : rival_columns.shape[1] - states]
    level = (
        rival_columns[:, [offset]] if regression.fits_offset else np.zeros((regression.n_rows, 1))
    )
    shared_columns = np.column_stack([level, parameter_columns, regression.change(rival) * weight])
    return rival_columns[:, own], shared_columns, signature


def _residual_ss(columns: Array, signature: Array) -> float:
    """Sum of squares of ``signature`` after regression on ``columns``."""
    residual = signature - columns @ np.linalg.lstsq(columns, signature, rcond=1e-10)[0]
    return float(residual @ residual)
