"""Ctrl-C ends the page's server although pages are open and never answer."""

from __future__ import annotations

import base64
import secrets
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest

pytest.importorskip("starlette")

from browsing import Served

pytestmark = [pytest.mark.slow, pytest.mark.realtime]

ENDS = 2.0
"""Bound, s."""


@contextmanager
def silent(url: str, path: str) -> Iterator[socket.socket]:
    """A websocket that is opened, reads nothing, and never answers a close (RFC 6455)."""
    parts = urlsplit(url)
    token = parse_qs(parts.query)["token"][0]
    key = base64.b64encode(secrets.token_bytes(16)).decode()
    lines = [
        f"GET {path}?token={token} HTTP/1.1",
        f"Host: {parts.netloc}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
    ]
    with socket.create_connection((parts.hostname, parts.port), 30.0) as line:
        line.sendall("\r\n".join([*lines, "", ""]).encode())
        assert line.recv(12) == b"HTTP/1.1 101"
        yield line


@pytest.mark.parametrize(
    ("arguments", "paths"),
    [
        (["--mystery", "1"], ["/live"]),
        (["--sim", "demo-adequate"], ["/live", "/live/bench"]),
    ],
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_server_ends_although_sockets_are_open(
    arguments: list[str], paths: list[str], number: signal.Signals, tmp_path: Path
) -> None:
    served = Served(*arguments, folder=tmp_path)
    with ExitStack() as stack:
        for path in paths:
            stack.enter_context(silent(served.url, path))
        time.sleep(2.0)  # a diagnosis is under way, or the bench is attached and sends
        start = time.monotonic()
        served.process.send_signal(number)
        served.process.communicate(timeout=60.0)
        took = time.monotonic() - start
    assert took < ENDS
    assert served.process.returncode == 128 + number
