"""Joint estimate of poses, geometry and a profile's own effects by the solver of the calibration.

The geometry has the priors of the diagnosis and no bounds. The solver eliminates the poses by a
Schur complement; the regression problem (:mod:`winchkit.robot.diagnosis.regression`) eliminates
them at the solution by an orthonormal basis, which gives the same normal equations and independent
rows, as tests need.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from winchkit.effects.term import Term
from winchkit.model.stages import Stage
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.effects.term import modified_by_terms
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.robot.identification.bundle_adjustment import BundleState, Weights, solve
from winchkit.robot.identification.equations import RobotEquations, placed, started
from winchkit.robot.identification.parameters import Parameters, parameters_of
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.units import parse

GEOMETRY = {
    "exit-point": ("exit_point", ("x", "y", "z")),
    "anchor-point": ("anchor_point", ("x", "y", "z")),
    "swivel-radius": ("swivel_radius", ("radius_error",)),
    "drum-radius": ("winding_radius", ("radius_error",)),
    "layer-thickness": ("layer_growth", ("thickness_error",)),
}
"""Block of the parameters that each effect of the geometry changes, and its own parameters."""


@dataclass(frozen=True)
class GeometryNumber:
    """Free number of the geometry as a parameter of an effect."""

    effect: str
    """With its line."""
    parameter: str
    index: int
    """In the vector of parameters."""


@dataclass(frozen=True)
class LinearizationPoint:
    """Parameters and poses at which a regression is linearised."""

    dataset: RobotDataset
    equations: RobotEquations
    """Without effects; free numbers of the geometry are nuisance parameters."""
    state: BundleState
    sigma: Mapping[str, float]
    """Standard deviation per type of measurement, SI."""
    instruments: tuple[Term, ...] = ()
    """Effects of the tracker at which the derivatives by the pose are taken."""

    @property
    def pose(self) -> Pose:
        """Estimated pose of the platform in every row."""
        return self.state.pose

    @cached_property
    def geometry(self) -> tuple[GeometryNumber, ...]:
        """Free numbers of the geometry."""
        return free_geometry(self.equations.parameters, self.dataset.names)

    @cached_property
    def profile(self) -> RobotProfile:
        """Robot profile with the geometry at its present values."""
        return self.equations.profile_at(self.state.values)

    @cached_property
    def _nominal(self) -> Robot:
        return robot_of(self.profile)

    def robot(self, terms: Sequence[Term] = ()) -> Robot:
        """Robot model with effects, at the present geometry."""
        return modified_by_terms(self._nominal, terms)


def free_geometry(parameters: Parameters, lines: Sequence[str]) -> tuple[GeometryNumber, ...]:
    """Numbers of the geometry that are not held."""
    out = []
    for effect, (block, names) in GEOMETRY.items():
        places = [""] if block == "layer_growth" else [f"/{line}" for line in lines]
        indices = parameters.block[block].reshape(len(places), len(names)).tolist()
        out += [
            GeometryNumber(effect + place, name, index)
            for place, row in zip(places, indices, strict=True)
            for name, index in zip(names, row, strict=True)
            if parameters.std[index] > 0
        ]
    return tuple(out)


def geometry_parameters(
    dataset: RobotDataset, stated: Mapping[str, str] | None = None
) -> Parameters:
    """Parameters of the geometry, without bounds, and the zeros of instruments; the standard
    deviations are ``stated``, zero for the others, else those of a calibration."""
    robot = robot_of(replace(dataset.robot, effect=()))
    parameters = parameters_of(robot, dataset.measured)
    everything = []
    for own in parameters:
        std = own.std
        if stated is not None and std > 0 and not own.zero:
            std = parse(stated[own.name], "length") if own.name in stated else 0.0
        everything.append(replace(own, std=std, low=-np.inf, high=np.inf))
    return replace(parameters, all=tuple(everything))


def equations_of(dataset: RobotDataset, geometry: Parameters) -> RobotEquations:
    """Constraint equations of a data set without effects."""
    measured = dataset.measured
    if not dataset.has_tension:
        measured = replace(measured, tension=np.full_like(measured.tension, np.nan))
    return RobotEquations(
        robot_of(replace(dataset.robot, effect=())),
        geometry,
        measured,
        trajectory=dataset.trajectory,
        balanced=dataset.has_balance,
    )


def _with_terms(equations: RobotEquations, terms: Sequence[Term]) -> RobotEquations:
    parameters = equations.parameters.with_terms(terms)
    return replace(equations, parameters=parameters, terms=tuple(terms))


def point_of_file(
    dataset: RobotDataset, terms: Sequence[Term], sigma: Mapping[str, float]
) -> LinearizationPoint:
    """Least-squares estimate of the poses alone, with geometry and effects as given."""
    equations = equations_of(dataset, geometry_parameters(dataset, {}))
    pose = placed(_with_terms(equations, terms), sigma).pose
    return LinearizationPoint(
        dataset, equations, BundleState(equations.parameters.nominal, pose), sigma
    )


def fitted_point(
    dataset: RobotDataset,
    terms: Sequence[Term],
    sigma: Mapping[str, float],
    geometry: Parameters,
) -> tuple[LinearizationPoint, tuple[Term, ...]]:
    """Geometry, poses, effects and instruments' zeros at their best fit under a given noise."""
    equations = equations_of(dataset, geometry)
    joint, start = started(_with_terms(equations, terms), sigma)
    found = solve(joint, start, Weights(sigma)).state
    terms = joint.terms_at(found.values)
    # The regression has zeros of its own.
    zero = np.array([own.zero for own in geometry])
    values = np.where(zero, 0.0, found.values[: len(geometry)])
    instruments = tuple(term for term in terms if term.effect.stage is Stage.TRACKER)
    state = BundleState(values, found.pose)
    return LinearizationPoint(dataset, equations, state, sigma, instruments), terms
