"""The standard robot: eight lines in a cube, and poses that excite every effect of a robot."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect
from winchkit.effects.placement import at_line
from winchkit.effects.term import Term
from winchkit.model.rotation import rotation_of
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.forces.force_distribution import approximate_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.robot.geometry.tracker import reading_of
from winchkit.schema.profiles.robot import HomeSpec, LineSpec, PlatformSpec, RobotProfile
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    ReferenceSpec,
    WinchProfile,
)

_POSES = 120
"""On the closed path: 40 on each period of its fastest coordinate."""
_MIDDLE = 40.0
"""N: middle of the force distribution, ten times the share of a cable in the weight (3 kg by eight
cables), so that none is slack on the path."""
_DURATION = 60.0
"""s per path: about 0.1 m/s in a cube of one metre."""
_WINCH = WinchProfile(
    name="standard",
    drum=DrumSpec(kind="spiral", winding_radius=0.06),
    gearbox=GearboxSpec(ratio=20.4),
    reference=ReferenceSpec(wound_turns=4.3),
    cable=CableSpec(diameter=0.001),
)
_CORNERS = tuple(product((0.0, 1.0), repeat=3))
STANDARD_ROBOT = RobotProfile(
    name="standard",
    home=HomeSpec((0.5, 0.5, 0.5)),
    platform=PlatformSpec(mass=3.0),
    line=tuple(
        LineSpec(
            name=str(number),
            exit_point=(x, y, z),
            anchor_point=(0.1 * (y - 0.5), 0.1 * (x - 0.5), 0.16 * (0.5 - z)),
            swivel_radius=0.0086,
            swivel_axis=(0.0, 0.0, 1.0 if z else -1.0),
            winch=_WINCH,
        )
        for number, (x, y, z) in enumerate(_CORNERS, start=1)
    ),
)
"""A cube of one metre to each side of its centre, with a cable from every corner."""


def standard_poses(delay: float = 0.0) -> Pose:
    """Poses on a closed path of 60 s through the cube, with rotations, ``delay`` seconds before."""
    at = np.linspace(0.0, 2 * np.pi, _POSES) - 2 * np.pi * delay / _DURATION
    place = 0.5 + 0.25 * np.stack([np.sin(at), np.sin(2 * at + 0.6), np.cos(3 * at)], axis=1)
    turned = rotation_of(0.15 * np.sin(2 * at), 0.15 * np.cos(at), 0.2 * np.sin(3 * at + 1.0))
    return Pose(place, turned)


def robot_changes(effect: Effect, values: dict[str, float]) -> tuple[Array, dict[str, Array]]:
    """Length of line 1 along the standard poses, and its changes by an effect, (p,), SI: that by
    the drum less that by geometry, and the forces nearest to 40 N that balance the weight."""
    there = at_line(effect, "1") if "one" in effect.on_robot else effect
    bare = _shown(_bare())
    changed = _shown(robot_with_terms(STANDARD_ROBOT, [Term(there, values)]))
    moved = {name: changed[name] - bare[name] for name in bare}
    length = _bare().lengths(standard_poses())[:, 0]
    return length, {name: change for name, change in moved.items() if np.any(change != 0)}


@cache
def _bare() -> Robot:
    return robot_of(STANDARD_ROBOT)


def _shown(robot: Robot) -> dict[str, Array]:
    pose, bare = standard_poses(), _bare()
    force = approximate_forces(
        bare.structure(pose), robot.weight(pose), np.full(len(robot.names), _MIDDLE)
    )
    by_drum = robot.lengths_at(bare.motor_angles(pose), force)
    tracker = robot.tracker
    seen = pose if tracker is None else reading_of(tracker, standard_poses(tracker.delay))
    return {"cable_length": (by_drum - robot.lengths(seen))[:, 0], "tension": force[:, 0]}
