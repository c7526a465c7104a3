"""Joint estimate of poses, geometry and a profile's own effects by the solver of the calibration.

The observation equations of :mod:`winchkit.robot.diagnosis.equations` as functions of

* the numbers of the geometry, with the priors of the diagnosis and analytic derivatives,
* the coordinates of effects, with a flat prior and forward differences, since an effect of the
  catalogue, perhaps a user's own, has no derivatives,
* the zeros of swivel angles and the offsets of length instruments, with the priors of a
  calibration about their mean readings.

:func:`winchkit.robot.identification.bundle_adjustment.solve` eliminates the poses by a Schur
complement. The regression problem (:mod:`winchkit.robot.diagnosis.regression`) eliminates them at
the solution by an orthonormal basis, which gives the same normal equations and independent rows, as
tests need.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.robot.diagnosis.data.dataset import RobotDataset
from winchkit.robot.diagnosis.equations import POSED, Equations, start_pose
from winchkit.robot.diagnosis.prior import GeometryPrior, profile_with_geometry
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.geometry.constraints import ZERO_STD, Constraint, mean_offset
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import Rows, State, Weights, place, solve

_FLAT = 1e3
"""Standard deviation of the prior of an effect's coordinates, which are near one in size."""
_STEP = 1e-3
"""Step of a forward difference by an effect's coordinate; numerical."""
_PLACED_BY = ("closure", "position", "rotation", "tension", "statics")
STD_OF_ZERO = {"swivel": ZERO_STD["swivel"], "gauge": ZERO_STD["cable_length"]}
"""Standard deviation of the prior of an instrument's zero, by kind of residual."""


@dataclass(frozen=True)
class _Unknowns:
    """Parameters of an adjustment, (q,) each: geometry, coordinates of effects, zeros."""

    nominal: Array
    std: Array
    low: Array
    high: Array

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds."""
        return self.low, self.high


@dataclass(frozen=True)
class Adjusted:
    """Result of an adjustment.

    Attributes
    ----------
    pose : Pose
        Estimated poses, one per row of the data set.
    geometry : tuple of GeometryPrior
        Numbers of the geometry at their estimates.
    terms : tuple of Term
        Effects at their estimates.
    """

    pose: Pose
    geometry: tuple[GeometryPrior, ...]
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class _Adjustment:
    """Observation equations as functions of poses and parameters."""

    dataset: RobotDataset
    own_terms: tuple[Term, ...]
    own_geometry: tuple[GeometryPrior, ...]
    zeros: Mapping[str, Array]
    """Mean readings of instruments with an unknown zero, (n,) by kind."""

    @property
    def parameters(self) -> _Unknowns:
        """Parameters at the values where the adjustment starts."""
        coordinates = [Coordinates(term.effect) for term in self.own_terms]
        bounds = [c.bounds() for c in coordinates]
        geometry, zeros = self.own_geometry, self.zeros
        free = np.full(len(geometry), np.inf)
        n_zeros = sum(map(len, zeros.values()))
        nominal = [
            np.array([item.at for item in geometry]),
            *(c.vector(t.values) for c, t in zip(coordinates, self.own_terms, strict=True)),
            *zeros.values(),
        ]
        std = [
            np.array([item.std for item in geometry]),
            *(np.full(len(c), _FLAT) for c in coordinates),
            *(np.full(len(values), STD_OF_ZERO[kind]) for kind, values in zeros.items()),
        ]
        low = [-free, *(b[0] for b in bounds), np.full(n_zeros, -np.inf)]
        high = [free, *(b[1] for b in bounds), np.full(n_zeros, np.inf)]
        return _Unknowns(*map(np.concatenate, (nominal, std, low, high)))

    def geometry(self, values: Array) -> tuple[GeometryPrior, ...]:
        """Numbers of the geometry at parameter values."""
        given = zip(self.own_geometry, values[: len(self.own_geometry)].tolist(), strict=True)
        return tuple(item.moved((value - item.value) / item.std) for item, value in given)

    def terms(self, values: Array) -> tuple[Term, ...]:
        """Effects at parameter values."""
        out, at = [], len(self.own_geometry)
        for term in self.own_terms:
            coordinates = Coordinates(term.effect)
            part = values[at : at + len(coordinates)]
            out.append(Term(term.effect, coordinates.values(part, term.values)))
            at += len(coordinates)
        return tuple(out)

    def robot(self, values: Array) -> Robot:
        """Robot model at parameter values."""
        profile = profile_with_geometry(self.dataset.robot, self.geometry(values))
        return robot_with_terms(profile, self.terms(values))

    def constraints(self, state: State) -> Iterator[tuple[str, Constraint]]:
        """Equations by kind with derivatives by the pose."""
        robot = self.robot(state.values)
        equations = Equations(self.dataset, state.pose, robot)
        by_pose = equations.by_pose(robot)
        for kind, residual in self._residuals(equations, robot, state.values).items():
            by = by_pose.get(kind)
            yield kind, Constraint(residual, np.zeros((*residual.shape, 6)) if by is None else by)

    def rows(self, state: State) -> Iterator[Rows]:
        """Equations by kind with derivatives by the vector of parameters."""
        robot = self.robot(state.values)
        equations = Equations(self.dataset, state.pose, robot)
        here = self._residuals(equations, robot, state.values)
        by_pose = equations.by_pose(robot)
        by_values = self._by_values(equations, robot, state.values, here)
        for kind, residual in here.items():
            by = by_pose.get(kind)
            by = np.zeros((*residual.shape, 6)) if by is None else by
            yield Rows(kind, residual, by, by_values[kind])

    def _residuals(self, equations: Equations, robot: Robot, values: Array) -> dict[str, Array]:
        """Residuals with the zeros of the instruments, by kind that was measured."""
        found = equations.residuals(robot)
        at = len(values) - sum(map(len, self.zeros.values()))
        for kind, own in self.zeros.items():
            found[kind] = found[kind] + values[at : at + len(own)]
            at += len(own)
        if self.dataset.hangs:
            # A part of the statics, which have all of it.
            found.pop("tension")
        return {kind: r for kind, r in found.items() if np.isfinite(r).any()}

    def _by_values(
        self, equations: Equations, robot: Robot, values: Array, here: Mapping[str, Array]
    ) -> dict[str, Array]:
        """Derivatives by the parameters, (p, k, q), by kind."""
        out = {kind: np.zeros((*r.shape, len(values))) for kind, r in here.items()}
        geometry = self.geometry(values)
        for kind, part in equations.by_geometry(robot, geometry).items():
            if kind in out:
                out[kind][..., : len(geometry)] = part
        end = len(values) - sum(map(len, self.zeros.values()))
        _, high = self.parameters.bounds
        for index in range(len(geometry), end):
            step = _STEP * max(1.0, abs(values[index]))
            moved = values.copy()
            moved[index] += step if values[index] + step <= high[index] else -step
            there = self._residuals(equations, self.robot(moved), moved)
            for kind, residual in here.items():
                difference = there[kind] - residual
                out[kind][..., index] = difference / (moved[index] - values[index])
        for kind, own in self.zeros.items():
            line = np.arange(len(own))
            if kind in out:
                out[kind][:, line, end + line] = 1.0
            end += len(own)
        return out


def placed(dataset: RobotDataset, terms: Sequence[Term], sigma: Mapping[str, float]) -> Pose:
    """Least-squares estimate of the poses with geometry and effects as given.

    Swivel angles and length instruments take no part: their zeros are not known.
    """
    adjustment = _Adjustment(dataset, tuple(terms), (), {})
    return _placed(adjustment, sigma).pose


def adjusted(
    dataset: RobotDataset,
    terms: Sequence[Term],
    sigma: Mapping[str, float],
    geometry: Sequence[GeometryPrior] = (),
) -> Adjusted:
    """Estimate of poses, geometry, effects and instruments' zeros at once.

    ``sigma``: standard deviation per type of measurement, SI.
    """
    adjustment = _Adjustment(dataset, tuple(terms), tuple(geometry), {})
    state = _placed(adjustment, sigma)
    robot = adjustment.robot(state.values)
    found = Equations(dataset, state.pose, robot).residuals(robot)
    adjustment = replace(adjustment, zeros=instrument_zeros(found, dataset))
    start = State(adjustment.parameters.nominal, state.pose)
    state = solve(adjustment, start, Weights(sigma)).state
    return Adjusted(state.pose, adjustment.geometry(state.values), adjustment.terms(state.values))


def _placed(adjustment: _Adjustment, sigma: Mapping[str, float]) -> State:
    low, high = adjustment.parameters.bounds
    values = np.clip(adjustment.parameters.nominal, low, high)
    used = {kind: sigma[kind] if kind in _PLACED_BY else np.inf for kind in (*POSED, "tension")}
    return place(adjustment, State(values, start_pose(adjustment.dataset)), Weights(used))


def instrument_zeros(residuals: Mapping[str, Array], dataset: RobotDataset) -> dict[str, Array]:
    """First estimate of the zeros of swivel angles and length instruments, (n,) by kind."""
    kinds = [] if dataset.measured.length_zeroed else ["gauge"]
    if isinstance(dataset.robot.instrument.swivels.zero, str):
        kinds.insert(0, "swivel")
    return {
        kind: mean_offset(residuals[kind], angles=kind == "swivel")
        for kind in kinds
        if np.isfinite(residuals[kind]).any()
    }
