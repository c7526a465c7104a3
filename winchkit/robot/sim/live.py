"""The robot of a live simulated bench: its platform, and its tracker's datagrams."""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.util import find_spec
from typing import Any
from urllib.parse import urlsplit

from winchkit.robot.sim.build import build_robot
from winchkit.robot.sim.cable_end import CableEnd
from winchkit.robot.sim.tracker import SimTracker
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.sim_platform import PlatformTruth
from winchkit.schema.simbench import SimBench, WinchTruth


class LivePlatform:
    """Platform, cable ends and tracker of a simulated bench, ``compiled`` where numba is installed,
    which takes a second or two; not thread-safe."""

    def __init__(
        self,
        bench: SimBench,
        truth: PlatformTruth,
        seed: int,
        started: float,
        *,
        sends: bool,
        compiled: bool,
    ) -> None:
        self._started = started
        built = build_robot(bench, truth, compiled=compiled and find_spec("numba") is not None)
        self.platform: Any = built.platform
        self.profiles: Mapping[str, WinchProfile] = built.profiles
        self.ends: Mapping[str, CableEnd] = built.ends
        self.truth: Mapping[str, WinchTruth] = built.truth
        self.on_pose: Callable[[bytes], None] | None = None
        """Called with each datagram of the tracker, also in simulated time."""
        self._socket: socket.socket | None = None
        wiring = bench.bench.robot
        if wiring is not None and wiring.tracker is not None and sends:
            parts = urlsplit(wiring.tracker.listen)
            self._address = (parts.hostname or "", parts.port or 0)
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._tracker = SimTracker(built.platform, truth.tracker, seed, self._send)

    def advance(self, now: float) -> None:
        """Let the tracker measure and send at a time (s)."""
        self._tracker.advance(now - self._started)

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()

    def _send(self, datagram: bytes) -> None:
        if self._socket is not None:
            # A tracker sends whether its datagrams are received or not.
            with suppress(OSError):
                self._socket.sendto(datagram, self._address)
        if self.on_pose is not None:
            self.on_pose(datagram)
