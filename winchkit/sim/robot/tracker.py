"""The simulated tracker: poses of the platform as JSON datagrams."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable

import numpy as np

from winchkit.schema.sim_platform import TrackerTruth
from winchkit.sim.robot.platform import CablePlatform
from winchkit.sim.robot.rotation import quaternion, rotation, turned

__all__ = ["SimTracker"]

_ROUNDING = 1e-6
"""A sum of ticks reaches an instant but for this, s; else the datagram waits for another tick."""


class SimTracker:
    """Sends a datagram per pose; its clock starts with the simulation.

    Parameters
    ----------
    platform : CablePlatform
        The observed platform.
    truth : TrackerTruth
        Frame, noise, rate and delay.
    seed : int or str
        Seed of the noise.
    send : callable
        Takes the bytes of a datagram.
    """

    def __init__(
        self,
        platform: CablePlatform,
        truth: TrackerTruth,
        seed: int | str,
        send: Callable[[bytes], None],
    ) -> None:
        self._platform, self._truth, self._send = platform, truth, send
        self._random = np.random.default_rng([ord(letter) for letter in f"{seed}/tracker"])
        self._rotation = rotation(*truth.rotation)
        self._next = 0.0
        self._waiting: deque[tuple[float, bytes]] = deque()

    def advance(self, now: float) -> None:
        """Measure where a period has passed, and send what its delay has passed.

        Parameters
        ----------
        now : float
            Since the start, s; the platform may be behind by a few ms, less than the delay.
        """
        measured, truth = self._platform.time, self._truth
        if measured >= self._next - _ROUNDING:
            self._waiting.append((measured + truth.delay, self._measured()))
            self._next = max(self._next + 1 / truth.rate, measured)
        while self._waiting and self._waiting[0][0] <= now + _ROUNDING:
            self._send(self._waiting.popleft()[1])

    def _measured(self) -> bytes:
        truth, platform = self._truth, self._platform
        position = self._rotation @ platform.position + truth.position
        position = position + truth.position_noise * self._random.standard_normal(3)
        x, y, z = (truth.rotation_noise * self._random.standard_normal(3)).tolist()
        seen = turned((x, y, z)) @ self._rotation @ platform.rotation
        told = {
            "schema": 1,
            "body": "platform",
            "time": round(platform.time, 6),
            "position": position.tolist(),
            "quaternion": list(quaternion(seen)),
        }
        return json.dumps(told).encode()
