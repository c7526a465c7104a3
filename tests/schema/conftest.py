"""Where a declaration of a test may stand."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from declared import WINCH

DEVICES = Path(__file__).parents[2] / "devices"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "file.toml"


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """Where a bench may stand: beside a profile, and devices of its own."""
    (tmp_path / "w.toml").write_text(WINCH)
    for name in ("generic-cia402", "laumas-tlb"):
        shutil.copytree(DEVICES / name, tmp_path / name)
    return tmp_path / "bench.toml"
