"""The simulated tracker: poses of the platform as JSON datagrams."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable

import numpy as np

from winchkit.robot.sim.platform import CablePlatform
from winchkit.robot.sim.rotation import quaternion, rotation, turned
from winchkit.schema.sim_platform import TrackerTruth

_ROUNDING = 1e-6
"""A sum of ticks reaches an instant but for this, s; else the datagram waits for another tick."""

_LONGEST = 0.01
"""Time before the end of the last step at which the platform can be measured, s."""


class SimTracker:
    """Sends the bytes of a datagram per pose; its clock starts with the simulation."""

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
        """Measure where a period has passed, and send what its delay has passed; the platform may
        be behind by a few ms, less than the delay."""
        measured, truth = self._platform.time, self._truth
        while measured >= self._next - _ROUNDING:
            instant = max(self._next, measured - _LONGEST)
            self._waiting.append((instant + truth.delay, self._measured(instant)))
            self._next = instant + 1 / truth.rate
        while self._waiting and self._waiting[0][0] <= now + _ROUNDING:
            self._send(self._waiting.popleft()[1])

    def _measured(self, instant: float) -> bytes:
        """The pose at an instant before the end of the platform's last step, by its velocity."""
        truth, platform = self._truth, self._platform
        change = platform.velocity * (instant - platform.time)
        x, y, z = change[3:].tolist()
        attitude = turned((x, y, z)) @ platform.rotation
        place = platform.center + change[:3] - attitude @ platform.body.center_of_mass
        position = self._rotation @ place + truth.position
        position = position + truth.position_noise * self._random.standard_normal(3)
        x, y, z = (truth.rotation_noise * self._random.standard_normal(3)).tolist()
        seen = turned((x, y, z)) @ self._rotation @ attitude
        told = {
            "schema": 1,
            "body": "platform",
            "time": round(instant, 6),
            "position": position.tolist(),
            "quaternion": list(quaternion(seen)),
        }
        return json.dumps(told).encode()
