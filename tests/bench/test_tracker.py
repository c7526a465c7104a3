"""A tracker's datagrams: what is a pose, what is counted instead, and means of poses at rest."""

from __future__ import annotations

import json
import math
import socket
import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from waiting import until
from winchkit.bench.tracker import TrackedPose, TrackerReceiver, mean_pose, parse_pose
from winchkit.errors import ConnectionLost, NoReply

GOOD = {
    "schema": 1,
    "body": "platform",
    "time": 12.5,
    "position": [0.1, -0.2, 0.3],
    "quaternion": [0.5, 0.5, 0.5, 0.5],
}


def datagram(**changes: Any) -> bytes:
    return json.dumps(GOOD | changes).encode()


def test_a_datagram_is_a_pose_with_both_times() -> None:
    pose = parse_pose(datagram(), 99.0)
    assert (pose.received, pose.time) == (99.0, 12.5)
    assert pose.position == (0.1, -0.2, 0.3)
    assert pose.quaternion == pytest.approx((0.5, 0.5, 0.5, 0.5))


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (b"", "is no JSON"),
        (b"\xff\xfe", "is no JSON"),
        (b"[1, 2]", 'no "schema": 1'),
        (datagram(schema=2), 'no "schema": 1'),
        (datagram(position=[1, 2]), "position has not 3 numbers"),
        (datagram(position=["1", 2, 3]), "position is no finite number"),
        (datagram(position=[1, 2, True]), "position is no finite number"),
        (datagram(position=[1, 2, math.inf]), "position is no finite number"),
        (datagram(time=None), "time is no finite number"),
        (datagram(quaternion=[1, 1, 0, 0]), "norm 1.414 instead of 1"),
        (datagram(body="x" * 3000), "bytes (limit 2048)"),
    ],
)
def test_what_is_no_pose_is_counted_with_its_reason(sent: bytes, reason: str) -> None:
    tracker = TrackerReceiver(lambda: 0.0)
    tracker.receive(datagram())
    tracker.receive(sent)
    assert (tracker.received, tracker.refused) == (1, 1)
    assert reason in tracker.fault


@given(st.binary(max_size=3000))
def test_no_bytes_end_the_receiver(sent: bytes) -> None:
    tracker = TrackerReceiver(lambda: 0.0)
    tracker.receive(sent)
    assert tracker.received + tracker.refused == 1


@given(st.integers(0, 2**31), st.integers(2, 200))
def test_the_mean_of_poses_is_that_of_their_rotations(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    true = Rotation.random(random_state=seed)
    noise = Rotation.from_rotvec(random.normal(0, 1e-3, (count, 3)))
    seen = noise * true
    poses = []
    for turn, place in zip(seen, random.normal([1, 2, 3], 1e-3, (count, 3)), strict=True):
        x, y, z, w = (random.choice([-1, 1]) * turn.as_quat()).tolist()
        a, b, c = place.tolist()
        poses.append(TrackedPose(0.0, 0.0, (a, b, c), (w, x, y, z)))
    found = mean_pose(poses)
    assert found.position == pytest.approx([1, 2, 3], abs=5e-3 / count**0.5 + 1e-3)
    off = Rotation.from_matrix(found.rotation) * seen.mean().inv()
    assert off.magnitude() < 1e-5, "the mean of scipy, which minimises the same sum"


def test_poses_come_by_udp_until_the_receiver_is_closed() -> None:
    tracker = TrackerReceiver(time.monotonic)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"udp://127.0.0.1:{port}"
    tracker.listen(address)
    try:
        with pytest.raises(ConnectionLost, match="cannot receive"):
            TrackerReceiver(time.monotonic).listen(address)
        with pytest.raises(NoReply, match="no pose came"):
            tracker.require(time.monotonic(), address)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"noise", ("127.0.0.1", port))
            for number in range(5):
                sender.sendto(datagram(time=float(number)), ("127.0.0.1", port))
        until(lambda: tracker.received == 5)
        assert [pose.time for pose in tracker.require(0.0, address)] == [0, 1, 2, 3, 4]
        assert tracker.refused == 1
    finally:
        tracker.close()
