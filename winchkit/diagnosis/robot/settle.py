"""Where a robot's model stands before anything is sought: geometry, poses and noise settled.

Geometry and poses are fitted by Gauss and Newton's method, so that what is linearised afterwards
lies at the best fit of the model that there is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.fit import fit
from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.robot.believed import Believed
from winchkit.diagnosis.robot.dataset import RobotDataset
from winchkit.diagnosis.robot.equations import Equations, placed_by, start_pose
from winchkit.diagnosis.robot.noise import (
    START,
    PoseNoise,
    Stack,
    noise_of,
    repeated_differences,
)
from winchkit.diagnosis.robot.problem import RobotProblem, Standing
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Effect
from winchkit.effects.placed import base_of

__all__ = ["balanced", "begun", "judged_noise", "settled"]

Array = NDArray[np.float64]
_STEPS = 8
_STILL = 0.02
_UNBALANCED = 0.2
_BALANCING = frozenset({"payload-mass", "payload-centre", "cell-offset", "cell-thermal"})
"""What may explain an imbalance of tensions while their noise is sought. Not gains: no tension at
all and a platform without weight would balance anything."""


def begun(terms: Sequence[Term]) -> Hypothesis:
    """A hypothesis of a profile's own terms."""
    return Hypothesis(tuple(terms), (), ((),) * len(terms))


def settled(
    dataset: RobotDataset,
    terms: Sequence[Term],
    sigma: Mapping[str, float],
    believed: Sequence[Believed] = (),
) -> tuple[Standing, tuple[Term, ...]]:
    """Geometry, poses and the profile's own effects at the best fit with a given noise."""
    standing = Standing(dataset, start_pose(dataset), sigma, tuple(believed))
    terms = tuple(terms)
    for _ in range(_STEPS):
        standing = _placed(standing, terms)
        problem = RobotProblem(standing)
        found = fit(problem, begun(terms), np.ones(problem.rows))
        terms = found.hypothesis.terms
        steps = found.vector[: problem.nuisance_columns.shape[1]]
        moves = steps[len(steps) - len(believed) :].tolist()
        moved = tuple(b.moved(by) for b, by in zip(standing.believed, moves, strict=True))
        standing = replace(standing, believed=moved)
        if not moves or max(map(abs, moves)) < _STILL:
            break
    return _placed(standing, terms), terms


def _placed(standing: Standing, terms: Sequence[Term]) -> Standing:
    robot = standing.robot(terms)
    equations = Equations(standing.dataset, standing.pose, robot)
    return replace(standing, pose=placed_by(equations, robot, standing.sigma))


def judged_noise(
    dataset: RobotDataset,
    terms: Sequence[Term],
    believed: Sequence[Believed],
    candidates: Iterable[Effect],
) -> PoseNoise:
    """Noise of every kind of measurement, whatever may be missing from the model."""
    candidates = tuple(candidates)
    found = PoseNoise(START, {}, from_repeats=False, unexplained=START)
    for _ in range(2):
        standing, own = settled(dataset, terms, found.sigma, believed)
        problem = RobotProblem(standing)
        here = problem.residuals(own)
        columns = _columns(problem, own, candidates, here)
        kinds = [k for k, values in here.items() if np.isfinite(values).any()]
        slope = {k: v for k, v in problem.slope().items() if k in kinds}
        kept = {k: here[k] for k in kinds}
        stack = Stack(kept, slope, {k: columns[k] for k in kinds})
        found = noise_of(stack, repeated_differences(Stack(kept, slope, {}), dataset.pose))
        found = replace(found, sigma={**START, **found.sigma})
    return found


def balanced(dataset: RobotDataset, noise: PoseNoise) -> bool:
    """Whether what tensions leave unbalanced is small beside how much they vary.

    Else something pulls at the platform that no profile has, or the cells are no cells of these
    ropes: the balance is then left out, and said to be.
    """
    if not dataset.has_tension:
        return True
    spread = float(np.nanstd(dataset.measured.tension))
    return noise.unexplained.get("tension", 0.0) <= _UNBALANCED * spread


def _columns(
    problem: RobotProblem, own: Sequence[Term], candidates: Sequence[Effect], here: dict[str, Array]
) -> dict[str, Array]:
    """What the residuals gain from the geometry and from every candidate, (p, k, m) by kind."""
    moved: list[dict[str, Array]] = []
    for effect in candidates:
        coordinates = Coordinates(effect)
        shape = coordinates.grid()[0]
        for secant in coordinates.secants():
            term = Term(effect, {**effect.null, **shape, **secant})
            there = problem.residuals((*own, term))
            if base_of(effect) not in _BALANCING and "tension" in there:
                there["tension"] = here["tension"]
            moved.append(there)
    start = problem.residuals(()) if own else here
    moved += [
        {k: here[k] + there[k] - start[k] for k in here} for there in problem.moved_by_belief()
    ]
    out = {k: [m[k] - values for m in moved] for k, values in here.items()}
    for kind in ("swivel", "gauge"):
        for i in range(len(problem.dataset.names)):
            column = np.zeros_like(here[kind])
            column[:, i] = 1.0
            out[kind].append(column)
        for other in out:
            if other != kind:
                out[other] += [np.zeros_like(here[other])] * len(problem.dataset.names)
    return {k: np.nan_to_num(np.stack(v, axis=-1)) for k, v in out.items()}
