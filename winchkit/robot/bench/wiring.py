"""The robot that a bench declares."""

from __future__ import annotations

from winchkit import catalog
from winchkit.effects.catalogue import load_catalogue
from winchkit.robot.effects.bind import robot_with_effects
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_robot


def robot_of_bench(spec: BenchSpec) -> Robot | None:
    """The robot with its effects; None for a bench without ``[robot]``. Raises FileError."""
    if spec.robot is None:
        return None
    path = catalog.find("profiles", spec.robot.profile, spec.path or None)
    return robot_with_effects(read_robot(path), load_catalogue(spec.effect_files))
