"""Programmes of motion: S-curves between places at several speeds, with holds."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array


def programme(
    random: np.random.Generator, rate: float, seconds: float, stroke: float
) -> tuple[Array, Array]:
    """Time (s) and cable wound in since the start (m, roughly; it begins at zero), both (n,).

    Moves between random places of a ``stroke`` (m) below the start, at speeds from creep to
    fast, each with a smooth rise of the speed.
    """
    step = 1 / rate
    count = round(seconds * rate)
    speed = np.zeros(count)
    at, place = int(rate * random.uniform(0.5, 3)), 0.0
    speeds = np.geomspace(max(0.02, 0.4 * stroke / seconds), min(0.6, 8 * stroke / seconds), 4)
    while at < count:
        goal = -stroke * random.uniform(0, 1)
        if abs(goal - place) < 0.25 * stroke:
            goal = -stroke if place > -stroke / 2 else 0.0
        fast = float(random.choice(speeds))
        length = max(2, round(abs(goal - place) / fast * rate))
        speed[at : at + length] = np.sign(goal - place) * fast
        place += float(np.sum(speed[at : at + length])) * step
        at += length + round(rate * random.choice([0.4, 1.0, 3.0, 6.0]))
    rise = max(3, round(random.uniform(0.25, 0.6) * rate))
    bell = np.hanning(rise + 2)
    smooth = np.convolve(speed, bell / bell.sum(), mode="same")
    wound = np.concatenate([[0.0], np.cumsum((smooth[1:] + smooth[:-1]) / 2)]) * step
    return np.arange(count) * step, wound
