"""The fixture of several files of this folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from drive_on_bus import Driven, driven_bus


@pytest.fixture
def rig() -> Iterator[Driven]:
    """A simulated drive on a bus that is open."""
    with driven_bus() as made:
        yield made
