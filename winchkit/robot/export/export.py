"""A robot's profile as a text of another program."""

from __future__ import annotations

import json
from collections.abc import Sequence

from winchkit.dynamics.c_code import as_json, assigned
from winchkit.dynamics.export import ExportedModel
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import UsageError
from winchkit.robot.export.c_code import cable_formulas, line_numbers, robot_header
from winchkit.robot.export.lines import RobotLine, lines_of
from winchkit.robot.export.mjcf import robot_mjcf
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import RobotProfile


def export_model(
    profile: RobotProfile, to: str, catalogue: Catalogue | None, load_mass: float | None
) -> ExportedModel:
    """A robot in C, for MuJoCo or as formulas; arguments as :func:`winchkit.export_model`."""
    if load_mass is not None:
        raise UsageError(
            f"robot '{profile.name}': the mass on its cables is that of [platform]; leave the load "
            "mass out"
        )
    writers = {"c": robot_header, "mjcf": robot_mjcf, "json": _formulas}
    if to not in writers:
        raise UsageError(
            f"robot '{profile.name}' is written as c, mjcf or json, not as '{to}'; write the "
            "profile of one line's winch in that form"
        )
    text, missing = writers[to](*lines_of(profile, catalogue))
    return ExportedModel(text, tuple(missing))


def _formulas(robot: Robot, lines: Sequence[RobotLine]) -> tuple[str, list[str]]:
    """Formulas of a cable at a pose, with the numbers of each line and the formulas of its winch;
    and what has none."""
    roots, places = cable_formulas(robot.geometry.free)
    assignments, (length, *column) = assigned(roots, places)
    numbers = line_numbers(robot.geometry)
    text = json.dumps(
        {
            "schema": 1,
            "robot": robot.profile.name,
            "inputs": {
                "position": {"unit": "m", "what": "of the platform's origin in the base frame"},
                "rotation": {"unit": "1", "what": "from platform to base axes, row by row"},
                "at": {"unit": "m", "what": "of the line: exit point in the base frame, anchor "
                       "point in the platform frame, unit swivel axis, swivel radius"},
            },
            "assignments": assignments,
            "outputs": {"length": {"value": length, "unit": "m"},
                        "column": {"value": column, "unit": "1 and m"}},
            "lines": {name: {"at": own, "winch": as_json(line.winch, line.terms)}
                      for name, own, line in zip(robot.names, numbers, lines, strict=True)},
        },
        indent=1, ensure_ascii=False,
    )  # fmt: skip
    procedures = ["force distribution: a procedure, which --to c has"]
    return f"{text}\n", procedures
