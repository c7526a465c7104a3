"""Score of effects that a calibration leaves out: the fall of its cost in one linearised step.

Poses and parameters stay at the end of the fit. For each effect that is not in it, the equations
are linearised with the effect's parameters beside the others, and the predicted fall of the cost,
½ gᵀ (H + 1)⁻¹ g with gradient g and information H, is the score (Rao's score test with a prior).
It is a hint, to be confirmed by a fit of the effect and by the held-out error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.robot.identification.bundle_adjustment import (
    BundleState,
    Solution,
    Weights,
    linearise,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.parameters import EFFECTS, LAWS, parameters_of

_LEAST_SHARE = 0.2
"""Least share of the cost (rule of thumb)."""
_LEAST_GAIN = 25.0
"""Least fall of the cost, half of χ² (rule of thumb: seven standard deviations)."""
_EQUAL_SHARES = 0.1
"""Difference of shares within which the law with fewest parameters is named (rule of thumb)."""


@dataclass(frozen=True)
class CandidateEffect:
    """Candidate effect: one that is not in the model."""

    effect: str
    share: float
    """Share of the fit's cost that its parameters would explain, between 0 and 1."""


def candidates(
    equations: RobotEquations, solution: Solution, weights: Weights, effects: tuple[str, ...]
) -> tuple[CandidateEffect, ...]:
    """Effects that would explain much of the remaining cost, the largest share first."""
    out = []
    for effect in EFFECTS:
        if effect.startswith(("payload", "gear-ratio")) or effect in effects:
            continue
        if not _possible(equations, effect):
            continue
        gain = _gain(equations, solution, weights, (*effects, effect))
        if not gain > _LEAST_GAIN:
            continue
        if (share := gain / max(solution.linear.cost, gain)) > _LEAST_SHARE:
            out.append(CandidateEffect(effect, share))
    laws = [c for c in out if c.effect in LAWS]
    if laws:
        best = max(c.share for c in laws)
        # They are in the order of their numbers of parameters.
        kept = next(c for c in laws if c.share > best - _EQUAL_SHARES)
        out = [c for c in out if c not in laws or c == kept]
    return tuple(sorted(out, key=lambda c: -c.share))


def _possible(equations: RobotEquations, effect: str) -> bool:
    """Whether an effect has the forces that it needs, and excludes no effect of the fit."""
    if effect not in LAWS:
        return "home_length" not in equations.parameters.block
    forces = bool(np.any(np.isfinite(equations.measured.tension)))
    return equations.parameters.law is None and (forces or equations.middle_force is not None)


def _gain(
    equations: RobotEquations, solution: Solution, weights: Weights, effects: tuple[str, ...]
) -> float:
    """Fall of the cost in one linearised step with the effect's parameters free."""
    own = equations.parameters
    wider = parameters_of(equations.robot, equations.measured, effects, equations.instruments)
    values = own.carried(solution.state.values, wider, wider.nominal)
    free = own.carried(solution.held, wider, np.zeros(len(values))) == 0
    # Their priors are those that the fit started with.
    wider = wider.about(own.carried(own.nominal, wider, wider.nominal))
    state = BundleState(values, solution.state.pose)
    linear = linearise(replace(equations, parameters=wider), state, weights)
    matrix = linear.information[np.ix_(free, free)] + np.eye(int(np.count_nonzero(free)))
    gradient = linear.gradient[free]
    return float(gradient @ np.linalg.solve(matrix, gradient)) / 2
