"""The instruments of a simulated winch: readings with noise."""

from __future__ import annotations

from math import exp, sqrt
from random import Random
from typing import NamedTuple

from winchkit.schema.simbench import NoiseSpec
from winchkit.sim.physics.base import PlantState


class GaussianNoise:
    """Zero-mean Gaussian noise of standard deviation ``sigma``, sampled at any times.

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


_NOISY = ("motor_torque", "tension", "load", "cable_length", "temperature")


class Measurement(NamedTuple):
    """Readings of the instruments at one instant with noise, SI."""

    time: float
    motor_angle: float
    motor_velocity: float
    motor_torque: float
    tension: float
    load: float
    cable_length: float
    temperature: float


class NoisyReadings:
    """Adds independent noise to every reading, reproducible by a seed."""

    def __init__(self, noise: NoiseSpec, seed: int | str) -> None:
        sigmas = {name: getattr(noise, name) for name in _NOISY}
        self._noise = {
            name: GaussianNoise(sigma, noise.colour, noise.colour_time, Random(f"{seed}/{name}"))
            if sigma
            else None
            for name, sigma in sigmas.items()
        }
        self._sampled_at = dict.fromkeys(_NOISY, 0.0)

    def noise(self, name: str, time: float) -> float:
        """Noise of one quantity at a time (s)."""
        noise = self._noise[name]
        if noise is None:
            return 0.0
        interval, self._sampled_at[name] = time - self._sampled_at[name], time
        return noise.sample(interval)

    def read(
        self, state: PlantState, *, motor_torque: float, tension: float, cable_length: float
    ) -> Measurement:
        """Read; the arguments are outputs of drive, cell and length instrument without noise."""
        noise, time = self.noise, state.time
        return Measurement(
            time,
            state.motor_angle,
            state.motor_speed,
            motor_torque + noise("motor_torque", time),
            tension + noise("tension", time),
            state.load + noise("load", time),
            cable_length + noise("cable_length", time),
            state.temperature + noise("temperature", time),
        )
