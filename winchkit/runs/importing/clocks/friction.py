"""A motor torque without its friction, to compare its clock with that of a force.

Friction adds a part to the torque that follows the direction and the speed of the motor. The force
in a cable has none of it, so that their largest correlation is beside the lag of the clocks: a load
that varies over the travel looks late. The force is regressed on the torque, the direction and the
speed at every lag; at the best one the friction is removed, and the lag found again until it stays.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from winchkit.runs.importing.clocks.cross_correlation import (
    Agreement,
    TimedSignal,
    correlated,
    interval_of,
    lag_of_several,
)

TORQUE = "motor_torque"
_ROUNDS = 10
"""Times that the lag is found again; computing cost."""
_SETTLED = 1e-3
"""Change of the lag in a sampling interval at which it stays."""
_MOVING = 0.01
"""Share of the usual speed over which the direction turns round; screened."""


def correlated_without_friction(
    torque: TimedSignal, force: TimedSignal, angle: TimedSignal, *, is_first: bool
) -> Agreement | None:
    """Agreement of a torque with a force by the lag of their largest correlation.

    ``angle``: that of the same motor and file as the torque. ``is_first``: whether the torque is of
    the first file. Returns: without a friction that the motion shows, that of the torque itself.
    """
    plain = correlated(*((torque, force) if is_first else (force, torque)))
    motion = np.interp(torque.time, angle.time, angle.values)
    rate = np.gradient(motion, torque.time)
    slow = _MOVING * float(np.quantile(np.abs(rate), 0.95))
    direction = np.tanh(rate / slow)
    parts = [torque.values, direction, rate]
    if any(np.ptp(part) == 0 for part in parts):
        return plain
    lag = lag_of_several(parts, torque.time, force)
    if lag is None:
        return plain
    slope = np.gradient(force.values, force.time)
    follows, friction = 0.0, np.zeros(2)
    for _ in range(_ROUNDS):
        at = torque.time - lag
        inside = (at >= force.time[0]) & (at <= force.time[-1])
        y, rise = (np.interp(at[inside], force.time, own) for own in (force.values, slope))
        x = np.column_stack([*(part[inside] for part in parts), rise])
        scale = np.maximum(np.std(x, axis=0), 1e-300)
        x = (x - x.mean(axis=0)) / scale
        # y(t − lag) = s (τ + friction) + δ y', by which the lag is too small (Gauss-Newton).
        values = np.linalg.lstsq(x, y - y.mean(), rcond=None)[0] / scale
        follows, friction, change = values[0], values[1:3], values[3]
        lag += float(np.clip(change, -interval_of(force), interval_of(force)))
        if abs(change) < _SETTLED * interval_of(torque):
            break
    if not follows:
        return plain
    change = (friction[0] * direction + friction[1] * rate) / follows
    cleaned = replace(torque, values=torque.values + change)
    found = correlated(*((cleaned, force) if is_first else (force, cleaned)))
    if found is None or (plain is not None and abs(found.correlation) < abs(plain.correlation)):
        return plain
    # How a reversal looks is not known: within an interval of the force it may be anything.
    rounded = interval_of(force) / math.sqrt(12)
    return replace(found, lag_std=math.hypot(found.lag_std, rounded))
