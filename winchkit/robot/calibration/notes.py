"""What a calibration says beside its values: datum, instruments that were fitted, and warnings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.calibration.identifiability import Observability, outside_bounds
from winchkit.robot.calibration.prediction import PoseErrors, rms
from winchkit.robot.calibration.selection import BEYOND_PRIOR, POINTS, FitEnd
from winchkit.robot.identification.bundle_adjustment import Solution, Weights
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.parameters import EFFECTS
from winchkit.robot.mistakes.score import eliminated

_NAMES = {"closure": "lengths by the drums", "position": "positions"}
_WORSE_ROTATION = 1.5
"""Ratio of the held-out rotation errors after and before above which a warning is due."""
_ODD_ROTATION = 0.01
"""Standard deviation of rotations above which a warning is due, rad: five times that of a usual
tracker's angles (rule of thumb)."""
_STRETCHED, _STRETCH = 1e-6, 3e-3
"""Probability by chance below which, and size from which on, a stretch of the positions along one
axis is reported (rules of thumb: a right tracker and a right model have none above 0.1 %)."""
_COARSE_RATIO = 5.0
"""Standard deviation of positions, in that of the exit points' prior, above which a warning is due
(rule of thumb: a camera may be coarser than a drawing)."""


def _left_out(equations: RobotEquations) -> list[str]:
    """Effects of the profiles that this model leaves out."""
    robot = equations.robot
    tables = [*robot.profile.effect, *(table for winch in robot.winches for table in winch.effect)]
    own = {table.id for table in robot.profile.effect if table.id in EFFECTS}
    names = {table.id for table in tables} - own
    if equations.parameters.law is None and any(w.cable.axial_stiffness for w in robot.winches):
        names.add("cable-elongation-linear (cable.axial_stiffness)")
    return [f"effects of the profile left out here: {', '.join(sorted(names))}"] if names else []


_OF_TRACKER = {
    "frame": "the tracker's frame",
    "reflector": "the reflector's offset on the platform",
    "scale": "the tracker's scale",
    "mounting": "the axes of the target, or of the IMU, on the platform",
    "cell_gain": "the gains of the load cells",
    "length_scale": "the scales of the length counters",
}


_LIKE_HOME = {
    "frame": "elsewhere looks the same as another frame, but for the priors of the exit points",
    "reflector": "elsewhere looks the same as another reflector offset",
    "mounting": "turned looks the same as other axes of the target",
}
"""What another home pose cannot be distinguished from."""


def instrument_notes(declared: RobotEquations, chosen: FitEnd) -> Iterator[str]:
    """Numbers of instruments that were fitted, and the datum, in words."""
    before = declared.instruments.free if declared.instruments else frozenset()
    if found := [text for name, text in _OF_TRACKER.items() if name in chosen.free - before]:
        yield (
            f"the poses require {' and '.join(found)} to be other than the robot's file has: "
            "fitted beside the geometry. Declare it as unknown in [instrument]"
        )
    if alike := [text for name, text in _LIKE_HOME.items() if name in chosen.free - before]:
        yield f"a home pose that is {' and '.join(alike)}: check [home] first"
    if "frame" in chosen.free:
        own = chosen.equations.robot.profile.instrument.tracker.datum
        kept = {
            "robot": "the robot's base frame, by the home pose and the priors of the exit points",
            "tracker": "the tracker's frame; exit points and home pose are written in it",
        }
        yield f"datum: {kept[own]}"
    if "reflector" in chosen.free:
        yield (
            "datum of the platform: its anchor points at the home pose; a common shift of all "
            "anchor points and of the home pose is the same as another reflector offset"
        )
    if "cell_gain" in chosen.free:
        yield (
            "datum of the forces: the platform's mass; a common gain of all cells is the same as "
            "another mass"
        )
    if "mounting" in chosen.free and "position" not in chosen.equations.kinds:
        yield (
            "a bias of roll and pitch is the same as the IMU's mounting: reported as the mounting"
        )


def home_notes(given: RobotEquations, fitted: RobotEquations, values: Array) -> list[str]:
    """Cable lengths at home that were fitted although no effect asks for them."""
    index = fitted.parameters.block.get("home_length")
    if index is None or "home_length" in given.parameters.block:
        return []
    return [
        "the poses require other cable lengths at home than [home] gives, by up to "
        f"{float(np.max(np.abs(values[index]))) * 1e3:.3g} mm: fitted beside the geometry. Measure "
        "the home pose anew, or declare the effect home-length"
    ]


def moved_points(given: RobotEquations, fitted: RobotEquations, values: Array) -> Iterator[str]:
    """Points that left the priors of the file."""
    for block in POINTS:
        index, own = fitted.parameters.block[block], given.parameters.block[block]
        std = given.parameters.std[own]
        moved = np.where(std > 0, np.abs(values[index] - given.parameters.nominal[own]), 0.0)
        if np.any(moved > BEYOND_PRIOR * std):
            yield (
                f"{block.replace('_', ' ')}s are up to {float(np.max(moved)) * 1e3:.3g} mm from "
                f"the file's along an axis, whose prior has a standard deviation of "
                f"{float(np.max(std)) * 1e3:.3g} mm: compare them with the robot"
            )


def stretched_axis(
    equations: RobotEquations, solution: Solution, weights: Weights
) -> Iterator[str]:
    """The axis of the positions along which these look longer or shorter, by a score test: neither
    a frame nor a common scale of the tracker is so, and points and drums imitate it."""
    linear, measured = solution.linear, equations.measured.position
    if (own := linear.stack.kinds.get("position")) is None:
        return
    rest, known = eliminated(linear), linear.stack.known[:, own]
    seen = np.where(known, np.nan_to_num(measured), 0.0)
    mean = seen.sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    about = (np.where(known, seen - mean, 0.0) / weights.sigma["position"]).T
    by_poses = 1 - np.sum(rest.half[..., own] ** 2, axis=1).T
    sizes, falls = rest.fall(
        np.sum(about * rest.residual[:, own].T, axis=1),
        np.sum(about**2 * by_poses, axis=1),
        np.einsum("kp,pkq->kq", about, linear.pose_free[:, own]),
    )
    k = int(np.argmax(falls))
    if rest.chance(float(falls[k]), len(falls)) < _STRETCHED and abs(sizes[k]) > _STRETCH:
        longer = "longer" if sizes[k] < 0 else "shorter"
        yield (
            f"the positions are {longer} along {'xyz'[k]} than geometry and drums have them, by "
            f"about {abs(sizes[k]):.1%} beside what points and drums took up: check the tracker's "
            "calibration along this axis, or what an effect, such as elastic cables, moves"
        )


def worse_rotation(before: PoseErrors, after: PoseErrors) -> list[str]:
    """A held-out rotation error that the fit raised."""
    first, last = rms(before.angle), rms(after.angle)
    if not last > _WORSE_ROTATION * first:
        return []
    return [
        f"the held-out rotation error grew from {np.degrees(first):.3g} to {np.degrees(last):.3g} "
        "deg: the fit traded rotations for positions; check the tracker's frame"
    ]


def _disagreements(equations: RobotEquations, weights: Weights) -> Iterator[str]:
    """Noise above the prior of the points: poses of another robot, or a wrong sign or order."""
    exits = equations.parameters.std[equations.parameters.block["exit_point"]]
    prior_std, sigma = float(exits.max()), weights.sigma
    checks = {
        "closure": "gearbox.direction, the lines' order, [home] and the motor angles there",
        "position": "that the poses are of this robot, in its base frame",
    }
    turned = sigma.get("rotation", 0.0)
    if turned > _ODD_ROTATION:
        yield (
            f"rotations and geometry disagree by {np.degrees(turned):.3g} deg: check the unit and "
            "the convention of the rotations"
        )
    # A camera may well be coarser than a drawing.
    most = {"closure": prior_std, "position": _COARSE_RATIO * prior_std}
    for kind, cause in checks.items():
        if sigma.get(kind, 0.0) > most[kind]:
            yield (
                f"{_NAMES[kind]} and geometry disagree by {sigma[kind] * 1e3:.3g} mm, more than "
                f"the standard deviation of the exit points' prior: check {cause}"
            )


def warnings_of(
    equations: RobotEquations,
    solution: Solution,
    weights: Weights,
    observed: Observability,
    unfound: int,
) -> tuple[str, ...]:
    """What a fit leaves open: bounds, noise, values that rest on the prior, and ``unfound``
    poses."""
    out = [*equations.measured.notes, *_left_out(equations)]
    out += outside_bounds(equations.parameters)
    if unfound:
        out.append(
            f"{unfound} held-out poses were not found from their motor angles: a tension is "
            "missing that an effect needs, or the cables contradict each other"
        )
    out += _disagreements(equations, weights)
    if not solution.converged:
        out.append(f"the fit did not converge within {solution.steps} steps")
    held = [p.name for p, at in zip(equations.parameters, solution.held, strict=True) if at != 0]
    if held:
        out.append(f"stopped at a bound: {', '.join(held)}; is the bound right, or the model?")
    if observed.weak:
        out.append(
            f"{observed.weak} of {observed.free} parameter combinations rest on the assumed "
            "values; more poses would settle them"
        )
    return tuple(out)
