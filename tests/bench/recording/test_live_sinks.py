"""Live pictures elsewhere: JSON lines, and datagrams as PlotJuggler reads them."""

from __future__ import annotations

import io
import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from fed import Fed, SetClock
from winchkit.bench.control.snapshot import to_dict
from winchkit.bench.recording.live_sinks import JsonLines, UdpJson
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


def test_plotjuggler_can_read_every_datagram(listener: socket.socket) -> None:
    """As its JSON parser is (plotjuggler_app/nlohmann_parsers.cpp, 3.17).

    It refuses NaN and ends the whole stream then; what is no number or truth value it passes over;
    a number is named after the keys on the way to it, with "/" between them; the field of the time
    stamp must be a number at the top, and when it is missing once it is not looked for any more.
    """
    port, clock = listener.getsockname()[1], SetClock()
    sink, fed = UdpJson(f"127.0.0.1:{port}", lambda: 1.75e9), Fed(clock)
    names = set()
    for _ in range(3):
        sink(to_dict(fed.snapshot()))
        clock.time += 0.004
        picture = json.loads(listener.recv(65_536), parse_constant=_refuse)
        assert isinstance(picture["timestamp"], float)
        names |= {f"/{winch}/{key}" for winch in "AB" for key in picture[winch]}
    sink.close()
    drive = ("motor_angle", "motor_velocity", "motor_torque", "cable_length", "cable_speed")
    assert {f"/{winch}/{name}" for winch in "AB" for name in drive} <= names
    assert all(name.count("/") == 2 for name in names), "no key of ours may look like a level"


def _refuse(constant: str) -> None:
    raise AssertionError(f"'{constant}' is no JSON")


def test_the_time_is_that_of_the_picture_not_of_its_sending(listener: socket.socket) -> None:
    clock, sending = SetClock(500.0), iter([1.75e9, 1.75e9 + 0.9, 1.75e9 + 7.0])
    sink, fed = UdpJson(f"127.0.0.1:{listener.getsockname()[1]}", lambda: next(sending)), Fed(clock)
    stamps = []
    for _ in range(3):
        sink(to_dict(fed.snapshot()))
        stamps.append(json.loads(listener.recv(65_536))["timestamp"])
        clock.time += 0.25
    assert stamps == [1.75e9, 1.75e9 + 0.25, 1.75e9 + 0.5]
    sink.close()


def test_localhost_is_where_plotjuggler_listens(
    listener: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    """127.0.0.1 is its default; a machine that names ::1 first would send into nothing."""
    port = listener.getsockname()[1]
    both = [
        (socket.AF_INET6, socket.SOCK_DGRAM, 17, "", ("::1", port, 0, 0)),
        (socket.AF_INET, socket.SOCK_DGRAM, 17, "", ("127.0.0.1", port)),
    ]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_named: both)
    sink = UdpJson(f"localhost:{port}", lambda: 1.75e9)
    sink(to_dict(Fed(SetClock()).snapshot()))
    assert json.loads(listener.recv(65_536))["timestamp"] == 1.75e9
    sink.close()


def test_a_picture_that_fits_no_datagram_is_counted(listener: socket.socket) -> None:
    sink = UdpJson(f"127.0.0.1:{listener.getsockname()[1]}", lambda: 0.0)
    many = {
        "time": 0.0,
        "cycle": 1,
        "winch": {f"W{n}": {"motor_angle": n / 7} for n in range(3000)},
    }
    sink(many)
    assert sink.dropped == 1
    sink.close()


@pytest.mark.parametrize("target", ["localhost", ":9870", "host:", "host:x", "host:0", "h:99999"])
def test_a_target_that_is_none(target: str) -> None:
    with pytest.raises(UsageError, match="HOST:PORT"):
        UdpJson(target, lambda: 0.0)


def test_an_unknown_host() -> None:
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
