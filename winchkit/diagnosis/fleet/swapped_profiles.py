"""Winches whose profiles were exchanged: identified parameters assigned to profiles.

References
----------
Kuhn, H. W. (1955). The Hungarian method for the assignment problem. Naval Res. Logist. Q. 2, 83-97.
Foster, D. P., George, E. I. (1994). The risk inflation criterion for multiple regression. Ann.
Stat. 22, 1947-1975.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import perm

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import ndtr

from winchkit.arrays import Array

__all__ = ["Swap", "swapped_profiles"]

_LEVEL = 0.01


@dataclass(frozen=True)
class Swap:
    """Winches that have each other's profiles."""

    winches: tuple[str, ...]
    """Each winch is described by the profile of the next one, the last by that of the first."""
    chi_square_decrease: float
    p_value: float
    """Of the declared profiles, Bonferroni over all cycles of this length, and all lengths."""


def swapped_profiles(
    identified: Mapping[str, Array],
    covariances: Mapping[str, Array],
    profiles: Mapping[str, Array],
) -> tuple[Swap, ...]:
    """Cycles of winches whose profiles were exchanged, significant at 1 %.

    Parameters
    ----------
    identified
        Winch to its identified parameters, shape (p,): the declared values plus fitted errors.
    covariances
        Winch to their covariance, shape (p, p).
    profiles
        Winch to the parameters of its declared profile, shape (p,).

    Notes
    -----
    The assignment minimises Σ (x − p)ᵀ C⁻¹ (x − p) + 2 m ln n, with m the number of the n winches
    that get another profile: the penalty of a search among n alternatives per winch (Foster and
    George 1994). Without it winches whose profiles differ by less than C are exchanged by chance,
    and join the cycles of those that were exchanged. For a cycle, the decrease D of the first sum
    against the declared profiles is N(−d², 4 d²) if these are right, d² the sum of the squared
    distances δᵀ C⁻¹ δ between each declared profile and the assigned one:
    p = Φ(−(D + d²)/(2 d)).
    """
    names = list(identified)
    inverses = [np.asarray(np.linalg.inv(covariances[n]), dtype=np.float64) for n in names]
    cost = np.array(
        [
            [_square(identified[name] - profiles[other], inverse) for other in names]
            for name, inverse in zip(names, inverses, strict=True)
        ]
    ).reshape(len(names), len(names))
    penalty = 2 * np.log(max(len(names), 1)) * (1 - np.eye(len(names)))
    _, assigned = linear_sum_assignment(cost + penalty)
    out, left = [], set(range(len(names)))
    while left:
        cycle = [min(left)]
        while (following := int(assigned[cycle[-1]])) != cycle[0]:
            cycle.append(following)
        left -= set(cycle)
        if len(cycle) == 1:
            continue
        pairs = [(i, int(assigned[i])) for i in cycle]
        decrease = float(sum(cost[i, i] - cost[i, j] for i, j in pairs))
        distance = sum(
            _square(profiles[names[i]] - profiles[names[j]], inverses[i]) for i, j in pairs
        )
        chance = float(ndtr(-(decrease + distance) / (2 * np.sqrt(distance)))) if distance else 1.0
        cycles = perm(len(names), len(cycle)) // len(cycle)
        p_value = min(1.0, (len(names) - 1) * cycles * chance)
        if p_value < _LEVEL:
            out.append(Swap(tuple(names[i] for i in cycle), decrease, p_value))
    return tuple(out)


def _square(difference: Array, inverse: Array) -> float:
    return float(difference @ inverse @ difference)
