"""A robot as declared, ready to compute with: poses, rope lengths and motor angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.errors import UsageError
from winchkit.model.drum import Archimedean, Drum, Grooved, Spiral, Squared, drum_of
from winchkit.model.robot.forward import Found, forward
from winchkit.model.robot.kernels import RopeLine
from winchkit.model.robot.kinematics import (
    Geometry,
    Pose,
    geometry_of,
    home_of,
    lengths,
    structure_matrix,
)
from winchkit.model.robot.wrench import gravity_wrench
from winchkit.schema.robot import RobotProfile
from winchkit.schema.winch import WinchProfile

__all__ = ["Robot", "robot_of", "ropes_of"]

Array = NDArray[np.float64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Robot:
    """Geometry, winches and home pose of a robot; every line is its nominal profile.

    A line's length at a pose is L(home) − (W(Φ_ref + φ) − W(Φ_ref)), with the drum's W and its
    wound angle Φ; L(home) comes from the geometry.
    """

    profile: RobotProfile
    geometry: Geometry
    home: Pose
    home_length: Array
    """(n,), m."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the lines."""
        return tuple(line.name for line in self.profile.line)

    @property
    def winches(self) -> list[WinchProfile]:
        """Profiles of the lines' winches."""
        return _winches(self.profile)

    @property
    def dead_length(self) -> Array:
        """Stressed rope between drum and exit point, (n,), m."""
        return np.array([winch.cable.dead_length for winch in self.winches])

    def lengths(self, pose: Pose) -> Array:
        """Geometric rope lengths, arcs included, (p, n), m."""
        return lengths(self.geometry, pose.position, pose.rotation)

    def structure(self, pose: Pose) -> Array:
        """Structure matrices Aᵀ, (p, 6, n)."""
        return structure_matrix(self.geometry, pose.position, pose.rotation)

    def weight(self, pose: Pose) -> Array:
        """Wrench of the platform's weight, (p, 6)."""
        return gravity_wrench(self.profile.platform, pose.rotation)

    def motor_angles(self, pose: Pose, strain: Array | float = 0.0) -> Array:
        """Motor angles at poses, (p, n), rad, with ropes strained more than at home by ``strain``.

        ``strain`` is one number, (n,) or (p, n); it acts on length and dead length.
        """
        there = self.lengths(pose)
        slack = there - strain * (there + self.dead_length)
        out = np.empty_like(slack)
        for i, winch in enumerate(self.winches):
            drum, home = drum_of(winch), _TURN * winch.reference.wound_turns
            wound = drum.wound(np.asarray(home)) + self.home_length[i] - slack[:, i]
            turned = drum.angle(wound) - home
            out[:, i] = winch.reference.motor_angle + _ratio(winch) * turned
        return out

    def lengths_at(self, motor_angles: Array) -> Array:
        """Rope lengths that motor angles (p, n) stand for, (p, n), m."""
        angles = np.atleast_2d(np.asarray(motor_angles, dtype=float))
        if angles.shape[1] != len(self.profile.line):
            raise UsageError(
                f"{angles.shape[1]} motor angles were given for a robot of "
                f"{len(self.profile.line)} lines"
            )
        out = np.empty_like(angles)
        for i, winch in enumerate(self.winches):
            drum, home = drum_of(winch), _TURN * winch.reference.wound_turns
            turned = (angles[:, i] - winch.reference.motor_angle) / _ratio(winch)
            wound = drum.wound(home + turned) - drum.wound(np.asarray(home))
            out[:, i] = self.home_length[i] - wound
        return out

    def poses_at(self, motor_angles: Array, start: Pose | None = None) -> Found:
        """Poses at motor angles (p, n), searched from ``start``, else from home."""
        given = self.lengths_at(motor_angles)
        return forward(self.geometry, given, start or self.home, self.profile.platform)


def robot_of(profile: RobotProfile) -> Robot:
    """The robot that a profile declares."""
    geometry, home = geometry_of(profile), home_of(profile)
    return Robot(profile, geometry, home, lengths(geometry, home.position, home.rotation)[0])


def ropes_of(robot: Robot) -> list[RopeLine]:
    """The lines as the loops of a control cycle want them."""
    return [_rope(robot, i, winch) for i, winch in enumerate(robot.winches)]


def _rope(robot: Robot, index: int, winch: WinchProfile) -> RopeLine:
    place = robot.geometry
    drum, home = drum_of(winch), _TURN * winch.reference.wound_turns
    stepped, winding, growth = _law(drum)
    ex, ey, ez = place.exit_point[index].tolist()
    bx, by, bz = place.anchor_point[index].tolist()
    sx, sy, sz = place.swivel_axis[index].tolist()
    return RopeLine(
        ex=ex,
        ey=ey,
        ez=ez,
        bx=bx,
        by=by,
        bz=bz,
        sx=sx,
        sy=sy,
        sz=sz,
        radius=float(place.swivel_radius[index]),
        home_length=float(robot.home_length[index]),
        stepped=stepped,
        winding=winding,
        growth=growth,
        home_wound=float(drum.wound(np.asarray(home))),
        home_angle=home,
        ratio=_ratio(winch),
        motor_angle=winch.reference.motor_angle,
        dead_length=winch.cable.dead_length,
    )


def _law(drum: Drum) -> tuple[float, float, float]:
    """A winding law as stepped or smooth, with its first radius and its growth a turn."""
    match drum:
        case Spiral(radius, growth):
            return 1.0, radius, growth
        case Archimedean(radius, growth):
            return 0.0, radius, growth
        case Squared(radius, build_up):
            return 0.0, radius, np.pi * build_up
        case Grooved(radius, pitch):
            return 0.0, float(np.hypot(radius, pitch / _TURN)), 0.0
    raise TypeError(f"{type(drum).__name__} is no winding law that the loops know")


def _ratio(winch: WinchProfile) -> float:
    return winch.gearbox.direction * winch.gearbox.ratio


def _winches(profile: RobotProfile) -> list[WinchProfile]:
    found = []
    for line in profile.line:
        if not isinstance(line.winch, WinchProfile):
            raise UsageError(f"line {line.name}: winch '{line.winch}' has not been read")
        found.append(line.winch)
    return found
