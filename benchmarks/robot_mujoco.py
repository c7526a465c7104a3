"""Dynamics of a platform on elastic cables: winchkit's two implementations against MuJoCo.

    python benchmarks/robot_mujoco.py --trajectories 10 --seed 1 --json

Each trajectory is a random sum of sines of the unstrained cable lengths of one robot (cabtive with
swivel pulleys, winding-device-8 with fixed exit points, by turns): lengths of a motion of the
platform, and beside them a sum of each cable of its own. The simulated platform, the model's
integration and MuJoCo begin at rest in the same pose. In MuJoCo a cable is a spatial tendon with
spring and damper, a swivel pulley a cylinder around which the tendon wraps, turned towards the
anchor point every 2 ms. Errors are largest differences, as shares of the trajectory's largest
cable force, and of its largest displacement and rotation. Needs mujoco (``requirements.txt``).
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from winchkit import find
from winchkit.arrays import Array
from winchkit.robot.dynamics.integration import ElasticCables, integrate
from winchkit.robot.geometry.kinematics import Geometry, Pose, geometry_of, home_of, lengths
from winchkit.robot.sim.platform import CablePlatform, Pulleys, RigidBody
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.schema.read import read_robot

DURATION = 4.0
CYCLE = 2e-3
"""Of the reports and of the simulated winches, s."""
STEP = 1e-4
"""Of MuJoCo's Runge-Kutta method of order 4, s."""
BEHIND = 0.02
"""Cable in front of a swivel pulley, along the swivel axis, m."""
LIMIT = 0.01
"""Largest error, as a share of the peak."""


@dataclass(frozen=True)
class Case:
    """A robot: values beside its profile, and the size of its motion."""

    profile: str
    inertia: tuple[float, float, float]
    center_of_mass: tuple[float, float, float]
    axial_stiffness: float
    pretension: float
    damping_time: float
    dead_length: float
    reach: float
    """Standard deviation of the motion, m."""
    turn: float
    """rad."""


CASES = (
    Case("cabtive", (0.012, 0.013, 0.016), (0.004, -0.003, 0.01), 2e4, 60.0, 1e-3, 0.3, 0.04, 0.06),
    Case(
        "winding-device-8", (5.0, 5.5, 6.0), (0.01, 0.02, -0.03), 2e5, 600.0, 2e-3, 0.4, 0.06, 0.02
    ),
)


@dataclass(frozen=True)
class Robot:
    """What all implementations get."""

    case: Case
    geometry: Geometry
    platform: PlatformSpec
    home: Pose


@dataclass(frozen=True)
class Motion:
    """Result of an implementation at k instants."""

    position: Array
    """(k, 3), m."""
    rotation: Array
    """(k, 3, 3)."""
    force: Array
    """(k, n), N."""


def robot_of(case: Case) -> Robot:
    """Robot of a shipped profile with the case's values."""
    profile = read_robot(find("profiles", case.profile))
    platform = replace(profile.platform, inertia=case.inertia, center_of_mass=case.center_of_mass)
    return Robot(case, geometry_of(profile), platform, home_of(profile))


def sines(random: np.random.Generator, time: Array, count: int, low: float, high: float) -> Array:
    """Random sums of three sines that begin smoothly, standard deviation about 1, (k, count)."""
    frequency = random.uniform(low, high, (3, count))
    phase = random.uniform(0.0, 2 * np.pi, (3, count))
    waves = np.sin(2 * np.pi * frequency * time[:, None, None] + phase).sum(axis=1)
    begun = np.minimum(time / 0.5, 1.0)
    return np.asarray(
        waves * np.sqrt(2 / 3) * (begun**3 * (10 - 15 * begun + 6 * begun**2))[:, None]
    )


def unstrained_lengths(
    robot: Robot, force: Array, random: np.random.Generator, time: Array
) -> CubicSpline:
    """Lengths without force of a random trajectory, by time, m."""
    case, geometry, home = robot.case, robot.geometry, robot.home
    waves = sines(random, time, 6, 0.1, 0.5)
    turned = Rotation.from_rotvec(case.turn * waves[:, 3:]) * Rotation.from_matrix(home.rotation[0])
    there = lengths(geometry, home.position + case.reach * waves[:, :3], turned.as_matrix())
    strained = there + case.dead_length
    own = 0.04 * case.pretension * strained[0] / case.axial_stiffness
    out = strained / (1 + force / case.axial_stiffness) - case.dead_length
    return CubicSpline(time, out + own * sines(random, time, there.shape[1], 0.5, 6.0))


def scene(robot: Robot) -> str:
    """MJCF of the robot: a free body, tendons, and where there are swivel pulleys, cylinders."""

    def row(values: Any) -> str:
        return " ".join(f"{value:.17g}" for value in np.ravel(values))

    geometry, platform = robot.geometry, robot.platform
    pose = Rotation.from_matrix(robot.home.rotation[0]).as_quat(scalar_first=True)
    fixed, moving, tendons, motors = [], [], [], []
    for i, (end, axis, radius) in enumerate(
        zip(geometry.exit_point, geometry.swivel_axis, geometry.swivel_radius, strict=True)
    ):
        wrapped = ""
        if radius > 0:
            fixed.append(
                f'<body name="pulley{i}" mocap="true" pos="{row(end)}">'
                f'<geom name="p{i}" type="cylinder" size="{radius:.17g} 0.002"'
                f' pos="{radius:.17g} 0 0" zaxis="0 1 0" contype="0" conaffinity="0"/>'
                f'<site name="s{i}" pos="{row([1.2 * radius, 0.0, 2.0 * radius])}"/></body>'
            )
            wrapped = f'<geom geom="p{i}" sidesite="s{i}"/>'
        fixed.append(f'<site name="e{i}" pos="{row(end - BEHIND * (radius > 0) * axis)}"/>')
        moving.append(f'<site name="a{i}" pos="{row(geometry.anchor_point[i])}"/>')
        # The lengths and stiffnesses of every step replace these.
        tendons.append(
            f'<spatial name="t{i}" stiffness="1" damping="1" springlength="0 1">'
            f'<site site="e{i}"/>{wrapped}<site site="a{i}"/></spatial>'
        )
        motors.append(f'<motor tendon="t{i}"/>')
    return (
        f'<mujoco><option timestep="{STEP}" integrator="RK4" gravity="0 0 -9.80665"/>'
        f"<worldbody>{''.join(fixed)}"
        f'<body name="platform" pos="{row(robot.home.position)}" quat="{row(pose)}"><freejoint/>'
        f'<inertial pos="{row(platform.center_of_mass)}" mass="{platform.mass:.17g}"'
        f' diaginertia="{row(platform.inertia)}"/>{"".join(moving)}</body></worldbody>'
        f"<tendon>{''.join(tendons)}</tendon><actuator>{''.join(motors)}</actuator></mujoco>"
    )


class Oracle:
    """The robot in MuJoCo."""

    def __init__(self, robot: Robot) -> None:
        import mujoco

        self._step, self._forward = mujoco.mj_step, mujoco.mj_forward
        self.model = mujoco.MjModel.from_xml_string(scene(robot))
        self.data = mujoco.MjData(self.model)
        self.case = robot.case
        self.before = np.where(robot.geometry.swivel_radius > 0, BEHIND, 0.0)
        self.body = self.model.body("platform").id
        self.pulleys = np.flatnonzero(self.before > 0)
        self.axes = robot.geometry.swivel_axis[self.pulleys]
        self._forward(self.model, self.data)
        self.swivel()

    def swivel(self) -> None:
        """Turn the pulleys towards the anchor points; changes no length to first order."""
        if len(self.pulleys):
            data, axis = self.data, self.axes
            anchor = np.array([data.site(f"a{i}").xpos for i in self.pulleys])
            seen = anchor - data.mocap_pos
            towards = seen - np.sum(seen * axis, axis=1, keepdims=True) * axis
            towards /= np.linalg.norm(towards, axis=1, keepdims=True)
            frame = np.stack([towards, np.cross(axis, towards), axis], axis=-1)
            data.mocap_quat[:] = Rotation.from_matrix(frame).as_quat(scalar_first=True)
        self._forward(self.model, self.data)

    def begin(self) -> Array:
        """Cable forces at rest nearest to the pretension, (n,), N."""
        data, model = self.data, self.model
        address = int(model.jnt_dofadr[model.body_jntadr[self.body]])
        there = slice(address, address + 6)
        pull = np.empty((6, model.ntendon))
        for i in range(model.ntendon):
            data.ctrl[:] = 0.0
            data.ctrl[i] = -1.0
            self._forward(model, data)
            pull[:, i] = data.qfrc_actuator[there]
        wanted = np.full(model.ntendon, self.case.pretension)
        short = data.qfrc_bias[there] - pull @ wanted
        return np.asarray(wanted + np.linalg.lstsq(pull, short, rcond=None)[0])

    def lengths(self) -> Array:
        """(n,), m."""
        return np.asarray(self.data.ten_length - self.before)

    def place(self, free: Array, rate: Array) -> None:
        """Set springs and dampers for unstrained lengths and their rates."""
        case, model = self.case, self.model
        taut = self.forces(free, rate) > 0
        stiffness = np.where(taut, case.axial_stiffness / (free + case.dead_length), 0.0)
        damping = case.damping_time * stiffness
        model.tendon_stiffness[:] = stiffness
        model.tendon_damping[:] = damping
        model.tendon_lengthspring[:, 1] = free + self.before
        self.data.ctrl[:] = damping * rate

    def forces(self, free: Array, rate: Array) -> Array:
        """Cable forces, (n,), N."""
        case, stretch = self.case, self.lengths() - free
        stiffness = case.axial_stiffness / (free + case.dead_length)
        pull = stiffness * (stretch + case.damping_time * (self.data.ten_velocity - rate))
        return np.where(stretch > 0, np.maximum(pull, 0.0), 0.0)

    def run(self, unstrained: CubicSpline, time: Array) -> Motion:
        """Integrate; lengths of a step are those in its middle."""
        speed = unstrained.derivative()
        middle = np.arange(0.0, time[-1] - STEP / 2, STEP) + STEP / 2
        free, rate = unstrained(middle), speed(middle)
        every = round(CYCLE / STEP)
        position, rotation, force = [], [], []
        for k, now in enumerate(time):
            if k:
                for j in range((k - 1) * every, k * every):
                    self.place(free[j], rate[j])
                    self._step(self.model, self.data)
                self._forward(self.model, self.data)
                self.swivel()
            position.append(self.data.xpos[self.body].copy())
            rotation.append(self.data.xmat[self.body].reshape(3, 3).copy())
            force.append(self.forces(unstrained(now), speed(now)))
        return Motion(np.array(position), np.array(rotation), np.array(force))


def simulated(robot: Robot, unstrained: CubicSpline, time: Array, start: Array) -> Motion:
    """The simulator's platform."""
    case, geometry, platform = robot.case, robot.geometry, robot.platform
    body = RigidBody(
        platform.mass,
        np.array(case.center_of_mass),
        np.diag(case.inertia),
        geometry.anchor_point,
    )
    pulleys = Pulleys(geometry.exit_point, geometry.swivel_axis, geometry.swivel_radius)
    moved = CablePlatform(
        body, pulleys, robot.home.position[0], robot.home.rotation[0], case.damping_time
    )
    moved.tension = start.copy()
    free = unstrained(time)
    position, rotation, force = [moved.position], [moved.rotation], [moved.tension]
    for k in range(1, len(time)):
        stiffness = case.axial_stiffness / (free[k] + case.dead_length)
        moved.advance(time[k], free[k - 1], free[k], stiffness)
        position.append(moved.position)
        rotation.append(moved.rotation)
        force.append(moved.tension)
    return Motion(np.array(position), np.array(rotation), np.array(force))


def modelled(robot: Robot, unstrained: CubicSpline, time: Array) -> Motion:
    """The model's integration."""
    case, count = robot.case, len(robot.geometry.exit_point)
    cables = ElasticCables(
        np.full(count, case.axial_stiffness), np.full(count, case.dead_length), case.damping_time
    )
    start = (robot.home, np.zeros(6))
    found = integrate(
        robot.geometry,
        robot.platform,
        cables,
        start,
        unstrained=unstrained,
        rate=unstrained.derivative(),
        time=time,
        tolerance=1e-6,
    )
    return Motion(found.pose.position, found.pose.rotation, found.force)


def errors(found: Motion, true: Motion) -> tuple[float, float]:
    """Largest errors of force and motion, as shares of their peaks."""

    def angle(a: Array, b: Array) -> float:
        turns = Rotation.from_matrix(np.swapaxes(a, -1, -2) @ b)
        return float(turns.magnitude().max())

    def distance(a: Array, b: Array) -> float:
        return float(np.linalg.norm(a - b, axis=1).max())

    force = float(np.abs(found.force - true.force).max() / true.force.max())
    moved = distance(found.position, true.position) / distance(true.position, true.position[:1])
    turned = angle(found.rotation, true.rotation) / angle(true.rotation, true.rotation[:1])
    return force, max(moved, turned)


def compared(case: Case, seed: list[int], duration: float = DURATION) -> dict[str, float | str]:
    """One trajectory: errors of both implementations, and MuJoCo's forces and displacement."""
    robot = robot_of(case)
    oracle = Oracle(robot)
    start = oracle.begin()
    time: Array = np.linspace(0.0, duration, round(duration / CYCLE) + 1)
    unstrained = unstrained_lengths(robot, start, np.random.default_rng(seed), time)
    true = oracle.run(unstrained, time)
    sim = errors(simulated(robot, unstrained, time, start), true)
    model = errors(modelled(robot, unstrained, time), true)
    return {
        "robot": case.profile,
        "sim_force_error": sim[0],
        "sim_motion_error": sim[1],
        "model_force_error": model[0],
        "model_motion_error": model[1],
        "least_force_N": float(true.force.min()),
        "largest_force_N": float(true.force.max()),
        "largest_displacement_m": float(
            np.linalg.norm(true.position - true.position[0], axis=1).max()
        ),
    }


FIGURES = ("sim_force_error", "sim_motion_error", "model_force_error", "model_motion_error")


def main() -> int:
    """Run it; exit code 1 where an error is above 1 %."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--trajectories", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    if asked.trajectories < 1:
        parser.error("--trajectories must be at least 1")
    rows = [compared(CASES[n % len(CASES)], [asked.seed, n]) for n in range(asked.trajectories)]
    worst = {name: max(float(row[name]) for row in rows) for name in FIGURES}
    result = {"schema": 1, "seed": asked.seed, **worst, "trajectories": rows}
    if asked.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        for row in rows:
            sys.stdout.write(
                "  ".join(f"{k} {v:.4g}" if k != "robot" else f"{v:16}" for k, v in row.items())
                + "\n"
            )
        for name, value in worst.items():
            sys.stdout.write(f"{name}: {value:.2%}\n")
    return int(max(worst.values()) > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
