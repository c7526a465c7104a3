"""Noise of an instrument: white, and a share that is first-order coloured."""

from __future__ import annotations

from math import exp, sqrt
from random import Random

__all__ = ["Noise"]


class Noise:
    """Zero-mean Gaussian noise of standard deviation ``sigma``, sampled whenever it is asked.

    ``colour`` is the share of the variance in an Ornstein-Uhlenbeck process of correlation
    time ``colour_time`` s, stepped exactly over any interval.
    """

    def __init__(self, sigma: float, colour: float, colour_time: float, random: Random) -> None:
        self._white = sigma * sqrt(1.0 - colour)
        self._slow_sigma = sigma * sqrt(colour)
        self._time = colour_time
        self._random = random
        self._slow = random.gauss(0.0, 1.0) * self._slow_sigma

    def sample(self, interval: float) -> float:
        """Next value, ``interval`` s after the one before."""
        if self._slow_sigma > 0.0:
            keep = exp(-interval / self._time) if self._time > 0.0 else 0.0
            kick = self._slow_sigma * sqrt(1.0 - keep * keep)
            self._slow = keep * self._slow + kick * self._random.gauss(0.0, 1.0)
        return self._slow + self._white * self._random.gauss(0.0, 1.0)
