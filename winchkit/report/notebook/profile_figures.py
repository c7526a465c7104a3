"""Figures of profiles: the drum of a winch over its cable length, and the geometry of a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from winchkit.effects.bind import line_of
from winchkit.errors import UsageError
from winchkit.report.notebook.style import BLACK, BLUE, GREY, ORANGE, WIDTH, Size, new_figure
from winchkit.robot.geometry.robot import robot_of
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LENGTHS = 400
"""Points of a curve, one for two or three pixels."""
_TURN = 2 * np.pi


def winch_figure(profile: WinchProfile, *, figsize: Size = None) -> Figure:
    """Motor angle, and cable per drum angle, over the cable length.

    ``figsize``: width and height, inches.
    """
    longest = profile.reference.cable_length
    if isinstance(profile, AxisProfile) or not longest:
        raise UsageError(
            f"profile '{profile.name}' has no reference.cable_length: there is no cable to draw"
        )
    line = line_of(profile)
    lengths = np.linspace(0.0, longest, _LENGTHS)
    angles = line.nominal_motor_angle(lengths)
    arms = np.array([line.arm(float(angle)) for angle in angles]) * profile.gearbox.ratio
    with new_figure(figsize or (WIDTH, 2.4)) as figure:
        left, right = figure.subplots(1, 2)
        left.plot(lengths, angles / _TURN, color=BLUE)
        left.set_ylabel("Motor angle [turns]")
        right.plot(lengths, np.abs(arms) * 1e3, color=BLUE)
        right.set_ylabel("Cable per drum angle [mm/rad]")
        for axis in (left, right):
            axis.set_xlabel("cable length [m]")
        figure.suptitle(profile.name, x=0.0, ha="left", fontsize=8)
    return figure


def robot_figure(profile: RobotProfile, *, figsize: Size = None) -> Figure:
    """Exit points, and the platform with its cables at the home pose.

    ``figsize``: width and height, inches. Returns: one axis in three dimensions, m.
    """
    robot = robot_of(profile)
    exits = robot.geometry.exit_point
    anchors = robot.home.position[0] + robot.geometry.anchor_point @ robot.home.rotation[0].T
    with new_figure(figsize or (4.2, 4.2)) as figure:
        axis = figure.add_subplot(projection="3d")
        for name, start, end in zip(robot.names, exits, anchors, strict=True):
            axis.plot(*np.array([start, end]).T, color=GREY, lw=0.8)
            axis.text(*start, f" {name}", fontsize=7, color=BLACK)
        axis.plot(*exits.T, "o", ms=3, color=BLUE, label="exit points")
        axis.plot(*anchors.T, "s", ms=3, color=ORANGE, label="anchor points at home")
        for set_label, letter in zip(
            (axis.set_xlabel, axis.set_ylabel, axis.set_zlabel), "xyz", strict=True
        ):
            set_label(f"{letter} [m]")
        limits = (axis.get_xlim(), axis.get_ylim(), axis.get_zlim())
        axis.set_box_aspect([float(np.ptp(pair)) for pair in limits], zoom=0.85)
        figure.legend(loc="outside upper center", ncols=2)
    return figure
