"""Cable robots from TOML: lines with their winches inline or by the name of a profile."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from winchkit.errors import FileError
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.parts import Reading


def robot(
    reading: Reading, tree: dict[str, Any], read_winch: Callable[[Path], WinchProfile]
) -> RobotProfile | None:
    """A robot; ``read_winch`` reads the profile of a line that names one."""
    tree = {"name": reading.stem, **tree}
    if "effect" in tree:
        tree["effect"] = reading.effects(tree["effect"])
    if isinstance(prior := tree.get("prior"), dict):
        tree["prior"] = {
            name: {"std": value} if isinstance(value, str) else value
            for name, value in prior.items()
        }
    if isinstance(lines := tree.get("line"), list):
        tree["line"] = [_line(reading, raw, ("line", n), read_winch) for n, raw in enumerate(lines)]
    return reading.table(RobotProfile, tree)


def _line(
    reading: Reading, raw: object, at: Key, read_winch: Callable[[Path], WinchProfile]
) -> object:
    """A line with its winch's profile in place of a name or a table."""
    if not isinstance(raw, dict) or "winch" not in raw:
        return raw
    winch, place = raw["winch"], (*at, "winch")
    if isinstance(winch, dict):
        profile = reading.winch(winch, str(raw.get("name", "")), place)
    elif isinstance(winch, str):
        profile = _named_winch(reading, winch, place, read_winch)
    else:
        profile = None
        reading.fault(place, f"expected the name of a winch or its tables, not {winch!r}")
    # The faults of a winch are noted above and not reported a second time.
    return {**raw, "winch": profile or str(winch)}


def _named_winch(
    reading: Reading, name: str, at: Key, read_winch: Callable[[Path], WinchProfile]
) -> WinchProfile | None:
    path = reading.shipped("profiles", name, at)
    if path is None:
        return None
    try:
        return read_winch(path)
    except FileError as error:
        reading.faults += error.faults
        return None
