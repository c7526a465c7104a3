"""Which run would tell two effects apart: programmes tried on the model before they are run.

For each of a few kinds of programme the line is predicted with one effect; what no size of the
other can imitate, in units of the noise, is the noncentrality λ (Hunter and Reiner, 1965).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ncx2

from winchkit.diagnosis.dataset import Dataset
from winchkit.diagnosis.kinds import KINDS, imagined
from winchkit.diagnosis.problem import Hypothesis, Problem
from winchkit.diagnosis.result import NextRun
from winchkit.effects.bind import Term
from winchkit.effects.effect import told_apart

__all__ = ["next_runs", "power_of", "separation"]

Array = NDArray[np.float64]
_CHI2 = 3.841
_OFFERED = 2
_WORTHWHILE = 0.2


def next_runs(
    dataset: Dataset, pairs: Sequence[tuple[Term, Term]], noise: dict[str, float]
) -> tuple[NextRun, ...]:
    """The programmes that separate each pair best per minute, with the power they would have."""
    if not pairs:
        return ()
    out: list[NextRun] = []
    tried = [(kind, imagined(dataset, kind)) for kind in KINDS]
    for first, second in pairs:
        offers = []
        for kind, problem in tried:
            minutes = sum(r.signals.time[-1] for r in problem.dataset.recordings) / 60
            strength = separation(problem, first, second, noise)
            offers.append((strength / minutes, power_of(strength), kind.name))
        # Any programme sure to separate them will do: of those the quickest per minute.
        offers.sort(key=lambda offer: (-round(offer[1], 2), -offer[0]))
        names = (first.effect.id, second.effect.id)
        useful = [offer for offer in offers if offer[1] >= _WORTHWHILE][:_OFFERED]
        out += [NextRun(names, name, power) for _, power, name in useful]
        if not useful:
            # No motion separates them: what does is on the card, and its power is not known.
            out.append(NextRun(names, told_apart(first.effect, second.effect), float("nan")))
    return tuple(out)


def power_of(strength: float) -> float:
    """Chance that a difference of noncentrality λ shows at the 5 % level."""
    return float(ncx2.sf(_CHI2, 1, strength)) if strength > 0 else 0.05


def separation(
    problem: Problem, first: Term, second: Term | None, noise: Mapping[str, float]
) -> float:
    """Noncentrality λ of the first effect where the second may take any size.

    Without a second one, of the first beside the nuisances alone.
    """
    weight = np.empty(problem.rows)
    for segment in problem.segments:
        weight[segment.rows] = 1 / max(noise.get(segment.output, np.inf), 1e-300)
    shown = problem.change(Hypothesis().with_term(first, problem.runs)) * weight
    rival = Hypothesis()
    if second is not None:
        rival = rival.with_term(second, problem.runs)
    imitation = problem.jacobian(problem.vector(rival), rival) * weight[:, None]
    whole = np.column_stack([imitation, problem.change(rival) * weight])
    if not np.isfinite(whole).all() or not np.isfinite(shown).all():
        return 0.0
    left = shown - whole @ np.linalg.lstsq(whole, shown, rcond=1e-10)[0]
    return float(left @ left)
