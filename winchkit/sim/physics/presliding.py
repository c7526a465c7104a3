"""Dahl's friction law, integrated in time."""

from __future__ import annotations

from math import ceil

_SMALL = 0.2
"""Step of the classical Runge-Kutta method in relaxation distances: its error (0.2^5/120) is 3e-6
of the limit."""
_ABRUPT = 0.01
"""Largest step below shape 1, where the force reaches the limit with a discontinuous slope."""
_LONG = 100.0
"""Travel over limit/slope after which the force has settled to a hundredth, for shapes to 2."""


def relax(force: float, travel: float, limit: float, slope: float, shape: float) -> float:
    """Integrate dF/dx = slope·|1 − sF/limit|^shape·sgn(1 − sF/limit) over ``travel``.

    ``limit`` is the sliding force, s the direction of travel. Classical Runge-Kutta with steps that
    are small compared with the relaxation distance of the law.
    """
    if travel == 0.0 or limit <= 0.0:
        return force if limit > 0.0 else 0.0
    sign = 1.0 if travel > 0.0 else -1.0
    load = 1.0 - sign * force / limit
    if abs(load) < 1e-12:
        return force
    reach = slope * abs(travel) / limit
    if reach > _LONG:
        return sign * limit
    steepness = max(1.0, shape * abs(load) ** (shape - 1.0))
    count = ceil(reach * steepness / (_SMALL if shape >= 1.0 else _ABRUPT))
    step = reach / count
    for _ in range(count):
        before = load
        k1 = -_rate(load, shape)
        k2 = -_rate(load + step * k1 / 2, shape)
        k3 = -_rate(load + step * k2 / 2, shape)
        k4 = -_rate(load + step * k3, shape)
        load += step * (k1 + 2 * k2 + 2 * k3 + k4) / 6
        if load * before <= 0.0:
            # With a shape below 1 the limit is reached in finite travel.
            return sign * limit
    return sign * limit * (1.0 - load)


def _rate(load: float, shape: float) -> float:
    """Rate of 1 − sF/limit by travel in units of limit/slope."""
    return load if shape == 1.0 else abs(load) ** shape * (1.0 if load > 0.0 else -1.0)
