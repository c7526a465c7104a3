"""Where a robot's model stands before anything is sought: geometry, poses and noise settled.

Geometry and poses are fitted by Gauss and Newton's method, so that what is linearised afterwards
lies at the best fit of the model that there is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.robot.candidates import candidates_at, priors_of_geometry
from winchkit.diagnosis.robot.dataset import RobotDataset, prepare_poses
from winchkit.diagnosis.robot.engine import PoseSelection
from winchkit.diagnosis.robot.equations import Equations, placed_by, start_pose
from winchkit.diagnosis.robot.prior import GeometryPrior
from winchkit.diagnosis.robot.regression import LinearizationPoint, PoseRegression
from winchkit.diagnosis.robot.variance_components import (
    START,
    PoseNoise,
    Stack,
    noise_of,
    repeated_differences,
)
from winchkit.effects.bind_robot import robot_terms
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.placement import base_of
from winchkit.effects.term import Term
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

__all__ = [
    "Preparation",
    "balanced",
    "calibrated_on",
    "estimated_noise",
    "fitted_point",
    "own_effects",
    "prepare_selection",
]

_STEPS = 8
_STILL = 0.02
_UNBALANCED = 0.2
_BALANCING = frozenset({"payload-mass", "payload-centre", "cell-offset", "cell-thermal"})
"""What may explain an imbalance of tensions while their noise is sought. Not gains: no tension at
all and a platform without weight would balance anything."""


def own_effects(terms: Sequence[Term]) -> Hypothesis:
    """A hypothesis of a profile's own terms."""
    return Hypothesis(tuple(terms), (), ((),) * len(terms))


def fitted_point(
    dataset: RobotDataset,
    terms: Sequence[Term],
    sigma: Mapping[str, float],
    geometry: Sequence[GeometryPrior] = (),
) -> tuple[LinearizationPoint, tuple[Term, ...]]:
    """Geometry, poses and the profile's own effects at the best fit with a given noise."""
    point = LinearizationPoint(dataset, start_pose(dataset), sigma, tuple(geometry))
    terms = tuple(terms)
    for _ in range(_STEPS):
        point = _placed(point, terms)
        regression = PoseRegression(point)
        found = fit(regression, own_effects(terms), np.ones(regression.n_rows))
        terms = found.hypothesis.terms
        steps = found.vector[: regression.nuisance_columns.shape[1]]
        moves = steps[len(steps) - len(geometry) :].tolist()
        moved = tuple(b.moved(by) for b, by in zip(point.geometry, moves, strict=True))
        point = replace(point, geometry=moved)
        if not moves or max(map(abs, moves)) < _STILL:
            break
    return _placed(point, terms), terms


def _placed(point: LinearizationPoint, terms: Sequence[Term]) -> LinearizationPoint:
    robot = point.robot(terms)
    equations = Equations(point.dataset, point.pose, robot)
    return replace(point, pose=placed_by(equations, robot, point.sigma))


def estimated_noise(
    dataset: RobotDataset,
    terms: Sequence[Term],
    geometry: Sequence[GeometryPrior],
    candidates: Iterable[Effect],
) -> PoseNoise:
    """Noise of every kind of measurement, whatever may be missing from the model."""
    candidates = tuple(candidates)
    found = PoseNoise(START, {}, from_repeats=False, unexplained=START)
    for _ in range(2):
        point, own = fitted_point(dataset, terms, found.sigma, geometry)
        regression = PoseRegression(point)
        here = regression.residuals(own)
        columns = _columns(regression, own, candidates, here)
        kinds = [k for k, values in here.items() if np.isfinite(values).any()]
        slope = {k: v for k, v in regression.slope().items() if k in kinds}
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
    regression: PoseRegression,
    own: Sequence[Term],
    candidates: Sequence[Effect],
    here: dict[str, Array],
) -> dict[str, Array]:
    """What the residuals gain from the geometry and from every candidate, (p, k, m) by kind."""
    moved: list[dict[str, Array]] = []
    for effect in candidates:
        coordinates = Coordinates(effect)
        shape = coordinates.grid()[0]
        for usual_step in coordinates.usual_steps():
            term = Term(effect, {**effect.null, **shape, **usual_step})
            there = regression.residuals((*own, term))
            if base_of(effect) not in _BALANCING and "tension" in there:
                there["tension"] = here["tension"]
            moved.append(there)
    start = regression.residuals(()) if own else here
    moved += [
        {k: here[k] + there[k] - start[k] for k in here}
        for there in regression.residuals_by_geometry()
    ]
    out = {k: [m[k] - values for m in moved] for k, values in here.items()}
    for kind in ("swivel", "gauge"):
        for i in range(len(regression.dataset.names)):
            column = np.zeros_like(here[kind])
            column[:, i] = 1.0
            out[kind].append(column)
        for other in out:
            if other != kind:
                out[other] += [np.zeros_like(here[other])] * len(regression.dataset.names)
    return {k: np.nan_to_num(np.stack(v, axis=-1)) for k, v in out.items()}


_SHORT_LIST = 3


@dataclass(frozen=True)
class Preparation:
    """What stays the same however the geometry is taken."""

    dataset: RobotDataset
    catalogue: Catalogue
    candidates: tuple[Effect, ...]
    noise: PoseNoise
    prior: tuple[GeometryPrior, ...]
    """The geometry with the priors of a calibration."""
    guess: tuple[Term, ...] = ()
    """What is missing most likely: where the geometry is let go, it settles beside it."""

    @cached_property
    def own(self) -> tuple[Term, ...]:
        """The profile's own effects at their file values."""
        return robot_terms(self.dataset.robot, self.catalogue)

    def engine(
        self, geometry: Sequence[GeometryPrior], beside: tuple[Term, ...] = ()
    ) -> PoseSelection:
        """Beginning with the profile's own effects, the geometry believed as given."""
        terms = (*self.own, *beside)
        point, terms = fitted_point(self.dataset, terms, self.noise.sigma, geometry)
        regression = PoseRegression(point)
        initial_model = own_effects(terms[: len(self.own)])
        return PoseSelection(regression, initial_model, self.candidates, self.noise)

    def file_geometry(self, beside: tuple[Term, ...] = ()) -> PoseSelection:
        """With the numbers of the file, as sure as its calibration left them."""
        geometry = priors_of_geometry(self.dataset, self.catalogue, fitted=True)
        return self.engine(geometry, beside)

    def free_geometry(self) -> PoseSelection:
        """With the geometry fitted too."""
        return self.engine(self.prior, self.guess)

    def with_guess(self) -> Preparation:
        """With the effect that explains most beside the geometry, and the noise beside it.

        A geometry that was fitted without what is missing lies millimetres off, too far to be
        linear in between.
        """
        engine = self.free_geometry()
        present, noise = engine.fit_with_noise(engine.initial_model)
        listed = [s for s in engine.scores(present, noise) if s.net_gain > 0][:_SHORT_LIST]
        trials = [engine.trial(present, item, noise) for item in listed]
        best = min(trials, key=lambda t: t.criterion, default=None)
        if best is None or best.criterion > engine.criterion(present):
            return self
        guess = best.fit.hypothesis.terms[-1:]
        absent = tuple(e for e in self.candidates if e.id != guess[0].effect.id)
        noise_beside = estimated_noise(self.dataset, (*self.own, *guess), self.prior, absent)
        return replace(self, guess=guess, noise=noise_beside)


def prepare_selection(
    runs: Sequence[Run], profile: RobotProfile, catalogue: Catalogue
) -> Preparation:
    """Read poses and judge their noise. Raises RunError, and FileError for effects."""
    dataset = prepare_poses(runs, profile)
    own = robot_terms(profile, catalogue)
    prior = tuple(priors_of_geometry(dataset, catalogue, fitted=False))
    there = {term.effect.id for term in own}
    candidates = tuple(candidates_at(dataset, catalogue))
    absent = tuple(effect for effect in candidates if effect.id not in there)
    noise = estimated_noise(dataset, own, prior, absent)
    if not balanced(dataset, noise):
        dataset = replace(dataset, balanced=False)
        candidates = tuple(candidates_at(dataset, catalogue))
    return Preparation(dataset, catalogue, candidates, noise, prior).with_guess()


def calibrated_on(profile: RobotProfile, runs: Sequence[Run]) -> bool:
    """Whether the geometry was calibrated on some of these very runs."""
    known = {Path(name).name for name in profile.fitted.runs} if profile.fitted else set()
    return any(Path(run.path or run.name).name in known for run in runs)
