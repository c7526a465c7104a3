"""Packages of npm for a test, or the reason why it is skipped."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest


def install(folder: Path, *packages: str) -> Path:
    """Install packages below a folder; returns where node finds them."""
    for tool in ("node", "npm"):
        if shutil.which(tool) is None:
            pytest.skip(f"this machine has no {tool}: apt-get install nodejs npm")
    done = subprocess.run(
        ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), *packages],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    if done.returncode != 0:
        pytest.skip(f"npm cannot install {', '.join(packages)}: {done.stderr[-500:]}")
    return folder / "node_modules"
