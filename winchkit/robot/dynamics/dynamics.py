"""Newton-Euler equations of the platform: inverse and forward dynamics.

About the platform's origin, in base axes, with the mass m, the lever of the centre of mass c = R s,
the moment of inertia I about it, the acceleration a of the origin, angular velocity ω and angular
acceleration α:

    a_c = a + α × c + ω × (ω × c)
    Aᵀ f + w = 0,      w = [m g − m a_c;  c × (m g − m a_c) − I α − ω × I ω]

The wrench w of weight and inertial forces takes the place of the weight in every equation of the
balance at rest, so that force distribution and elongation correction use it unchanged.

Cables are straight and without mass: the sag of a cable of length l, mass per length μ and
horizontal span h under the force f shortens its chord by (μ g h)² l / (24 f²) (parabola); compare
it with the accuracy that is wanted.

References
----------
N. M. Trieu, N. T. Thinh, *Design and Analysis of a Cable-winding Device for Cable Suspended
Parallel Robot*, Eq. 9. H. M. Irvine, *Cable Structures*, 1981, ch. 1 (parabola).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import cross, skew
from winchkit.model.stages import Signals
from winchkit.robot.forces.force_distribution import ForceLimits, distributed_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.wrench import gravity_wrench
from winchkit.schema.profiles.robot import PlatformSpec

_FEWEST = 4
"""A cubic spline with third derivatives continuous at the second and last but one pose (not-a-knot)
has four coefficients at least."""


@dataclass(frozen=True)
class PlatformMotion:
    """Poses of the platform with their first and second derivatives by time, k of them."""

    pose: Pose
    velocity: Array
    """Of the origin, m/s, then angular, rad/s, base axes, (k, 6)."""
    acceleration: Array
    """Of the origin, m/s², then angular, rad/s², base axes, (k, 6)."""


@dataclass(frozen=True)
class InverseDynamics:
    """Forces and torques that a motion needs; NaN at samples without feasible cable forces."""

    wrench: Array
    """Weight and inertial forces on the platform, (k, 6), N and N m."""
    force: Array
    """Cable forces at the platform, (k, n), N."""
    motor_angle: Array
    """With the elongation under these forces, where the profile has it, (k, n), rad."""
    motor_torque: Array
    """With friction, inertia and all other effects of each winch, (k, n), N m."""


def motion_of(time: Array, pose: Pose) -> PlatformMotion:
    """Derivatives of sampled poses, by interpolating cubic splines.

    Parameters
    ----------
    time : (k,) array
        Increasing, s.
    pose : Pose
        k poses.

    Returns
    -------
    PlatformMotion
        Splines of noisy poses amplify the noise: smooth measured poses before.

    Raises
    ------
    UsageError
        For fewer than four poses, or times that do not increase.
    """
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    if len(time) < _FEWEST or len(pose.position) != len(time) or not np.all(np.diff(time) > 0):
        raise UsageError(
            f"{len(pose.position)} poses at {len(time)} times; at least {_FEWEST} poses at "
            "increasing times are needed"
        )
    place = CubicSpline(time, pose.position)
    turned = RotationSpline(time, Rotation.from_matrix(pose.rotation))
    # Rates of the spline are in platform axes; d(R ω)/dt = R dω/dt.
    rates = [np.einsum("kij,kj->ki", pose.rotation, turned(time, order)) for order in (1, 2)]
    return PlatformMotion(
        pose, np.hstack([place(time, 1), rates[0]]), np.hstack([place(time, 2), rates[1]])
    )


def mass_matrix(platform: PlatformSpec, rotation: Array) -> Array:
    """Mass matrix M of the platform about its origin, base axes, (k, 6, 6)."""
    lever = skew(rotation @ np.asarray(platform.center_of_mass, dtype=float))
    mass = platform.mass
    out = np.zeros((len(rotation), 6, 6))
    out[:, :3, :3] = mass * np.eye(3)
    out[:, :3, 3:], out[:, 3:, :3] = -mass * lever, mass * lever
    out[:, 3:, 3:] = _inertia(platform, rotation) - mass * lever @ lever
    return out


def dynamic_wrench(platform: PlatformSpec, motion: PlatformMotion) -> Array:
    """Wrench of weight and inertial forces about the platform's origin, (k, 6), N and N m.

    Parameters
    ----------
    platform : PlatformSpec
        Mass, centre of mass and moment of inertia.
    motion : PlatformMotion
        k samples.

    Returns
    -------
    (k, 6) array
        w of Aᵀ f + w = 0; at rest the weight.
    """
    rotation = motion.pose.rotation
    inertial = (mass_matrix(platform, rotation) @ motion.acceleration[..., None])[..., 0]
    return (
        np.asarray(
            gravity_wrench(platform, rotation)
            - inertial
            - _velocity_wrench(platform, rotation, motion.velocity)
        )
        * platform.free
    )


def accelerations(platform: PlatformSpec, rotation: Array, velocity: Array, wrench: Array) -> Array:
    """Forward dynamics: acceleration (k, 6) of the platform with a velocity (k, 6), in base axes,
    under a wrench Aᵀ f (k, 6) beside its weight. Raises UsageError without a mass or a moment of
    inertia."""
    if platform.mass <= 0 or platform.inertia is None or min(platform.inertia) <= 0:
        raise UsageError(
            "the forward dynamics needs [platform] mass and inertia, each above 0; write the three "
            "principal moments about the centre of mass"
        )
    load = wrench + gravity_wrench(platform, rotation)
    load = load - _velocity_wrench(platform, rotation, velocity)
    # In coordinates that guides hold: acceleration 0.
    free = np.array(platform.free)
    mass = mass_matrix(platform, rotation) * np.outer(free, free) + np.diag(1 - free)
    return np.asarray(np.linalg.solve(mass, (load * free)[..., None])[..., 0])


def inverse_dynamics(
    robot: Robot, time: Array, motion: PlatformMotion, limits: ForceLimits
) -> InverseDynamics:
    """Cable forces, motor angles and motor torques of a motion.

    Parameters
    ----------
    robot : Robot
        With the effects of its winches: friction, inertia, elongation.
    time : (k,) array
        s.
    motion : PlatformMotion
        k samples.
    limits : ForceLimits
        Of the force distribution, which is nearest to their middle.

    Returns
    -------
    InverseDynamics
        NaN where no forces within the limits balance the wrench.
    """
    wrench, structure = dynamic_wrench(robot.platform, motion), robot.structure(motion.pose)
    force = distributed_forces(structure, wrench, limits)
    known = np.all(np.isfinite(force), axis=1)
    pulled = np.where(known[:, None], force, 0.0)
    angle = robot.motor_angles(motion.pose, tension=pulled)
    torque = np.empty_like(angle)
    for i, line in enumerate(robot.lines):
        signals = Signals(time=time, motor_angle=angle[:, i], load=pulled[:, i])
        torque[:, i] = line.predict(line.motion(signals))["motor_torque"]
    angle[~known], torque[~known] = np.nan, np.nan
    return InverseDynamics(wrench, force, angle, torque)


def _inertia(platform: PlatformSpec, rotation: Array) -> Array:
    """Moment of inertia about the centre of mass, base axes, (k, 3, 3)."""
    moments = np.zeros(3) if platform.inertia is None else np.array(platform.inertia)
    return np.asarray((rotation * moments) @ np.swapaxes(rotation, 1, 2))


def _velocity_wrench(platform: PlatformSpec, rotation: Array, velocity: Array) -> Array:
    """Centripetal and gyroscopic terms h, (k, 6)."""
    spin = velocity[:, 3:]
    lever = rotation @ np.asarray(platform.center_of_mass, dtype=float)
    force = platform.mass * cross(spin, cross(spin, lever))
    momentum = (_inertia(platform, rotation) @ spin[..., None])[..., 0]
    return np.hstack([force, cross(lever, force) + cross(spin, momentum)])
