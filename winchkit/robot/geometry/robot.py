"""Kinematic model of a declared robot: poses, cable lengths and motor angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from winchkit.arguments import require_type
from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.drum import Archimedean, Drum, Grooved, Spiral, Squared, drum_of
from winchkit.model.line import Line
from winchkit.model.stages import ROBOT_STAGES, At, LinePlace, Modifier, Stage
from winchkit.robot.geometry.candidates import RESOLUTION
from winchkit.robot.geometry.forward import AGREEMENT, PosesFound, forward
from winchkit.robot.geometry.kinematics import (
    Geometry,
    Pose,
    geometry_of,
    guided,
    home_of,
    lengths,
    structure_matrix,
)
from winchkit.robot.geometry.loops import CableLine
from winchkit.robot.geometry.tracker import Tracker, declared_tracker
from winchkit.robot.geometry.wrench import gravity_wrench
from winchkit.schema.profiles.robot import COORDINATES, Coordinate, PlatformSpec, RobotProfile
from winchkit.schema.profiles.winch import WinchProfile

_TURN = 2 * np.pi
_FLAT = 1e-3
"""Thickness of a plane that has all cables, as a share of the robot's size (rule of thumb)."""
_NEWTON_STEPS = 5
"""As for one line (four reach 1e-7 of the start's error), and one more since the cable force, too,
may be far from the reference's."""


@dataclass(frozen=True)
class Robot:
    """Geometry, winches and home pose of a robot, its effects included.

    A line's length at a pose is L(home) − (W(Φ_ref + φ) − W(Φ_ref)), with the drum's W and its
    wound angle Φ; L(home) comes from the geometry. Modifiers, made by effects, act on the way.
    """

    profile: RobotProfile
    """As declared."""
    geometry: Geometry
    """Exit points, anchor points and swivel pulleys of the n lines."""
    home: Pose
    """Pose at which all motor angles are zero."""
    home_length: Array
    """Cable lengths at home, (n,), m."""
    platform: PlatformSpec
    """Mass and centre of mass."""
    modifiers: tuple[tuple[Modifier, ...], ...]
    """Per line, in the stages of a winch."""
    tracker: Tracker | None = None
    """Instrument that measures poses; None where it shows them in the base frame."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the lines."""
        return tuple(line.name for line in self.profile.line)

    @property
    def winches(self) -> list[WinchProfile]:
        """Profiles of the lines' winches."""
        found = []
        for line in self.profile.line:
            if not isinstance(line.winch, WinchProfile):
                raise UsageError(f"line {line.name}: winch '{line.winch}' has not been read")
            found.append(line.winch)
        return found

    @cached_property
    def lines(self) -> tuple[Line, ...]:
        """The winches as lines that begin with their cable at home."""
        return tuple(
            Line(
                replace(winch, reference=replace(winch.reference, cable_length=float(there))),
                modifiers,
            )
            for winch, there, modifiers in zip(
                self.winches, self.home_length, self.modifiers, strict=True
            )
        )

    @cached_property
    def _rest(self) -> At:
        """A line at rest: effects of place do not depend on motion, and one serves all."""
        return Line(self.winches[0]).at_rest(0.0)

    @property
    def dead_length(self) -> Array:
        """Stressed cable between drum and exit point, (n,), m."""
        return np.array([winch.cable.dead_length for winch in self.winches])

    def lengths(self, pose: Pose) -> Array:
        """Geometric cable lengths, arcs included, (p, n), m.

        Parameters
        ----------
        pose : Pose
            The p poses.

        Returns
        -------
        (p, n) array
            m.
        """
        return lengths(self.geometry, pose.position, pose.rotation)

    def structure(self, pose: Pose) -> Array:
        """Structure matrices Aᵀ, (p, 6, n).

        Parameters
        ----------
        pose : Pose
            The p poses.

        Returns
        -------
        (p, 6, n) array
            Wrench per unit of cable force: 1 and m.
        """
        return structure_matrix(self.geometry, pose.position, pose.rotation)

    def weight(self, pose: Pose) -> Array:
        """Wrench of the platform's weight, (p, 6).

        Parameters
        ----------
        pose : Pose
            The p poses.

        Returns
        -------
        (p, 6) array
            Force and torque about the platform frame's origin, N and N m.
        """
        return gravity_wrench(self.platform, pose.rotation)

    def guided(self, pose: Pose) -> Pose:
        """Poses with those coordinates of home that guides hold.

        Parameters
        ----------
        pose : Pose
            The p poses.

        Returns
        -------
        Pose
            The same poses where the platform has all six degrees of freedom.
        """
        return guided(pose, self.home, self.geometry.free)

    @property
    def planar(self) -> tuple[Coordinate, ...]:
        """Degrees of freedom in the plane of all cables at home; empty where they are in none."""
        there = self.home.position + self.geometry.anchor_point @ self.home.rotation[0].T
        points = np.concatenate([self.geometry.exit_point, there])
        flat = np.ptp(points, axis=0) <= _FLAT * self.geometry.size
        if np.count_nonzero(flat) != 1:
            return ()
        across = int(np.argmax(flat))
        return (
            *(name for k, name in enumerate(COORDINATES[:3]) if k != across),
            COORDINATES[3 + across],
        )

    @property
    def hangs(self) -> bool:
        """Whether fewer cables than degrees of freedom leave the platform's pose to its weight."""
        return len(self.profile.line) < self.geometry.degrees

    def motor_angles(
        self, pose: Pose, strain: Array | float = 0.0, tension: Array | float = 0.0
    ) -> Array:
        """Inverse kinematics with drums and effects.

        Parameters
        ----------
        pose : Pose
            The p poses.
        strain : float, (n,) or (p, n) array
            Strain against home that no effect of the profile describes; it acts on the length and
            on the dead length.
        tension : float, (n,) or (p, n) array
            Cable forces, N, for effects that depend on them.

        Returns
        -------
        (p, n) array
            Motor angles, rad.
        """
        there = self.lengths(pose)
        slack = there - strain * (there + self.dead_length)
        pulled = np.broadcast_to(tension, slack.shape)
        out = np.empty_like(slack)
        for i, (winch, line) in enumerate(zip(self.winches, self.lines, strict=True)):
            drum, home = drum_of(winch), _TURN * winch.reference.wound_turns
            wound = drum.wound(np.asarray(home)) + self.home_length[i] - slack[:, i]
            turned = drum.angle(wound) - home
            out[:, i] = winch.reference.motor_angle + _ratio(winch) * turned
            for _ in range(_NEWTON_STEPS if line.modifiers else 0):
                length, arm = line.lengths_and_arms(line.at_rest(out[:, i], pulled[:, i]))
                out[:, i] += (length - slack[:, i]) / arm
        return out

    def lengths_at(
        self,
        motor_angles: Array,
        tension: Array | float = 0.0,
        temperature: Array | float = 20.0,
    ) -> Array:
        """Cable lengths by drums and effects.

        Parameters
        ----------
        motor_angles : (p, n) array
            rad.
        tension : float, (n,) or (p, n) array
            Cable forces, N.
        temperature : float, (n,) or (p, n) array
            Of the cables, degrees Celsius.

        Returns
        -------
        (p, n) array
            m.
        """
        angles = np.atleast_2d(np.asarray(motor_angles, dtype=float))
        if angles.shape[1] != len(self.profile.line):
            raise UsageError(
                f"{angles.shape[1]} motor angles were given for a robot of "
                f"{len(self.profile.line)} lines"
            )
        pulled, warm = (np.broadcast_to(x, angles.shape) for x in (tension, temperature))
        out = np.empty_like(angles)
        for i, line in enumerate(self.lines):
            out[:, i] = line.lengths(line.at_rest(angles[:, i], pulled[:, i], warm[:, i]))
        return out

    def poses_at(
        self,
        motor_angles: Array,
        start: Pose | None = None,
        tension: Array | float = 0.0,
        temperature: Array | float = 20.0,
        *,
        tolerance: float = AGREEMENT,
        search: float | Literal["outlying"] = RESOLUTION,
    ) -> PosesFound:
        """Forward kinematics of motor angles (p, n), rad, from ``start``, else from home.

        Parameters
        ----------
        motor_angles : (p, n) array
            rad.
        start : Pose, optional
            Start of the iteration; the home pose by default.
        tension : float, (n,) or (p, n) array
            Cable forces, N.
        temperature : float, (n,) or (p, n) array
            Of the cables, degrees Celsius.
        tolerance, search : float
            As of :func:`winchkit.robot.geometry.forward.forward`.

        Returns
        -------
        PosesFound
            Poses, and which of them have converged.
        """
        given = self.lengths_at(motor_angles, tension, temperature)
        return forward(
            self.geometry,
            given,
            self.guided(start or self.home),
            self.platform,
            tolerance=tolerance,
            search=search,
        )


def robot_of(
    profile: RobotProfile,
    modifiers: Sequence[Sequence[Modifier]] = (),
    payload: Sequence[Modifier] = (),
    tracker: Sequence[Modifier] = (),
) -> Robot:
    """Build the robot that a profile declares, with modifiers per line and of its platform.

    Parameters
    ----------
    profile : RobotProfile
        With the winch of each line read.
    modifiers : sequence, optional
        Modifiers of each line. Without them it is the nominal robot;
        ``winchkit.robot.robot_with_effects`` applies the profile's own effects.
    payload : sequence, optional
        Modifiers of the platform.
    tracker : sequence, optional
        Modifiers of the instrument that measures poses.

    Returns
    -------
    Robot
        Kinematic model of the robot.
    """
    require_type(profile, RobotProfile, "profile")
    home, geometry, shown = home_of(profile), geometry_of(profile), declared_tracker(profile)
    there = lengths(geometry, home.position, home.rotation)[0]
    none, seen = ((),) * len(profile.line), None if shown.is_trivial else shown
    nominal = Robot(profile, geometry, home, there, profile.platform, none, seen)
    return modified(nominal, modifiers, payload, tracker)


def modified(
    nominal: Robot,
    modifiers: Sequence[Sequence[Modifier]] = (),
    payload: Sequence[Modifier] = (),
    tracker: Sequence[Modifier] = (),
) -> Robot:
    """A robot without modifiers, with these; the same as :func:`robot_of` of its profile."""
    profile, geometry, home = nominal.profile, nominal.geometry, nominal.home
    own = tuple(tuple(m) for m in modifiers) or nominal.modifiers
    shown = _tracker(nominal, tracker) if tracker else nominal.tracker
    if not any(own) and not payload:
        return replace(nominal, tracker=shown)
    exits, anchors = geometry.exit_point.copy(), geometry.anchor_point.copy()
    radii, offsets = geometry.swivel_radius.copy(), np.zeros(len(own))
    rest = nominal._rest
    for i, stages in enumerate(own):
        place, offset = LinePlace(exits[i], anchors[i], float(radii[i])), 0.0
        for modifier in stages:
            if modifier.stage is Stage.LINE_PLACE:
                place = modifier.apply(place, rest)
            elif modifier.stage is Stage.HOME_LENGTH:
                offset = modifier.apply(offset, rest)
        exits[i], anchors[i], radii[i] = place.exit_point, place.anchor_point, place.swivel_radius
        offsets[i] = offset
    geometry = replace(geometry, exit_point=exits, anchor_point=anchors, swivel_radius=radii)
    there = lengths(geometry, home.position, home.rotation)[0] + offsets
    platform = profile.platform
    for modifier in payload:
        platform = modifier.apply(platform, rest)
    lines = tuple(tuple(m for m in stages if m.stage not in ROBOT_STAGES) for stages in own)
    return Robot(profile, geometry, home, there, platform, lines, shown)


def _tracker(nominal: Robot, modifiers: Sequence[Modifier]) -> Tracker | None:
    """The tracker of a robot's file with effects; None where it shows the pose itself."""
    found = declared_tracker(nominal.profile)
    for modifier in sorted(modifiers, key=lambda m: m.order):
        found = modifier.apply(found, nominal._rest)
    return None if found.is_trivial else found


def cables_of(robot: Robot) -> list[CableLine]:
    """Lines for the loops of a control cycle.

    Parameters
    ----------
    robot : Robot
        The robot.

    Returns
    -------
    list of CableLine
        One per line.

    Raises
    ------
    UsageError
        For effects that the loops do not compute, and for a platform that guides hold.
    """
    if robot.geometry.degrees < len(robot.geometry.free):
        raise UsageError(
            "the loops of a control cycle move a platform in all six degrees of freedom, not in "
            f"{', '.join(robot.platform.degrees_of_freedom)} alone; take Robot.motor_angles and "
            "Robot.poses_at"
        )
    return [_cable(robot, i, winch) for i, winch in enumerate(robot.winches)]


def _cable(robot: Robot, index: int, winch: WinchProfile) -> CableLine:
    place = robot.geometry
    _only_drums(robot, index)
    drum, home = robot.lines[index].drum, _TURN * winch.reference.wound_turns
    stepped, winding, growth = _law(drum)
    ex, ey, ez = place.exit_point[index].tolist()
    bx, by, bz = place.anchor_point[index].tolist()
    sx, sy, sz = place.swivel_axis[index].tolist()
    return CableLine(
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


def _only_drums(robot: Robot, index: int) -> None:
    """Refuse modifiers that the loops do not compute."""
    if any(m.stage not in (Stage.DRUM, Stage.CELL) for m in robot.modifiers[index]):
        raise UsageError(
            f"line {robot.names[index]} has effects beside its drum's; the loops of a control "
            "cycle leave them out: take Robot.motor_angles, or the robot without them and strains"
        )


def _law(drum: Drum) -> tuple[float, float, float]:
    """Winding law as stepped (1) or smooth (0), first radius and growth per turn."""
    match drum:
        case Spiral(radius, growth):
            return 1.0, radius, growth
        case Archimedean(radius, growth):
            return 0.0, radius, growth
        case Squared(radius, build_up):
            return 0.0, radius, np.pi * build_up
        case Grooved(radius, pitch):
            return 0.0, float(np.hypot(radius, pitch / _TURN)), 0.0
    raise TypeError(f"{type(drum).__name__} is not a winding law of the loops")


def _ratio(winch: WinchProfile) -> float:
    return winch.gearbox.direction * winch.gearbox.ratio
