"""Runs the suite on every bus that there is: ``WINCHKIT_TEST_CAN=vcan0`` names a real one."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from bus_rig import Rig, opened

ON_SOCKETCAN = "WINCHKIT_TEST_CAN" in os.environ
TRANSPORTS = ["socketcan"] if ON_SOCKETCAN else ["virtual", "udp_multicast"]


@pytest.fixture(scope="module", params=TRANSPORTS)
def place(request: pytest.FixtureRequest) -> Iterator[Rig]:
    """A bus with a drive's process and a witness, for a whole file."""
    with opened(request.param) as rig:
        yield rig


@pytest.fixture
def rig(place: Rig) -> Rig:
    """The same with a new drive."""
    place.drive.renew()
    place.until(lambda: place.state() == "SWITCH_ON_DISABLED")
    place.forget()
    return place
