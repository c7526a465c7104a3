"""Live pictures elsewhere: JSON lines, and datagrams as PlotJuggler reads them."""

from __future__ import annotations

import io
import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from fed import Fed, SetClock

from winchkit.bench.live_sinks import JsonLines, UdpJson
from winchkit.bench.snapshot import to_dict
from winchkit.errors import ConnectionLost, UsageError


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))
        server.settimeout(10.0)
        yield server


def test_a_datagram_holds_a_time_stamp_and_numbers_only(listener: socket.socket) -> None:
    sink = UdpJson(f"127.0.0.1:{listener.getsockname()[1]}", lambda: 1.75e9)
    sink(to_dict(Fed(SetClock()).snapshot()))
    picture = json.loads(listener.recv(65_536))
    assert picture["timestamp"] == 1.75e9
    assert set(picture) == {"timestamp", "cycle", "A", "B"}
    assert picture["A"]["motor_torque"] == 2.0
    assert "tension" not in picture["A"], "what has no value is left out"
    assert all(isinstance(value, int | float) for value in picture["B"].values())
    assert sink.dropped == 0
    sink.close()


def test_a_picture_that_fits_no_datagram_is_counted(listener: socket.socket) -> None:
    sink = UdpJson(f"127.0.0.1:{listener.getsockname()[1]}", lambda: 0.0)
    many = {"cycle": 1, "winch": {f"W{n}": {"motor_angle": n / 7} for n in range(3000)}}
    sink(many)
    assert sink.dropped == 1
    sink.close()


@pytest.mark.parametrize("target", ["localhost", ":9870", "host:", "host:x", "host:0", "h:99999"])
def test_a_target_that_is_none(target: str) -> None:
    with pytest.raises(UsageError, match="HOST:PORT"):
        UdpJson(target, lambda: 0.0)


def test_a_host_that_nobody_knows() -> None:
    with pytest.raises(ConnectionLost, match="cannot be reached"):
        UdpJson("no.such.host.invalid:9870", lambda: 0.0)


def test_lines_of_json(tmp_path: Path) -> None:
    stream, fed = io.StringIO(), Fed(SetClock())
    sink = JsonLines(stream)
    for _ in range(2):
        sink(to_dict(fed.snapshot()))
    lines = stream.getvalue().splitlines()
    assert len(lines) == 2
    picture = json.loads(lines[0])
    assert picture["winch"]["A"]["phase"] == "moving"
    assert picture["winch"]["A"]["tension"] is None
