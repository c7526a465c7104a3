"""The combination of parameters that the data determine, where single ones are uncertain.

A wrong radius and a wrong ratio explain the same change of the cable per motor turn, which does not
depend on which of the two is true. Strongly correlated parameters of one effect are given as the
eigenvector of the smallest eigenvalue of their correlation matrix.

References
----------
Belsley, D. A., Kuh, E., Welsch, R. E. (1980). Regression Diagnostics. Wiley, ch. 3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi

import numpy as np

from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.regression.conditioning import ValueCovariance
from winchkit.diagnosis.results import Combination, Estimate
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.model.line import Line
from winchkit.model.stages import Stage

_STRONG = 0.9
"""Correlation above which parameters of an effect are reported as a combination; convention:
variance inflation factor 1/(1 − ρ²) of 5 (Belsley, Kuh & Welsch 1980)."""
_WINDING = frozenset({"drum-radius", "gear-ratio"})
"""Effects of which the data determine the cable per motor turn."""


def combination_of_set(
    terms: Sequence[Term],
    parameters: Mapping[str, Mapping[str, Estimate]],
    dataset: Dataset | None,
) -> Combination | None:
    """Combination of parameters that the data determine, whichever member of a set is true.

    It is the mean cable per motor turn of a wrong radius or ratio, the indicated one where the
    length instrument may be wrong as well; the parameters of other sets have no sum (None).
    """
    if dataset is None or not {term.effect.id for term in terms} >= _WINDING:
        return None
    known = next(term for term in terms if term.effect.id in _WINDING)
    (estimate,) = parameters[known.effect.id].values()
    shown = any(term.effect.stage is Stage.LENGTH_INSTRUMENT for term in terms)
    name = "indicated cable per motor turn" if shown else "cable per motor turn"
    return _cable_per_motor_turn(name, known, estimate.std, dataset)


def combination_of_term(term: Term, covariance: ValueCovariance) -> Combination | None:
    """Best determined combination of an effect's strongly correlated parameters; None without any.

    It is the eigenvector of the smallest eigenvalue of the correlation matrix of the parameters
    that correlate above 0.9, scaled to a coefficient of one for the first.
    """
    polar = {name for pair in term.effect.polar_pairs for name in pair}
    fitted = [name for name in Coordinates(term.effect).names if name not in polar]
    index = {name: covariance.names.index(f"{term.label}.{name}") for name in fitted}
    variance = np.diag(covariance.matrix)
    known = [name for name in fitted if variance[index[name]] > 0.0]
    rows = [index[name] for name in known]
    std = np.sqrt(variance[rows])
    correlation = covariance.matrix[np.ix_(rows, rows)] / np.outer(std, std)
    strong = np.any(np.abs(correlation - np.eye(len(rows))) > _STRONG, axis=1)
    chosen = np.flatnonzero(strong)
    if len(chosen) < 2:
        return None
    _, vectors = np.linalg.eigh(correlation[np.ix_(chosen, chosen)])
    weights = vectors[:, 0] / std[chosen]
    if abs(vectors[0, 0]) < 1e-6:
        return None
    weights = weights / weights[0]
    names = [known[i] for i in chosen]
    if len({term.effect.parameter(name).unit for name in names}) > 1:
        return None  # A sum of unlike units depends on the choice of the units.
    own = covariance.matrix[np.ix_([rows[i] for i in chosen], [rows[i] for i in chosen])]
    formula = names[0] + "".join(
        f" {'+' if weight > 0 else '−'} {abs(weight):.3g} · {name}"
        for name, weight in zip(names[1:], weights[1:], strict=True)
    )
    value = sum(weight * term.values[name] for name, weight in zip(names, weights, strict=True))
    deviation = float(np.sqrt(max(weights @ own @ weights, 0.0)))
    return Combination(formula, float(value), deviation, term.effect.parameter(names[0]).unit)


def _cable_per_motor_turn(label: str, term: Term, std: float, dataset: Dataset) -> Combination:
    """Mean change of the cable length per motor turn over these runs, with one of the members."""
    (name,) = Coordinates(term.effect).names
    moved = Term(term.effect, {**term.values, name: term.values[name] + std})
    value, beside = (_length_per_turn(each, dataset) for each in (term, moved))
    return Combination(label, value, abs(beside - value), "m")


def _length_per_turn(term: Term, dataset: Dataset) -> float:
    """Slope of the predicted cable length over the motor turns, an offset per run, m."""
    line = Line(dataset.profile, (term.modifier(),))
    products = squares = 0.0
    for recording in dataset.recordings:
        turns = recording.smooth.at.motor_angle / (2 * pi)
        turns = turns - turns.mean()
        products += float(turns @ line.predict(recording.smooth)["cable_length"])
        squares += float(turns @ turns)
    return abs(products / squares) if squares else 0.0
