"""Where a log comes from, beyond its wiring: versions, git state, calibrations."""

from __future__ import annotations

import json
import platform
import subprocess
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from winchkit.regular_file import read_text
from winchkit.schema.bench import BenchSpec

_LIBRARIES = ("numpy", "canopen", "python-can", "pymodbus", "pyserial", "mcap")
_TIMEOUT = 2.0
"""s: git answers within some ms; a repository on a dead network drive does not delay a log."""
_ROLES = ("cell", "load", "length", "temperature")


def origin(spec: BenchSpec) -> dict[str, str]:
    """Metadata of a log; unknown items are left out."""
    about = {"versions": json.dumps(_versions())}
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


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version(), "system": platform.platform()}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def _calibrations(spec: BenchSpec) -> dict[str, str]:
    """Content of every calibration file that the wiring names, as JSON."""
    found = {}
    for name, winch in (*spec.winch.items(), *spec.cells.items()):
        for role in _ROLES:
            ref = getattr(winch, role)
            file = getattr(ref, "calibration", None)
            if file:
                found[f"calibration.{name}.{role}"] = _content(Path(spec.path).parent / file)
    return found


def _content(path: Path) -> str:
    try:
        return json.dumps(tomllib.loads(read_text(path)), default=str)
    except (OSError, ValueError) as error:
        return f"{path.name} cannot be read: {error}"
