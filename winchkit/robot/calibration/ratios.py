"""Cable per motor turn of each line after a fit, and which lines differ from their profile.

The relative change of line i against its profile is d_i = W · W₀ / W₀ · W₀ − 1 with the cable W
wound since home at all poses, and W₀ by the profile. It depends on winding radius and gear ratio,
which single-layer drums cannot distinguish, and on the growth of the layers. Without positions a
scale that all lengths of a robot share is known by the priors of its points alone, so that the
changes of all lines have a common uncertain part. Of all sets S of lines that may differ, the one
with the least

    χ²(S) = d_Rᵀ (C_RR + τ²)⁻¹ d_R + 25 |S|

is named, where R are the other lines, C the posterior covariance of d and τ the tolerance of drums:
Wald's statistic of *all others are right*, and five standard deviations for each line that is not.
The change of a named line is its contrast with the mean of the others, if there are any. Sets
whose χ² is larger by less than nine are given as alternatives.

References
----------
A. Wald, *Tests of Statistical Hypotheses Concerning Several Parameters*, Trans. AMS 54, 1943.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from winchkit.arrays import Array
from winchkit.quantity_text import with_std
from winchkit.robot.identification.bundle_adjustment import Solution
from winchkit.robot.identification.equations import RobotEquations

_PENALTY = 25.0
"""χ² that a line must explain to be named: five standard deviations."""
_TOLERANCE = 1e-3
"""Standard deviation of the cable per motor turn of drums as they are made, as a share (rule of
thumb: 0.06 mm of a radius of 60 mm, the class h8 of its diameter)."""
_LEAST_SHARE = 5e-3
"""Least change that is named: five tolerances."""
_USUAL = 2.0
"""Standard deviations of the winding radii in the robot's file within which all changes are what it
states: then no line is named that does not stand out of their scatter (rule of thumb)."""
_OUTLYING, _NORMAL = 5.0, 1.4826
"""Robust standard deviations by which a line stands out, and a standard deviation over the median
absolute deviation of a normal distribution."""
_DELTA_CHI_SQUARE = 9.0
"""Difference of χ² below which two sets count as equal (probability at most 1/740)."""
_STEP = 1e-6
"""Relative, of a forward difference: truncation (1e-6, since the wound length is nearly linear in
the ratio) and rounding (2e-16/1e-6) are below what a derivative of a fit needs."""
_MOST_LINES = 8
"""Most lines of a robot of which all subsets are compared."""


@dataclass(frozen=True)
class CableRatio:
    """Cable per motor turn of one line against its profile."""

    line: str
    change: float
    """Relative change; of a named line against the mean of the lines that are not."""
    std: float
    named: bool
    """Whether the line differs from its profile."""


@dataclass(frozen=True)
class Ratios:
    """Cable per motor turn of all lines."""

    lines: tuple[CableRatio, ...]
    alternatives: tuple[tuple[str, ...], ...] = ()
    """Other sets of lines that explain the same."""

    @property
    def named(self) -> tuple[str, ...]:
        """Lines that differ."""
        return tuple(ratio.line for ratio in self.lines if ratio.named)

    @property
    def words(self) -> list[str]:
        """A sentence per named line, and one for alternatives."""
        right = [ratio.line for ratio in self.lines if not ratio.named]
        beside = f"compared with {_listed(right)}" if right else "by the size of the robot"
        out = [
            f"line {ratio.line}: the cable per motor turn differs by "
            f"{with_std(ratio.change, ratio.std, '%')} from the profile, {beside}: gear ratio, "
            "counts per turn or winding radius of its winch"
            for ratio in self.lines
            if ratio.named
        ]
        if self.alternatives:
            listed = " or on ".join(_listed(lines) for lines in self.alternatives)
            out.append(f"the same poses fit with another cable per motor turn on {listed} instead")
        return out


def _listed(lines: Sequence[str]) -> str:
    return f"line{'s' if len(lines) > 1 else ''} {', '.join(lines)}"


def ratios_of(equations: RobotEquations, solution: Solution) -> Ratios:
    """Cable per motor turn of each line at the end of a fit."""
    parameters, names = equations.parameters, equations.robot.names
    values, scale = solution.state.values, parameters.std
    posterior = np.linalg.inv(solution.linear.information + np.eye(len(scale)))
    wound, by = _wound(equations, values)
    first = _wound(equations, parameters.nominal)[0]
    along = first / np.sum(first**2, axis=0)
    change = np.sum(along * wound, axis=0) - 1
    by = np.einsum("pn,pnq->nq", along, by) * scale
    covariance = by @ posterior @ by.T
    chosen, others = _sets(change, covariance)
    about = np.abs(change - np.median(change))
    scatter = _NORMAL * _OUTLYING * float(np.median(about))
    if np.all(np.abs(change) <= _USUAL * _stated(equations)) and np.all(about <= scatter):
        chosen, others = (), []
    right = [i for i in range(len(names)) if i not in chosen]
    lines = []
    for i, name in enumerate(names):
        weight = np.zeros(len(names))
        weight[i] = 1.0
        if i in chosen and right:
            weight[right] -= 1.0 / len(right)
        lines.append(
            CableRatio(
                name,
                float(weight @ change),
                float(np.sqrt(max(weight @ covariance @ weight, 0.0))),
                i in chosen,
            )
        )
    return Ratios(tuple(lines), tuple(tuple(names[i] for i in each) for each in others))


def _stated(equations: RobotEquations) -> Array:
    """Standard deviations of the winding radii that the file states, as shares, (n,)."""
    at = equations.parameters.block["winding_radius"]
    return np.asarray(equations.parameters.std[at] / equations.parameters.nominal[at])


def _wound(equations: RobotEquations, values: Array) -> tuple[Array, Array]:
    """Cable wound since home (p, n) and its derivatives (p, n, q)."""
    known = np.isfinite(equations.measured.motor_angle)
    block, lines = equations.parameters.block, np.arange(known.shape[1])
    radius, growth = values[block["winding_radius"]], equations.growth(values)
    winding = equations.winding_at(values)
    wound = winding.wound(radius, growth)
    by = np.zeros((*wound.shape, len(values)))
    by[:, lines, block["winding_radius"]] = winding.by_radius(radius)
    by[..., block["layer_growth"][0]] = winding.gain
    if "gear_ratio" in block:
        own = values[block["gear_ratio"]]
        more = equations.winding_at(values, _STEP).wound(radius, growth)
        by[:, lines, block["gear_ratio"]] = (more - wound) / (_STEP * own)
    return np.where(known, wound, 0.0), np.where(known[..., None], by, 0.0)


def _sets(change: Array, covariance: Array) -> tuple[tuple[int, ...], list[tuple[int, ...]]]:
    """Set of lines that differ, and others that explain the same."""
    count = len(change)
    most = count if count <= _MOST_LINES else 1
    found = []
    for size in range(most + 1):
        # The complements of the sets in lexicographic order are in the reverse of that order.
        sets = np.array([*combinations(range(count), size)], dtype=int).reshape(
            comb(count, size), -1
        )
        rest = np.array([*combinations(range(count), count - size)], dtype=int)[::-1]
        rest = rest.reshape(len(sets), count - size)
        left = change[rest]
        own = covariance[rest[:, :, None], rest[:, None, :]] + _TOLERANCE**2 * np.eye(count - size)
        wald = np.sum(left * np.linalg.solve(own, left[..., None])[..., 0], axis=1)
        middle = np.mean(left, axis=1) if size < count else np.zeros(len(sets))
        small = np.any(np.abs(change[sets] - middle[:, None]) < _LEAST_SHARE, axis=1)
        found += [
            (float(value) + _PENALTY * size, tuple(chosen))
            for value, chosen in zip(wald[~small], sets[~small].tolist(), strict=True)
        ]
    found.sort()
    best, chosen = found[0]
    others = [other for value, other in found[1:] if value < best + _DELTA_CHI_SQUARE]
    return chosen, others if chosen else []
