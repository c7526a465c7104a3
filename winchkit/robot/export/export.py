"""A robot's profile as a text of another program."""

from __future__ import annotations

from winchkit.dynamics.export import ExportedModel
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import UsageError
from winchkit.robot.export.c_code import robot_header
from winchkit.robot.export.lines import lines_of
from winchkit.robot.export.mjcf import robot_mjcf
from winchkit.schema.profiles.robot import RobotProfile


def export_model(
    profile: RobotProfile, to: str, catalogue: Catalogue | None, load_mass: float | None
) -> ExportedModel:
    """A robot in C or for MuJoCo; arguments as :func:`winchkit.export_model`."""
    if load_mass is not None:
        raise UsageError(
            f"robot '{profile.name}': the mass on its cables is that of [platform]; leave the load "
            "mass out"
        )
    writers = {"c": robot_header, "mjcf": robot_mjcf}
    if to not in writers:
        raise UsageError(
            f"robot '{profile.name}' is written as {' or '.join(writers)}, not as '{to}'; write "
            "the profile of one line's winch in that form"
        )
    text, missing = writers[to](*lines_of(profile, catalogue))
    return ExportedModel(text, tuple(missing))
