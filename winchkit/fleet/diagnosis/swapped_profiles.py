"""Winches whose profiles were exchanged: identified parameters assigned to profiles.

References
----------
Kuhn, H. W. (1955). The Hungarian method for the assignment problem. Naval Res. Logist. Q. 2, 83-97.
Foster, D. P., George, E. I. (1994). The risk inflation criterion for multiple regression. Ann.
Stat. 22, 1947-1975.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf, perm

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import fdtrc, stdtr

from winchkit.arrays import Array
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.fleet.diagnosis.history import FleetParameter
from winchkit.fleet.diagnosis.partial_pooling import LEAST_WINCHES
from winchkit.fleet.diagnosis.robust_variance import robust_variance
from winchkit.schema.profiles.winch import WinchProfile

_LEVEL = 0.01
"""Level of the test of exchanged profiles; convention."""
_FITS = 0.001
"""Level of the test that a winch fits a profile; convention."""
_MOST_DOF = 1e9
"""Degrees of freedom of a known covariance; numerical."""
_RADIUS, _RATIO = "drum-radius", "gear-ratio"


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
    dof: float = inf,
) -> tuple[Swap, ...]:
    """Cycles of winches whose profiles were exchanged, significant at 1 %, by identified parameters
    x with their covariances C and ``dof``, and declared ones p.

    The assignment minimises Σ (x − p)ᵀ C⁻¹ (x − p) + 2 m ln n, with m the number of the n winches
    that get another profile: the penalty of a search among n alternatives per winch (Foster and
    George 1994). Without it winches whose profiles differ by less than C are exchanged by chance,
    and join the cycles of those that were exchanged. For a cycle, the decrease D of the first sum
    against the declared profiles is N(−d², 4 d²) if these are right, d² the sum of the squared
    distances δᵀ C⁻¹ δ between each declared profile and the assigned one: p = Φ(−(D + d²)/(2 d)),
    with the distribution function of t for estimated covariances. Every winch of a cycle must fit
    its new profile: one whose profile is mistyped fits that of another winch, which does not fit
    the mistyped one.
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
        if not all(_fits(cost[i, j], len(profiles[names[i]]), dof) for i, j in pairs):
            continue
        decrease = float(sum(cost[i, i] - cost[i, j] for i, j in pairs))
        distance = sum(
            _square(profiles[names[i]] - profiles[names[j]], inverses[i]) for i, j in pairs
        )
        z = (decrease + distance) / (2 * np.sqrt(distance)) if distance else -inf
        chance = float(stdtr(dof, -z))
        cycles = perm(len(names), len(cycle)) // len(cycle)
        p_value = min(1.0, (len(names) - 1) * cycles * chance)
        if p_value < _LEVEL:
            out.append(Swap(tuple(names[i] for i in cycle), decrease, p_value))
    return tuple(out)


def swapped_by_radius(
    parameters: Iterable[FleetParameter], profiles: Mapping[str, WinchProfile], catalogue: Catalogue
) -> tuple[Swap, ...]:
    """Exchanged profiles by the cable length per motor angle, r/i on the first layer. The median
    difference from the declared value, which all have in common, is no evidence; the scatter beyond
    their standard deviations is that of :func:`robust_variance`. Fewer than half may be
    exchanged."""
    found = [p for p in parameters if p.effect in (_RADIUS, _RATIO)]
    if len(found) != 1 or len(found[0].winches) < LEAST_WINCHES:
        return ()
    names, declared, identified, variances = [], [], [], []
    for winch in found[0].winches:
        profile = profiles[winch.winch]
        known = {t.label: t.values for t in terms_of(profile, catalogue)}
        radius = profile.drum.winding_radius
        error = known.get(_RADIUS, {}).get("radius_error", 0.0)
        ratio = 1.0 + known.get(_RATIO, {}).get("ratio_error", 0.0)
        of_one = radius / profile.gearbox.ratio
        names.append(winch.winch)
        declared.append(of_one * (1.0 + error / radius) / ratio)
        if found[0].effect == _RADIUS:
            identified.append(of_one * (1.0 + winch.value / radius) / ratio)
            variances.append((of_one * winch.std / radius / ratio) ** 2)
        else:
            identified.append(of_one * (1.0 + error / radius) / (1.0 + winch.value))
            variances.append((identified[-1] * winch.std / (1.0 + winch.value)) ** 2)
    differences = np.array(identified) - np.array(declared)
    common = float(np.median(differences))
    between = robust_variance(differences - common, np.array(variances))
    return swapped_profiles(
        {n: np.array([x - common]) for n, x in zip(names, identified, strict=True)},
        {n: np.array([[v + between.value]]) for n, v in zip(names, variances, strict=True)},
        {n: np.array([x]) for n, x in zip(names, declared, strict=True)},
        between.dof,
    )


def _fits(square: float, parameters: int, dof: float) -> bool:
    """Whether a winch's squared distance from a profile is that of its uncertainty."""
    return bool(fdtrc(parameters, min(dof, _MOST_DOF), square / parameters) > _FITS)


def _square(difference: Array, inverse: Array) -> float:
    return float(difference @ inverse @ difference)
