"""Which effect would explain what a robot's calibration leaves over: one step of each, untaken.

Poses and parameters stay where the fit ended; for each effect that is not in it, the fit is
linearised with the effect's parameters beside the others, and the fall of the cost that one step
promises is its score (a score test). A hint where to look, to be confirmed by fitting the effect
and by poses held out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.calibration.robot.elongation import LAWS
from winchkit.calibration.robot.equations import Equations, State
from winchkit.calibration.robot.least_squares import Solution, Weights, linearise
from winchkit.calibration.robot.parameters import EFFECTS, Parameters, parameters_of

__all__ = ["Candidate", "candidates"]

Blocks = Mapping[str, NDArray[np.intp]]
Values = NDArray[np.float64] | NDArray[np.bool_]

_WORTH = 0.2
_SURE = 25.0
_ALIKE = 0.1


@dataclass(frozen=True)
class Candidate:
    """An effect that is not in the model."""

    effect: str
    share: float
    """Of the fit's cost that its parameters would take away, between 0 and 1."""


def candidates(
    equations: Equations, solution: Solution, weights: Weights, effects: tuple[str, ...]
) -> tuple[Candidate, ...]:
    """Effects worth trying, the best first, of the cable's laws one; none where noise is left over.

    ``effects`` are those in the fit already. Payloads, which only weigh on tensions, are no
    candidates for errors of position.
    """
    out = []
    for effect in EFFECTS:
        if effect.startswith("payload") or effect in effects or not _possible(equations, effect):
            continue
        gain = _gain(equations, solution, weights, (*effects, effect))
        share = gain / max(solution.linear.cost, gain)
        if gain > _SURE and share > _WORTH:
            out.append(Candidate(effect, share))
    laws = [c for c in out if c.effect in LAWS]
    if laws:
        best = max(c.share for c in laws)
        # They stand in the order of their freedoms: of equals the first is kept.
        kept = next(c for c in laws if c.share > best - _ALIKE)
        out = [c for c in out if c not in laws or c == kept]
    return tuple(sorted(out, key=lambda c: -c.share))


def _possible(equations: Equations, effect: str) -> bool:
    """Whether an effect has the forces that it needs, and the place of no other law."""
    if effect not in LAWS:
        return "home_length" not in equations.parameters.block
    forces = bool(np.any(np.isfinite(equations.measured.tension)))
    return equations.parameters.law is None and (forces or equations.forces.middle is not None)


def _gain(
    equations: Equations, solution: Solution, weights: Weights, effects: tuple[str, ...]
) -> float:
    """By how much the cost would fall in one step with the effect's parameters free."""
    wider = parameters_of(
        equations.robot,
        effects,
        swivel="swivel_zero" in equations.parameters.block,
        length_offset="length_offset" in equations.parameters.block,
    )
    values = wider.nominal
    _carry(equations.parameters.block, wider.block, solution.state.values, values)
    grown = replace(equations, parameters=_with_nominal(equations, wider))
    linear = linearise(grown, State(values, solution.state.pose), weights)
    held = np.zeros(len(values), dtype=bool)
    _carry(equations.parameters.block, wider.block, solution.held != 0, held)
    free = ~held
    matrix = linear.information[np.ix_(free, free)] + np.eye(int(np.count_nonzero(free)))
    gradient = linear.gradient[free]
    return float(gradient @ np.linalg.solve(matrix, gradient)) / 2


def _carry(old: Blocks, new: Blocks, source: Values, target: Values) -> None:
    """Copy what both layouts have, block by block."""
    for name, place in old.items():
        target[new[name]] = source[place]


def _with_nominal(equations: Equations, wider: Parameters) -> Parameters:
    """The wider parameters with the zeros of the instruments as the fit began with them."""
    nominal = equations.parameters.nominal
    for name, place in equations.parameters.block.items():
        wider = wider.starting(name, nominal[place])
    return wider
