"""A robot as a model of MuJoCo: a platform on spatial tendons, and a drum for each line.

A line has a drum with the joint attributes of its winch, a slide that the drum moves by the
polynomial of its wound length, and a tendon of fixed length without force from the slide over the
swivel pulley to the platform: winding in stretches it. MuJoCo's cylinder has no groove that would
turn it, so that a swivel pulley is a body that stands until the user's program turns it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.dynamics.mjcf import SMALL, arm_and_growth, joint_of, mujoco_head, wound_equality
from winchkit.errors import UsageError
from winchkit.model.rotation import quaternion_of
from winchkit.robot.export.lines import RobotLine
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.robot import COORDINATES

_ELASTIC = "cable-elongation-linear"
_SIDE = np.array([1.2, 0.0, 2.0])
"""Radii, in the frame of a pulley (outward, across, swivel axis): a point on the side of its groove
on which the cable lies."""
_NEAR = 2.0
"""Radii in front of the exit point at which the path has a point of its own: from afar the straight
way to the anchor point would pass the pulley without touching it."""
_HALF = 2e-3
"""m: half the height of a pulley's cylinder, which is drawn only."""


def robot_mjcf(robot: Robot, lines: Sequence[RobotLine]) -> tuple[str, list[str]]:
    """The model, and what it lacks. Raises UsageError without masses or a cable's stiffness."""
    name, place, body = robot.profile.name, robot.geometry, robot.platform
    if body.mass <= 0 or body.inertia is None or min(body.inertia) <= 0:
        raise UsageError(
            f"robot '{name}' has no mass that MuJoCo could move: write [platform] mass and "
            "inertia, the three principal moments about the centre of mass"
        )
    # Straight cable in front of a pulley, of which the slide takes what is paid out.
    before = 2 * place.size
    free = robot.lengths_at(np.zeros(len(lines)))[0]
    anchors = robot.home.position + place.anchor_point @ robot.home.rotation[0].T
    fixed, tendons, motors, equalities = [], [], [], []
    missing: list[str] = []
    comments: list[str] = []
    for i, (line, end, axis) in enumerate(
        zip(lines, place.exit_point, place.swivel_axis, strict=True)
    ):
        stiffness = _axial_stiffness(line) / (free[i] + line.winch.cable.dead_length)
        joint, lacking = joint_of(line.winch, line.terms, {_ELASTIC}), list[str]()
        arm, growth = arm_and_growth(line.winch, lacking)
        missing += [f"line {line.name}: {one}" for one in (*joint.missing, *lacking)]
        comments += [f"line {line.name}: {one}" for one in joint.comments]
        cable, drum = f"cable-{line.name}", f"drum-{line.name}"
        start = _row(end - before * axis)
        fixed += [
            f'<body name="{drum}" pos="{start}"><joint name="{drum}" type="hinge" '
            f'axis="{_row(axis)}" {joint.attributes}/>{joint.body}</body>',
            f'<body name="{cable}" pos="{start}"><joint name="{cable}" type="slide" '
            f'axis="{_row(-axis)}"/>{_inertial(SMALL, np.zeros(3), np.full(3, SMALL))}'
            f'<site name="start-{line.name}"/></body>',
        ]
        radius = float(place.swivel_radius[i])
        over = f'<site site="exit-{line.name}"/>'
        fixed.append(f'<site name="exit-{line.name}" pos="{_row(end - _NEAR * radius * axis)}"/>')
        if radius > 0:
            fixed.append(_pulley(line.name, end, axis, radius, anchors[i]))
            over += f'<geom geom="pulley-{line.name}" sidesite="side-{line.name}"/>'
        tendons.append(
            f'<spatial name="{line.name}" stiffness="{stiffness:.17g}" '
            f'springlength="0 {before + free[i]:.17g}"><site site="start-{line.name}"/>{over}'
            f'<site site="anchor-{line.name}"/></spatial>'
        )
        motors.append(f'<motor name="{line.name}" joint="{drum}" gear="{joint.gear:.17g}"/>')
        equalities.append(wound_equality(cable, drum, arm, growth))
    sites = "".join(
        f'<site name="anchor-{line.name}" pos="{_row(at)}"/>'
        for line, at in zip(lines, place.anchor_point, strict=True)
    )
    inertial = _inertial(body.mass, np.array(body.center_of_mass), np.array(body.inertia))
    fixed.append(
        f'<body name="platform" pos="{_row(robot.home.position)}" '
        f'quat="{_row(quaternion_of(robot.home.rotation))}">{_joints(robot)}{inertial}{sites}</body>'
    )
    if place.swivel_radius.any():
        missing.append(
            "swivelling: the pulleys stand as at home; turn the x axes of the mocap bodies "
            "pulley-LINE towards the anchor points"
        )
    missing.append("change of a cable's stiffness with the length that is paid out")
    text = (
        f"{mujoco_head(name, comments, missing)}"
        f"  <worldbody>\n{_lines(fixed)}  </worldbody>\n  <tendon>\n{_lines(tendons)}  </tendon>\n"
        f"  <equality>\n{''.join(equalities)}  </equality>\n"
        f"  <actuator>\n{_lines(motors)}  </actuator>\n</mujoco>\n"
    )
    return text, missing


def _axial_stiffness(line: RobotLine) -> float:
    """EA of a line's cable, N; raises UsageError where it is unknown."""
    for term in line.terms:
        if term.effect.id == _ELASTIC:
            return float(term.values["axial_stiffness"])
    raise UsageError(
        f"line {line.name}: the stiffness of its cable is unknown, on which MuJoCo hangs the "
        f"platform: add the effect {_ELASTIC}, or [cable] axial_stiffness to the winch"
    )


def _joints(robot: Robot) -> str:
    """Degrees of freedom of the platform, along base axes."""
    if robot.geometry.free.all():
        return '<freejoint name="platform"/>'
    # Translations first: a rotation then turns about the platform's own place.
    turned = robot.home.rotation[0].T
    return "".join(
        f'<joint name="{name}" type="{"slide" if k < 3 else "hinge"}" '
        f'axis="{_row(turned[:, k % 3])}"/>'
        for k, name in enumerate(COORDINATES)
        if robot.geometry.free[k]
    )


def _pulley(name: str, end: Array, axis: Array, radius: float, anchor: Array) -> str:
    """A cylinder that touches the axis in the exit point, towards the anchor point at home."""
    seen = anchor - end
    outward = seen - (seen @ axis) * axis
    outward /= np.linalg.norm(outward)
    turned = np.stack([outward, np.cross(axis, outward), axis], axis=-1)
    return (
        f'<body name="pulley-{name}" mocap="true" pos="{_row(end)}" '
        f'quat="{_row(quaternion_of(turned))}"><geom name="pulley-{name}" type="cylinder" '
        f'size="{radius:.17g} {_HALF}" pos="{radius:.17g} 0 0" zaxis="0 1 0" contype="0" '
        f'conaffinity="0"/><site name="side-{name}" pos="{_row(_SIDE * radius)}"/></body>'
    )


def _inertial(mass: float, centre: Array, moments: Array) -> str:
    return f'<inertial pos="{_row(centre)}" mass="{mass:.17g}" diaginertia="{_row(moments)}"/>'


def _row(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in np.ravel(values))


def _lines(items: Sequence[str]) -> str:
    return "".join(f"    {item}\n" for item in items)
