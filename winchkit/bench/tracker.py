"""Poses of a tracker, received as JSON datagrams (docs/howto/tracker.md).

    {"schema": 1, "body": "platform", "time": 12.34,
     "position": [x, y, z], "quaternion": [w, x, y, z]}

Positions are in m and times in s of the tracker's clock; the receiver adds the time of this
computer. What is no such datagram is counted and named, and changes nothing.
"""

from __future__ import annotations

import json
import socket
import threading
from collections import deque
from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import ConnectionLost, NoReply
from winchkit.model.rotation import rotation_from_quaternion

_LONGEST = 2048
"""Bytes of a datagram; one has about 200."""
_KEPT = 4096
"""Poses that are kept: 4 s at 1 kHz."""
_UNIT = 1e-3
"""Largest difference of a quaternion's norm from one: three digits may be sent."""
_POLL = 0.2
"""Time after which the thread looks whether it is to end, s."""


class TrackedPose(NamedTuple):
    """A pose as a tracker showed it."""

    received: float
    """Time of this computer, s."""
    time: float
    """Time of the tracker, s."""
    position: tuple[float, float, float]
    """In the tracker's frame, m."""
    quaternion: tuple[float, float, float, float]
    """w, x, y, z: from platform to tracker."""


class MeanPose(NamedTuple):
    """Mean of poses at rest."""

    size: int
    """Number of poses."""
    position: Array
    """(3,), m."""
    rotation: Array
    """(3, 3)."""
    spread: float
    """Standard deviation of a position about the mean, along the worst axis, m."""


def parse_pose(datagram: bytes, now: float) -> TrackedPose:
    """Read a datagram.

    ``now``: time of its arrival, s. Raises ValueError with the reason, for what is no pose.
    """
    if len(datagram) > _LONGEST:
        raise ValueError(f"{len(datagram)} bytes (limit {_LONGEST})")
    try:
        told: Any = json.loads(datagram)
    except (ValueError, RecursionError):
        raise ValueError("is no JSON") from None
    if not isinstance(told, dict) or told.get("schema") != 1:
        raise ValueError('has no "schema": 1')
    time = _numbers(told, "time", 1)[0]
    x, y, z = _numbers(told, "position", 3)
    a, b, c, d = _numbers(told, "quaternion", 4)
    norm = (a * a + b * b + c * c + d * d) ** 0.5
    if abs(norm - 1) > _UNIT:
        raise ValueError(f"quaternion has the norm {norm:.4g} instead of 1")
    return TrackedPose(now, time, (x, y, z), (a / norm, b / norm, c / norm, d / norm))


def _numbers(told: dict[str, Any], key: str, count: int) -> list[float]:
    value = told.get(key)
    values = [value] if count == 1 else value
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"{key} has not {count} number{'s' * (count > 1)}")
    if not all(type(item) in (int, float) and isfinite(item) for item in values):
        raise ValueError(f"{key} is no finite number")
    return [float(item) for item in values]


def mean_pose(poses: list[TrackedPose]) -> MeanPose:
    """Mean of poses that differ by noise.

    ``poses``: one at least. Returns: position, and the rotation whose quaternion is the mean
    direction.
    """
    places = np.array([pose.position for pose in poses])
    turns = np.array([pose.quaternion for pose in poses])
    turns *= np.where(turns @ turns[0] < 0, -1.0, 1.0)[:, None]
    mean = turns.mean(axis=0)
    rotation = rotation_from_quaternion((mean / np.linalg.norm(mean))[None])[0]
    spread = float(np.std(places, axis=0).max())
    return MeanPose(len(poses), places.mean(axis=0), rotation, spread)


class TrackerReceiver:
    """Receiver of a tracker's datagrams; thread-safe.

    Parameters
    ----------
    now : callable
        Time of this computer, s.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.received = 0
        """Poses that were read."""
        self.refused = 0
        """Datagrams that were none."""
        self.fault = ""
        """Reason of the last one."""
        self._now = now
        self._poses: deque[TrackedPose] = deque(maxlen=_KEPT)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._socket: socket.socket | None = None

    def listen(self, address: str) -> None:
        """Receive at an address until :meth:`close`.

        Parameters
        ----------
        address : str
            ``udp://HOST:PORT``.

        Raises
        ------
        ConnectionLost
            Where the address is in use or not one of this computer.
        """
        parts = urlsplit(address)
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            receiver.bind((parts.hostname or "", parts.port or 0))
        except OSError as error:
            receiver.close()
            raise ConnectionLost(
                f"tracker: cannot receive at {address}: {error.strerror}; end the program that "
                "does, or change robot.tracker.listen"
            ) from error
        receiver.settimeout(_POLL)
        self._socket = receiver
        threading.Thread(target=self._run, args=(receiver,), name="tracker", daemon=True).start()

    def receive(self, datagram: bytes) -> None:
        """Take a datagram; one without a pose is counted.

        Parameters
        ----------
        datagram : bytes
            As of :func:`parse_pose`.
        """
        try:
            pose = parse_pose(datagram, self._now())
        except ValueError as error:
            with self._lock:
                self.refused += 1
                self.fault = str(error)
            return
        with self._lock:
            self.received += 1
            self._poses.append(pose)

    @property
    def newest(self) -> TrackedPose | None:
        """Newest pose; None before the first."""
        with self._lock:
            return self._poses[-1] if self._poses else None

    def since(self, time: float) -> list[TrackedPose]:
        """Return the poses that were received after a time.

        Parameters
        ----------
        time : float
            Time of this computer, s.

        Returns
        -------
        list of TrackedPose
            Oldest first, 4096 at most.
        """
        with self._lock:
            return [pose for pose in self._poses if pose.received > time]

    def require(self, since: float, address: str) -> list[TrackedPose]:
        """Return the poses since a time.

        Parameters
        ----------
        since : float
            Time of this computer, s.
        address : str
            Where they are expected, for the message.

        Returns
        -------
        list of TrackedPose
            One at least.

        Raises
        ------
        NoReply
            Where none came.
        """
        found = self.since(since)
        if not found:
            refused = (
                f"; {self.refused} datagrams were refused: {self.fault}" if self.refused else ""
            )
            raise NoReply(
                f"tracker: no pose came at {address} within {self._now() - since:.1f} s{refused}; "
                "is the body in view, and does its program send to this address?"
            )
        return found

    def close(self) -> None:
        """End receiving."""
        self._ended.set()
        if self._socket is not None:
            self._socket.close()

    def _run(self, receiver: socket.socket) -> None:
        while not self._ended.is_set():
            try:
                datagram = receiver.recv(_LONGEST + 1)
            except TimeoutError:
                continue
            except OSError:
                if self._ended.is_set():
                    return
                raise
            self.receive(datagram)
