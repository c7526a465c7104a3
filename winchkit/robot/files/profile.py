"""Robots from TOML: a profile, whose lines have their winches inline or by name; a programme."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from winchkit.model.rotation import angles_of
from winchkit.robot.geometry.kinematics import home_of
from winchkit.robot.geometry.tracker import declared_tracker, pose_behind
from winchkit.schema.profiles.robot import HomeSpec, RobotProfile
from winchkit.schema.read import read_winch
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.parts import FileReading
from winchkit.schema.robot_programme import RobotProgramme


def robot(reading: FileReading, tree: dict[str, Any]) -> RobotProfile | None:
    """A robot, with the profiles of the lines that name one."""
    tree = {"name": reading.stem, **tree}
    if "effect" in tree:
        tree["effect"] = reading.effects(tree["effect"])
    if isinstance(prior := tree.get("prior"), dict):
        tree["prior"] = {
            name: {"std": value} if isinstance(value, str) else value
            for name, value in prior.items()
        }
    if isinstance(lines := tree.get("line"), list):
        tree["line"] = [_line(reading, raw, ("line", n)) for n, raw in enumerate(lines)]
    return _with_home(reading.table(RobotProfile, tree))


def _with_home(profile: RobotProfile | None) -> RobotProfile | None:
    """A profile with its home pose in the base frame."""
    if profile is None or profile.home.frame == "base":
        return profile
    home = pose_behind(declared_tracker(profile), home_of(profile))
    position, angles = home.position[0].tolist(), angles_of(home.rotation)[0].tolist()
    return replace(profile, home=HomeSpec(tuple(position), tuple(angles)))


def _line(reading: FileReading, raw: object, at: Key) -> object:
    """A line with its winch's profile in place of a name or a table."""
    if not isinstance(raw, dict) or "winch" not in raw:
        return raw
    winch, place = raw["winch"], (*at, "winch")
    if isinstance(winch, dict):
        profile = reading.winch(winch, str(raw.get("name", "")), place)
    elif isinstance(winch, str):
        profile = reading.declared("profiles", winch, place, read_winch)
    else:
        profile = None
        reading.fault(place, f"expected the name of a winch or its tables, not {winch!r}")
    # The faults of a winch are noted above and not reported a second time.
    return {**raw, "winch": profile or str(winch)}


def programme(reading: FileReading, tree: dict[str, Any]) -> RobotProgramme | None:
    """A programme of the platform, with the file's name where it gives itself none."""
    return reading.table(RobotProgramme, {"name": reading.stem, **tree})
