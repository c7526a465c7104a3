"""Swivel axes that the poses require to point the other way than the profile has them.

A cable that reaches its pulley from the other side leaves it on the other side, which is nearly the
same as an exit point two pulley radii away: a fit imitates it by exit points, and is then wrong by
tenths of a millimetre. All axes reversed, and each alone, are fitted with the standard deviations
of the fit, the best one again with its own; this is repeated until no other one explains the poses
better. A single reversed axis is no more evident than the geometry that imitates it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.arguments import ProgressCallback
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.selection import (
    DELTA_CHI_SQUARE,
    POINTS,
    FitEnd,
    fitted,
    with_own_priors,
)
from winchkit.robot.geometry.robot import robot_of
from winchkit.robot.identification.bundle_adjustment import Mask, solve
from winchkit.robot.identification.equations import RobotEquations, started

_EVIDENCE, _POSES = 45.0, 90
"""Difference of criteria from which axes are named, of so many poses: eight reversed ones give 90
to 160, and right ones were named at 10 to 20 (16 robots of a campaign), which is what a single
reversed axis gives. Alone it cannot be distinguished from exit points, and does no harm. Of more
poses it is larger in proportion, as is that of two models which are both wrong."""


def reversed_axes(best: FitEnd, options: Options, progress: ProgressCallback) -> tuple[str, ...]:
    """Names of the lines whose swivel axes point the other way, by the end of a calibration."""
    names = best.equations.robot.names
    lines = np.flatnonzero(best.equations.robot.geometry.swivel_radius > 0)
    if not len(lines) or "closure" not in best.equations.kinds:
        return ()
    first = best = with_own_priors(best, options, progress)
    turned, every = np.zeros(len(names), dtype=bool), np.arange(len(names))
    for _ in lines:
        trials = [turned ^ np.isin(every, own) for own in (lines, *lines[:, None])]
        trials = [trial for trial in trials if np.any(trial)]
        costs = [_cost(best, trial ^ turned) for trial in trials]
        trial = trials[int(np.argmin(costs))]
        found = fitted(_with_axes(best.equations, trial ^ turned), options, progress)
        if not found.with_prior < best.with_prior - DELTA_CHI_SQUARE:
            break
        best, turned = found, trial
    least = _EVIDENCE * max(1.0, len(best.equations.measured) / _POSES)
    if not best.with_prior < first.with_prior - least * max(1.0, _of_points(best)):
        return ()
    return tuple(name for name, own in zip(names, turned, strict=True) if own)


def _of_points(fit: FitEnd) -> float:
    """Mean square of the points' distances from their priors, in standard deviations: where they
    are wrong by more than the priors say, so are all differences between axes."""
    block, std = fit.equations.parameters.block, fit.equations.parameters.std
    index = np.concatenate([block[name].ravel() for name in POINTS])
    return float(np.mean(fit.solution.linear.prior[index[std[index] > 0]] ** 2))


def axes_text(lines: Sequence[str]) -> str:
    """The sentence on lines whose swivel axes are reversed."""
    s = "s" if len(lines) > 1 else ""
    return (
        "the poses are explained better by the other direction of swivel_axis (in which the cable "
        f"reaches its pulley) of line{s} {', '.join(lines)}; nothing was written. Look on which "
        "side these cables leave their pulleys, and negate swivel_axis"
    )


def _with_axes(equations: RobotEquations, reverse: Mask) -> RobotEquations:
    """The equations of a robot of which these lines, (n,), have the other swivel axis."""
    profile = equations.robot.profile
    lines = []
    for line, other in zip(profile.line, reverse, strict=True):
        x, y, z = line.swivel_axis
        lines.append(replace(line, swivel_axis=(-x, -y, -z)) if other else line)
    return replace(equations, robot=robot_of(replace(profile, line=tuple(lines))))


def _cost(best: FitEnd, reverse: Mask) -> float:
    """Cost of the fit with these axes reversed, with the standard deviations of the other fit."""
    equations, state = started(_with_axes(best.equations, reverse), best.weights.sigma)
    return solve(equations, state, best.weights).linear.cost
