"""Where CAN goes from process to process by UDP multicast."""

from __future__ import annotations

import socket

import pytest


def free_port(group: str) -> int:
    """A port for a bus of one's own; skips the test where this machine has no multicast route."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port = int(probe.getsockname()[1])
        try:
            probe.sendto(b"", (group, port))
        except OSError as error:
            pytest.skip(f"no route for multicast here: {error}")
    return port
