"""Identifiability of a robot's parameters: rank, posterior, and unidentifiable directions in words.

The information matrix of the scaled parameters, poses and zeros of instruments eliminated, is
decomposed into its eigenvectors. A direction with an eigenvalue below 1e-11 of the largest is not
identifiable at any noise; one with an eigenvalue below one gets more from the prior than from data.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import mean_rotation, rotation_by, rotation_vector, skew
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.identification.bundle_adjustment import (
    BundleState,
    ReducedEquations,
    Solution,
    Weights,
    linearise,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.parameters import Parameters

_LEAST_EIGENVALUE = 1e-11
"""Least eigenvalue of an identifiable direction, as a share of the largest: above rounding."""
_SIGNIFICANT = 25.0
"""Variance of rotations over that of their noise above which the platform has turned (rule of
thumb: five standard deviations)."""
_LEAST_COMPLEMENT = 0.1
"""Least singular value of a direction that others do not span (rule of thumb)."""
_OF_THE_ROBOT = ("exit_point", "anchor_point", "winding_radius", "swivel_radius")
_UNDETERMINED, _FAR = 1e-2, 30.0
"""Information of the data, in that of the prior, below which a combination is not determined, and
distance of these together, in standard deviations, from which a robot is another one (rules of
thumb: a real robot with points 250 mm off ended at 9, wrong solutions at 700)."""
_NAMED = 4
"""Parameters in a line, the largest shares first; four fit a terminal's line."""
_LISTED = 6
"""Combinations in the report; the rest are counted."""


@dataclass(frozen=True)
class Observability:
    """Directions of the parameters by the information of the data about them."""

    std: Array
    """Posterior standard deviation in fitted units, (q,)."""
    information: Array
    """Eigenvalues in descending order; 1 is the information of the prior."""
    rank: int
    """Number of identifiable directions."""
    weak: int
    """Number of directions with more information from the prior than from the data."""
    unobservable: tuple[str, ...]

    @property
    def free(self) -> int:
        """Number of fitted parameters."""
        return len(self.information)


def observability(equations: RobotEquations, solution: Solution, weights: Weights) -> Observability:
    """Rank, posterior and unidentifiable directions at the end of a fit."""
    scale = equations.parameters.std
    data = solution.linear.information
    inverse = np.linalg.inv(data + np.eye(len(data)))
    std = scale * np.sqrt(np.maximum(np.diagonal(inverse), 0.0))
    lasting = equations.parameters.lasting
    significant = _significant_information(equations, solution, weights)[np.ix_(lasting, lasting)]
    values, vectors = np.linalg.eigh(significant)
    unidentifiable = values < _LEAST_EIGENVALUE * values[-1]
    words = tuple(
        _words(equations, significant, vectors[:, unidentifiable], _LEAST_EIGENVALUE * values[-1])
    )
    return Observability(
        std,
        values[::-1],
        int(np.count_nonzero(~unidentifiable)),
        int(np.count_nonzero(values < 1)),
        words,
    )


def undetermined_move(
    given: RobotEquations, equations: RobotEquations, solution: Solution
) -> float:
    """Distance of the robot's points and radii from those of the file in combinations that the
    poses do not determine, in standard deviations of their priors; zero where it is small or the
    smaller part of the whole distance. What no data determine stays where its prior has it, unless
    the fit went to another solution of its equations."""
    own, file = equations.parameters, given.parameters
    moved = np.zeros(len(own.std))
    for block in _OF_THE_ROBOT:
        index, first = own.block[block].ravel(), file.block[block].ravel()
        change, std = solution.state.values[index] - file.nominal[first], file.std[first]
        moved[index] = np.divide(change, std, out=np.zeros_like(change), where=std > 0)
    values, vectors = np.linalg.eigh(solution.linear.information)
    part = vectors.T @ moved
    size = float(np.linalg.norm(part[values < _UNDETERMINED]))
    return size if size > max(_FAR, float(np.linalg.norm(part)) / 2) else 0.0


def _significant_information(
    equations: RobotEquations, solution: Solution, weights: Weights
) -> Array:
    """Information, zeros of instruments eliminated, at poses with the significant part of their
    rotations: a platform that never turned seems to turn by the noise of its poses, which would
    make exit and anchor points seem identifiable."""
    pose, many = solution.state.pose, len(solution.state.pose.rotation)
    mean, home = mean_rotation(pose.rotation), equations.robot.home.rotation[0]
    turned = rotation_vector(pose.rotation @ mean.T)
    noise = _rotation_noise(solution.linear)
    home_difference = rotation_vector(mean @ home.T)
    mean_or_home = (
        home if home_difference @ home_difference <= _SIGNIFICANT * np.trace(noise) else mean
    )
    size, axes = np.linalg.eigh(turned.T @ turned / many)
    is_significant = size > _SIGNIFICANT * np.einsum("ik,ij,jk->k", axes, noise, axes)
    data = solution.linear.information
    if not np.all(is_significant):
        kept = axes * is_significant
        significant = Pose(pose.position, rotation_by(turned @ kept @ kept.T) @ mean_or_home)
        state = BundleState(solution.state.values, significant)
        data = linearise(equations, state, weights).information
    zeros = equations.parameters.free & ~equations.parameters.lasting
    if not np.any(zeros):
        return data
    coupled = data[:, zeros]
    return np.asarray(data - coupled @ np.linalg.solve(data[np.ix_(zeros, zeros)], coupled.T))


def _rotation_noise(linear: ReducedEquations) -> Array:
    """Mean covariance of the poses' rotations, with that of the parameters, (3, 3)."""
    inverse = np.swapaxes(linear.factor, 1, 2) @ linear.factor
    coupled = np.swapaxes(linear.stack.by_pose, 1, 2) @ linear.stack.by_values
    by_parameters = (inverse[:, 3:] @ coupled).reshape(-1, coupled.shape[2])
    posterior = np.linalg.inv(linear.information + np.eye(len(linear.gradient)))
    spread = (by_parameters @ posterior).reshape(len(inverse), 3, -1)
    spread = spread @ np.swapaxes(by_parameters.reshape(len(inverse), 3, -1), 1, 2)
    return np.asarray(np.mean(inverse[:, 3:, 3:] + spread, axis=0))


def _words(
    equations: RobotEquations, data: Array, unidentifiable: Array, floor: float
) -> Iterator[str]:
    """Directions with a known reason first, then the others by their largest parameters."""
    if not unidentifiable.shape[1]:
        return
    lasting = equations.parameters.lasting
    explained = np.zeros((int(np.count_nonzero(lasting)), 0))
    for text, directions in _reasons(equations):
        own = [d[lasting] / np.linalg.norm(d[lasting]) for d in directions]
        not_identifiable = np.array([d for d in own if d @ data @ d < floor]).reshape(
            -1, len(explained)
        )
        new = _complement(explained, not_identifiable.T)
        if count := new.shape[1]:
            explained = np.concatenate([explained, new], axis=1)
            yield text.format(count=count, s="s" if count > 1 else "")
    names = [p.name for p in equations.parameters if p.std > 0 and not p.zero]
    others = _complement(explained, unidentifiable).T
    for direction in others[:_LISTED]:
        largest = np.argsort(-np.abs(direction))[:_NAMED]
        listed = ", ".join(f"{direction[i]:+.2f} {names[i]}" for i in largest)
        yield f"only the prior determines the combination {listed}"
    if len(others) > _LISTED:
        yield f"and {len(others) - _LISTED} more combinations of that kind"


def _complement(explained: Array, directions: Array) -> Array:
    """Orthonormal basis of ``directions`` (q, k) with the basis ``told`` (q, m) projected out."""
    rest = directions - explained @ (explained.T @ directions)
    left, size, _ = np.linalg.svd(rest, full_matrices=False)
    return np.asarray(left[:, size > _LEAST_COMPLEMENT])


def _reasons(equations: RobotEquations) -> Iterator[tuple[str, list[Array]]]:
    """Directions in scaled parameters that are not identifiable for a known reason."""
    home, lines = equations.robot.home, len(equations.robot.names)
    turn = home.rotation[0]

    def points(shift: Array) -> Array:
        """Shift exit points by (n, 3), and anchor points by the same vectors at home."""
        return _scaled(equations, {"exit_point": shift, "anchor_point": shift @ turn})

    each = np.eye(3 * lines).reshape(3 * lines, lines, 3)
    yield (
        "no rotation in the data: exit and anchor points cannot be distinguished "
        "({count} direction{s}); turn the platform between poses",
        [points(shift) for shift in each],
    )
    nominal = equations.robot.geometry
    seen = nominal.exit_point - home.position
    whole = [points(np.tile(axis, (lines, 1))) for axis in np.eye(3)]
    for axis in np.eye(3):
        rotated = {
            "exit_point": seen @ skew(axis).T,
            "anchor_point": nominal.anchor_point @ (turn.T @ skew(axis) @ turn).T,
        }
        whole.append(_scaled(equations, rotated))
    yield (
        "nothing measured ties the platform to the base frame: all exit and anchor points may be "
        "shifted or turned together ({count} direction{s}); measure positions",
        whole,
    )
    block = equations.parameters.block
    if equations.parameters.free[block["layer_growth"][0]]:
        gain, turned = equations.winding.gain, equations.winding.turned
        weight = np.nansum(turned * turned, axis=0)
        radius = -np.nansum(gain * turned, axis=0) / np.where(weight > 0, weight, 1.0)
        yield (
            "the cables stay within one layer: the layer growth cannot be distinguished from the "
            "winding radii ({count} direction{s}); wind over more turns",
            [_scaled(equations, {"winding_radius": radius, "layer_growth": np.ones(1)})],
        )


def _scaled(equations: RobotEquations, shift: dict[str, Array]) -> Array:
    """Shift of blocks of parameters in standard deviations of their priors, (q,)."""
    scale = equations.parameters.std
    out = np.zeros(len(scale))
    for name, part in shift.items():
        own = equations.parameters.block[name]
        out[own] = np.divide(part, scale[own], out=np.zeros_like(part), where=scale[own] > 0)
    return out


_FEW, _MOST = 3, 20_000
"""Rows: three poses determine a frame; more than 20 000 are the log of a motion and no poses at
rest (rule of thumb)."""
_ACROSS = 0.05
"""Share of the same distance by which positions may differ from home across the guides (rule of
thumb: 50 mm at 1 m make a cable 1 mm longer)."""
_REACH = 2.0
"""In the largest distance of two exit points: a platform is between them, so that poses measured at
twice that distance are in another unit or frame."""


def refuse_unfit(equations: RobotEquations) -> None:
    """Raise UsageError for poses that are too few, too many, without redundancy or out of reach."""
    measured, many = equations.measured, len(equations.measured)
    known = equations.count
    lines, degrees = measured.motor_angle.shape[1], equations.robot.geometry.degrees
    if many > _MOST:
        raise UsageError(
            f"{many} rows: each is a pose at rest, and at most {_MOST} can be fitted; keep the "
            "rows where the platform stood"
        )
    _refuse_out_of_reach(equations)
    _refuse_other_motions(equations)
    if many < _FEW or known <= degrees * many:
        cure = f"record more poses (90 is a good number, {_FEW} the least)"
        if known <= degrees * many:
            cure = "measure more at each: positions, rotations, swivel angles or cable lengths"
        raise UsageError(
            f"{many} poses with {known} measured values cannot calibrate a robot of {lines} lines: "
            f"{degrees * many} of them determine the poses themselves; {cure}"
        )


def _refuse_out_of_reach(equations: RobotEquations) -> None:
    """Refuse positions that a robot of this size cannot reach: wrong unit or frame."""
    if equations.instruments is not None and "frame" in equations.instruments.free:
        return
    home = equations.robot.home.position
    size = equations.robot.geometry.size
    distance = np.linalg.norm(equations.measured.position - home, axis=1)
    distance = distance[np.isfinite(distance)]
    if len(distance) and float(np.median(distance)) > _REACH * size:
        raise UsageError(
            f"the positions measured lie {float(np.median(distance)):.4g} m from home, in a robot "
            f"whose exit points are at most {size:.4g} m apart; is platform_x … in its unit and in "
            'the base frame? Of a tracker elsewhere declare frame = "unknown" in '
            "[instrument.tracker]"
        )


def _refuse_other_motions(equations: RobotEquations) -> None:
    """Refuse positions and planes of cables that contradict the declared degrees of freedom."""
    robot = equations.robot
    if robot.hangs and (names := robot.planar):
        listed = ", ".join(f'"{name}"' for name in names)
        raise UsageError(
            f"all cables of '{robot.profile.name}' lie in one plane and say nothing of motions "
            f"across it; of a planar robot declare degrees_of_freedom = [{listed}] in [platform]"
        )
    if equations.instruments is not None and "frame" in equations.instruments.free:
        return
    off = np.abs(equations.measured.position - robot.home.position) * (1 - robot.geometry.free[:3])
    if not np.nanmax(off, initial=0.0) > _ACROSS * robot.geometry.size:
        return
    row, axis = np.unravel_index(int(np.nanargmax(off)), off.shape)
    raise UsageError(
        f"{equations.measured.place[row]}: the position measured is {off[row, axis] * 1e3:.3g} mm "
        f"from home along {'xyz'[axis]}, which is none of the platform's degrees_of_freedom "
        f"({', '.join(robot.platform.degrees_of_freedom)}); mend them, or [home], or the columns"
    )


def outside_bounds(parameters: Parameters) -> list[str]:
    """Warning about nominal values outside their own bounds."""
    names = [p.name for p in parameters if p.std > 0 and not p.low <= p.nominal <= p.high]
    if not names:
        return []
    return [f"nominal values outside their bounds, started at the bound: {', '.join(names)}"]
