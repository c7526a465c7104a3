"""Linearisation point of a robot's identification: geometry, poses and noise before the selection.

Geometry, poses and a profile's own effects are estimated jointly by the solver of the calibration,
so that the model is linearised at its best fit. The noise is estimated by variance components.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.special import fdtri

from winchkit.arrays import Array
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.placement import base_of
from winchkit.effects.term import Term
from winchkit.model.rotation import rotation_of, rotation_vector
from winchkit.robot.diagnosis.adjustment import fitted_point, geometry_parameters
from winchkit.robot.diagnosis.candidates import BALANCING, candidates_at
from winchkit.robot.diagnosis.dataset import RobotDataset, prepare_poses
from winchkit.robot.diagnosis.engine import PoseSelection, TrajectorySelection
from winchkit.robot.diagnosis.registration import Registration, registration_of
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.diagnosis.trajectory_regression import TrajectoryRegression, regression_at
from winchkit.robot.effects.bind import robot_terms
from winchkit.robot.geometry.robot import robot_of
from winchkit.robot.identification.bundle_adjustment import Rows
from winchkit.robot.identification.parameters import Parameters
from winchkit.robot.identification.variance_components import START, PoseNoise, noise_of
from winchkit.robot.mistakes.search import refuse_mistakes
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

_MOST_IMBALANCE = 0.2
"""Unexplained imbalance over the standard deviation of tensions above which the balance is left
out; rule of thumb."""


def own_effects(terms: Sequence[Term]) -> Hypothesis:
    """Hypothesis of a profile's own effects."""
    return Hypothesis(tuple(terms), (), ((),) * len(terms))


def estimated_noise(
    dataset: RobotDataset,
    terms: Sequence[Term],
    geometry: Parameters,
    candidates: Iterable[Effect],
) -> PoseNoise:
    """Variance components of the measurements beside all candidate effects."""
    candidates = tuple(candidates)
    found = PoseNoise(START, {}, from_repeats=False, unexplained=START)
    for _ in range(2):
        point, own = fitted_point(dataset, terms, found.sigma, geometry)
        regression = regression_at(point)
        here = regression.residuals(own)
        columns, slope = _columns(regression, own, candidates, here), regression.slope
        kinds = [k for k, values in here.items() if np.isfinite(values).any()]
        if dataset.hangs:
            kinds.remove("tension")
        found = noise_of(
            [
                Rows(k, here[k], slope.get(k, np.zeros((*here[k].shape, 6))), columns[k])
                for k in kinds
            ],
            dataset.pose,
        )
        same = "balance" if dataset.hangs else "tension"
        force = found.sigma.get(same, START[same])
        found = replace(found, sigma={**START, **found.sigma, "balance": force, "tension": force})
    return found


def balanced(dataset: RobotDataset, noise: PoseNoise) -> bool:
    """Whether the imbalance of the tensions that no payload explains, nor the effect that explains
    most, is below 20 % of their standard deviation. Else an unmodelled force acts on the platform,
    or the load cells do not measure these cables."""
    if not dataset.has_tension:
        return True
    spread = float(np.nanstd(dataset.measured.tension))
    kind = "balance" if dataset.hangs else "tension"
    return noise.unexplained.get(kind, 0.0) <= _MOST_IMBALANCE * spread


def _columns(
    regression: PoseRegression,
    own: Sequence[Term],
    candidates: Sequence[Effect],
    here: dict[str, Array],
) -> dict[str, Array]:
    """Changes of the residuals by the geometry and every candidate, (p, k, m) by type."""
    moved: list[dict[str, Array]] = []
    for effect in candidates:
        coordinates = Coordinates(effect)
        shape = coordinates.grid()[0]
        for usual_step in coordinates.usual_steps():
            term = Term(effect, {**effect.null, **shape, **usual_step})
            there = regression.residuals((*own, term))
            if base_of(effect) not in BALANCING and "tension" in there:
                there["tension"] = here["tension"]
            moved.append(there)
    geometry = regression.change_by_geometry()
    out = {k: [m[k] - v for m in moved] + [m[k] for m in geometry] for k, v in here.items()}
    for kind in ("swivel", "cable_length"):
        for i in range(len(regression.dataset.names)):
            column = np.zeros_like(here[kind])
            column[:, i] = 1.0
            out[kind].append(column)
        for other in out:
            if other != kind:
                out[other] += [np.zeros_like(here[other])] * len(regression.dataset.names)
    return {k: np.nan_to_num(np.stack(v, axis=-1)) for k, v in out.items()}


_SHORT_LIST = 3
"""Candidates that are fitted beside a free geometry; computing cost, rule of thumb."""
_GEOMETRY_LEVEL = 1e-3
"""Level of the F test of a free geometry: screened."""


@dataclass(frozen=True)
class Preparation:
    """Data, candidates and noise of a robot's identification, for any treatment of its geometry."""

    dataset: RobotDataset
    """Poses of one robot."""
    catalogue: Catalogue
    """Effects."""
    candidates: tuple[Effect, ...]
    """Effects at their places that the poses could show."""
    noise: PoseNoise
    """Variance components."""
    prior: Parameters
    """The geometry with the priors of a calibration."""
    guess: tuple[Term, ...] = ()
    """The effect that explains most, beside which a free geometry is fitted."""
    registration: Registration | None = None
    """Effects of the tracker in the initial model."""

    @cached_property
    def of_file(self) -> tuple[Term, ...]:
        """The profile's own effects at their file values."""
        return tuple(robot_terms(self.dataset.robot, self.catalogue, moving=self.dataset.moves))

    @cached_property
    def own(self) -> tuple[Term, ...]:
        """The profile's own effects at their file values, and those of the registration."""
        return (*self.of_file, *(self.registration.terms if self.registration else ()))

    @property
    def found(self) -> range:
        """Indices of the effects that the registration found, in the initial model."""
        count = len(self.registration.found) if self.registration else 0
        return range(len(self.of_file), len(self.of_file) + count)

    def engine(self, geometry: Parameters, beside: tuple[Term, ...] = ()) -> PoseSelection:
        """Selection engine with the given geometry as nuisance parameters."""
        terms = (*self.own, *beside)
        point, terms = fitted_point(self.dataset, terms, self.noise.sigma, geometry)
        initial_model = own_effects(terms[: len(self.own)])
        if self.dataset.moves:
            motion = TrajectoryRegression(point)
            return TrajectorySelection(motion, initial_model, self.candidates, self.noise)
        return PoseSelection(PoseRegression(point), initial_model, self.candidates, self.noise)

    def file_geometry(self, beside: tuple[Term, ...] = ()) -> PoseSelection:
        """Selection engine with the geometry of the file and its calibration's uncertainty."""
        fitted = self.dataset.robot.fitted
        geometry = geometry_parameters(self.dataset, fitted.std if fitted else {})
        return self.engine(geometry, beside)

    def free_geometry(self) -> PoseSelection:
        """Selection engine with the geometry free, under the priors of a calibration."""
        return self.engine(self.prior, self.guess)

    def gain_of_geometry(self, engine: PoseSelection, model: Hypothesis, noise: BandNoise) -> float:
        """Decrease of χ² by a free geometry, beyond its calibration's uncertainty."""
        point = engine.regression.point
        geometry = self.prior.about(point.state.values)
        free = regression_at(
            replace(point, equations=replace(point.equations, parameters=geometry))
        )
        hypothesis = replace(model, nuisances=())
        chi_square = [
            fit(regression, hypothesis, noise.inverse_sigma(regression)).chi_square
            for regression in (engine.regression, free)
        ]
        return chi_square[0] - chi_square[1]

    def geometry_is_significant(self, gain: float) -> bool:
        """F test, level 0.1 %, of the decrease of χ² by the k numbers of the geometry: F =
        Δχ²/k."""
        count, dof = (
            int(np.count_nonzero(self.prior.lasting)),
            self.noise.dof.get("cable_length", 1.0),
        )
        return gain / count > float(fdtri(count, max(dof, 1.0), 1 - _GEOMETRY_LEVEL))

    def with_guess(self) -> Preparation:
        """The same with the effect that explains most beside a free geometry, and its noise: a
        geometry fitted without it may be millimetres off, too far for a linear model."""
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
    """Read poses, estimate their noise and collect the candidates. Raises RunError with every fault
    and mistake of the runs; FileError for effects that do not bind."""
    dataset = prepare_poses(runs, profile)
    if not dataset.moves:
        refuse_mistakes(robot_of(profile), dataset.measured)
    own = robot_terms(profile, catalogue, moving=dataset.moves)
    registration = registration_of(dataset, own, catalogue)
    dataset, own = registration.dataset, (*own, *registration.terms)
    prior = geometry_parameters(dataset)
    there = {term.effect.id for term in own}
    candidates = tuple(candidates_at(dataset, catalogue))
    absent = tuple(effect for effect in candidates if effect.id not in there)
    noise = estimated_noise(dataset, own, prior, absent)
    first = Preparation(dataset, catalogue, candidates, noise, prior, registration=registration)
    prepared = first.with_guess()
    if balanced(dataset, prepared.noise):
        return prepared
    dataset = replace(dataset, balanced=False)
    candidates = tuple(candidates_at(dataset, catalogue))
    return replace(first, dataset=dataset, candidates=candidates).with_guess()


def calibrated_on(profile: RobotProfile, runs: Sequence[Run]) -> bool:
    """Whether the geometry was calibrated on some of these runs."""
    known = {Path(name).name for name in profile.fitted.runs} if profile.fitted else set()
    return any(Path(run.path or run.name).name in known for run in runs)


_LEAST_ROTATION = np.radians(1.0)
"""Rotation of the platform below which a note says that it never turned, rad; rule of thumb."""
_LEAST_POSES = 40
"""Distinct poses below which a note asks for more; rule of thumb."""


def missing_pose_excitation(preparation: Preparation) -> Iterator[str]:
    """Sentences on missing repeats, tensions, temperatures, rotations, and on few poses."""
    dataset, measured = preparation.dataset, preparation.dataset.measured
    if dataset.moves:
        yield (
            "a trajectory has no repeats: the noise is what neither geometry nor any known effect "
            "explains, so an effect outside the catalogue cannot be excluded; record poses at "
            "rest, some ten of them twice"
        )
    elif not preparation.noise.from_repeats:
        yield (
            "too few poses repeat another: the noise is what neither geometry nor any known effect "
            "explains, so an effect outside the catalogue cannot be excluded; drive to some ten "
            "poses twice"
        )
    if not dataset.has_tension:
        yield (
            "no tensions measured: what depends on the cables' force (elasticity, payload, cells) "
            "cannot be seen; record LINE.tension [N]"
        )
    elif not dataset.has_balance:
        yield (
            "the tensions measured do not carry the platform's weight, whatever it is: payload and "
            "cells cannot be judged; does something else pull at the platform?"
        )
    if not np.isfinite(measured.temperature).all():
        yield "no temperature measured: thermal effects cannot be detected"
    if not np.isfinite(measured.position).any():
        yield "no position measured: the origin of the platform frame cannot be determined"
    whole = measured.angles[np.isfinite(measured.angles).all(axis=1)]
    if len(whole):
        turned = rotation_vector(rotation_of(*whole.T) @ rotation_of(*whole[0]).T)
        if float(np.max(np.linalg.norm(turned, axis=1))) < _LEAST_ROTATION:
            yield (
                "the platform never turned: exit and anchor points cannot be distinguished; "
                "turn it between poses"
            )
    distinct = int(dataset.pose.max()) + 1
    if distinct < _LEAST_POSES:
        yield f"{distinct} distinct poses only; ninety, widely spread, are much more informative"
