"""Load on the ground: the stretch at the lower end of the travel in which the cable carries none.

The samples of a run are sorted by the motor angle into groups of equal count. The force of a group
is the mean of its medians winding in and paying out, so that friction cancels. A hanging mass gives
nearly the same force everywhere; where it stands on the ground, where the cable is slack or a brake
holds it, the force at one end is nearly zero, by more than its scatter. No drum, friction or
inertia does this: at the lower end a motion turns by an acceleration upwards, which raises it. A
force of the other sign there is that of an eccentric weight.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding, share

ON_GROUND = "load-on-ground"
_FORCES = ("tension", "motor_torque")
"""The first one of a run decides: static friction may hold a load without torque, not the cell."""
_GROUPS = 100
"""Groups of samples; a stretch of 1 % of them is found. Rule of thumb."""
_LEAST_SAMPLES = 8
"""Samples of a group, of which both directions have a median."""
_LEAST_GROUPS = 12
"""Groups below which a run has no end and no middle."""
_LOW = 0.5
"""Share of the usual force below which it is low: halfway between all of the weight and none."""
_MOST = 0.9
"""Share of the samples up to which a stretch is an end: the rest has the usual force. A run may
stand on the ground for most of its time."""
_NONE = 0.25
"""Share of the usual force that may be left there: a load that jams at the top has more."""
_SCATTER = 5.0
"""Scatter of neighbouring groups that the step exceeds, as in `diagnosis/data/sign_and_scale.py`.
"""
_FULL = 0.97
"""Share of the force of the next groups from which the whole load hangs on the cable."""
_AHEAD = 8
"""Groups whose median that is: a drum changes its radius little over 8 % of the samples."""
_MOVING = 0.02
"""Share of the usual speed below which a sample has no direction."""


def ground_mask(run: Run) -> NDArray[np.bool_]:
    """Samples (n,) in which something else than the cable carries the load; none without a mass."""
    none = np.zeros(len(run), dtype=bool)
    force = next((name for name in _FORCES if name in run), None)
    if force is None or "motor_angle" not in run or not run.load_mass or "load" in run:
        return none
    # A torque that holds the load is positive towards the angles at which it hangs higher.
    up = float(np.sign(np.nanmedian(run[force]))) or 1.0
    for sign in (up, -up) if force == "tension" else (up,):
        position = sign * run["motor_angle"]
        edge = _edge(position, run[force])
        if edge is not None:
            return np.asarray(position <= edge)
    return none


def load_on_ground(run: Run, mask: NDArray[np.bool_]) -> Iterator[Finding]:
    """Finding on a mask of :func:`ground_mask`; value: share of the samples."""
    if mask.any():
        part = float(np.mean(mask))
        text = (
            f"falls below half of what the load of {run.load_mass:.4g} kg needs at one end of the "
            "travel: the load stands on the ground, the cable is slack, or a brake holds it; these "
            f"{share(part)} of the samples are not compared"
        )
        channel = next(name for name in _FORCES if name in run)
        yield Finding(ON_GROUND, run.name, channel, part, text)


def _edge(position: Array, force: Array) -> float | None:
    """Position up to which the force is low, the load increasing; None where it never is."""
    known = np.isfinite(position) & np.isfinite(force)
    position, force = position[known], force[known]
    count = min(_GROUPS, len(force) // _LEAST_SAMPLES)
    if count < _LEAST_GROUPS or not np.ptp(position):
        return None
    rate = _directions(position)
    groups = np.array_split(np.argsort(position, kind="stable"), count)
    usual = _without_friction([(force[own], rate[own]) for own in groups])
    usual *= np.sign(np.median(usual)) or 1.0
    level = float(np.median(usual[int(_MOST * count) :]))
    low = usual < _LOW * level
    first = int(np.argmin(low))
    scatter = float(np.median(np.abs(np.diff(usual[first:]))))
    step = float(np.median(usual[first:]) - np.median(usual[: max(first, 1)]))
    if first == 0 or first > _MOST * count or low[first:].any() or step < _SCATTER * scatter:
        return None
    if np.min(usual[:first]) < -_LOW * level or np.median(usual[:first]) > _NONE * level:
        return None
    while first < count - _AHEAD and usual[first] < _FULL * np.median(
        usual[first + 1 : first + 1 + _AHEAD]
    ):
        first += 1
    return float(position[groups[min(first, count - 1)][-1]])


def _without_friction(groups: Sequence[tuple[Array, Array]]) -> Array:
    """Mean of each group's medians in both directions, of one less half the usual difference."""
    medians = np.full((3, len(groups)), np.nan)
    for index, (force, rate) in enumerate(groups):
        for row, sign in enumerate((-1.0, 0.0, 1.0)):
            if np.any(rate == sign):
                medians[row, index] = np.median(force[rate == sign])
    down, rest, up = medians
    half = (up - down) / 2
    friction = float(np.median(half[np.isfinite(half)])) if np.isfinite(half).any() else 0.0
    one = np.where(np.isfinite(up), up - friction, down + friction)
    both = np.where(np.isfinite(half), (up + down) / 2, one)
    # At rest static friction may hold as much of the load.
    return np.where(np.isfinite(both), both, rest + np.sign(rest) * abs(friction))


def _directions(position: Array) -> Array:
    """Sign of the rate of every sample, (n,); 0 at rest."""
    rate = np.gradient(position)
    limit = _MOVING * float(np.quantile(np.abs(rate), 0.95))
    return np.asarray(np.where(np.abs(rate) > limit, np.sign(rate), 0.0))
