"""Simulated benches as a test declares them: by name, or winch by winch."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import SimBench

_DEFAULT = "spiral-bench"
_FILE = "sim-bench.toml"


def declared(
    name: str | Path | None, winches: Mapping[str, Mapping[str, Any]] | None, folder: Path
) -> SimBench:
    """Read a simulated bench; one with ``winches`` is first written into ``folder``. Raises
    FileError, UsageError."""
    path = find("sim", str(name or _DEFAULT))
    if winches is None:
        if name is None:
            raise UsageError(
                'sim_bench() needs a name such as "spiral-bench", or winches={"A": {}}'
            )
        return read_simbench(path)
    tree = tomllib.loads(path.read_text(encoding="utf-8"))
    pattern = next(iter(tree["winch"].values()))
    tree["winch"] = {
        winch: _merged(_wired(pattern, place, path), table)
        for place, (winch, table) in enumerate(winches.items())
    }
    written = folder / _FILE
    written.write_text(tomlkit.dumps(tree), encoding="utf-8")
    return read_simbench(written)


def _wired(pattern: Mapping[str, Any], place: int, beside: Path) -> dict[str, Any]:
    """The pattern with addresses of its own, so that any number of winches share its buses, and
    files named so that they are found from elsewhere."""
    wired = dict(pattern)
    wired["profile"] = str(find("profiles", pattern["profile"], beside=beside).resolve())
    roles = [role for role, ref in pattern.items() if isinstance(ref, dict) and "device" in ref]
    for role in roles:
        ref = dict(pattern[role])
        ref["device"] = str(find("devices", ref["device"], beside=beside).resolve())
        for key in ("node", "unit"):
            if key in ref:
                ref[key] += place * max(pattern[one].get(key, 0) for one in roles)
        wired[role] = ref
    return wired


def _merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Tables key by key; everything else is replaced."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            merged[key] = _merged(old, value)
        else:
            merged[key] = value
    return merged
