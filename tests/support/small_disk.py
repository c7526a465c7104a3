"""A file system of a few kilobytes, for a process of its own: a disk that is really full."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def run_on_small_disk(
    folder: Path, script: str, size: str, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run Python code with ``disk`` as a variable: a tmpfs of ``size`` mounted for it alone.

    What the script leaves there is copied to ``folder``. Skips where no one may mount.
    """
    disk = folder / "disk"
    disk.mkdir()
    mount = f"mount -t tmpfs -o size={size} tmpfs {disk} || exit 99"
    code = f"from pathlib import Path\ndisk = Path({str(disk)!r})\n{script}"
    words = ["sh", "-c", f'{mount}; "$0" -c "$1"; code=$?; cp -a {disk}/. {folder}; exit $code']
    if shutil.which("unshare") is None:
        pytest.skip("needs unshare")
    done = subprocess.run(
        ["unshare", "--user", "--map-root-user", "--mount", *words, sys.executable, code],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        env=environment,
    )
    if done.returncode == 99 or "unshare failed" in done.stderr:
        pytest.skip("needs the permission to mount a tmpfs")
    return done
