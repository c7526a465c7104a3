"""Fixtures of several files of this folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from served import Served
from slave.rig import Rig
from winchkit.bench.bench import Bench


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """One slave, and no bench yet."""
    return Rig(tmp_path)


@pytest.fixture
def bench(rig: Rig) -> Iterator[Bench]:
    """The open bench of ``rig``."""
    with rig.opened() as opened:
        yield opened


@pytest.fixture
def cell() -> Iterator[Served]:
    """A simulated load cell on Modbus TCP."""
    with Served("laumas-tlb") as served:
        yield served
