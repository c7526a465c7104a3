"""Where a log comes from, beyond its wiring: versions, git state, calibrations."""

from __future__ import annotations

import json
import platform
import subprocess
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from winchkit.bench.cells.instruments import refs_of
from winchkit.regular_file import read_text
from winchkit.schema.bench import BenchSpec

_LIBRARIES = ("numpy", "canopen", "python-can", "pymodbus", "pyserial", "mcap")
_TIMEOUT = 2.0
"""s: git answers within some ms; a repository on a dead network drive does not delay a log."""


def origin(spec: BenchSpec) -> dict[str, str]:
    """Metadata of a log; unknown items are left out."""
    system = {"python": platform.python_version(), "system": platform.platform()}
    about = {"versions": json.dumps({**system, **installed(_LIBRARIES)})}
    if spec.path:
        about |= git_state(Path(spec.path).resolve().parent)
    return about | _calibrations(spec)


def git_state(folder: Path) -> dict[str, str]:
    """Commit of the folder's repository, and whether there are changes; nothing outside of one."""
    commit = _git(folder, "rev-parse", "HEAD")
    if commit is None:
        return {}
    changes = _git(folder, "status", "--porcelain")
    if changes is None:
        return {"git": commit}
    return {"git": f"{commit} with changes" if changes else commit}


def _git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words],
            capture_output=True,
            text=True,
            check=False,
            timeout=_TIMEOUT,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def installed(libraries: Sequence[str]) -> dict[str, str]:
    """Versions of those libraries that are installed."""
    found = {}
    for name in libraries:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _calibrations(spec: BenchSpec) -> dict[str, str]:
    """Content of every calibration file that the wiring names, as JSON."""
    return {
        f"calibration.{name}.{role}": _content(Path(spec.path).parent / ref.calibration)
        for (name, role), ref in refs_of(spec).items()
        if ref.calibration
    }


def _content(path: Path) -> str:
    try:
        return json.dumps(tomllib.loads(read_text(path)), default=str)
    except (OSError, ValueError) as error:
        return f"{path.name} cannot be read: {error}"
