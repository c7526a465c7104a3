"""A platform that hangs on four cables: its rest poses, what instruments show, and a log of it.

Rest is the lowest potential energy with given cable lengths (SLSQP); cable forces follow from
virtual work. A log has rows in time: holds with the noise of every instrument, and ramps between
them. Nothing is shared with winchkit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq, minimize

from robot_poses.truth import GRAVITY, HOME, Truth, Vector, turn
from winchkit.arrays import Array

LINES = 4
_STEP = 1e-6


def hanging_truth() -> Truth:
    """The upper cables of the CABTIVE robot, led to points above its platform."""
    whole = Truth()
    anchor = tuple((x, y, 0.0635 + 0.002 * i) for i, (x, y, _) in enumerate(whole.anchor[:LINES]))
    return replace(whole, exit=whole.exit[:LINES], anchor=anchor)


@dataclass(frozen=True)
class Hanging:
    """A robot of four cables, and what is true of its instruments."""

    truth: Truth = field(default_factory=hanging_truth)
    mass: float = 3.0
    centre: Vector = (0.0, 0.0, -0.05)
    ratio: tuple[float, ...] = (1.0,) * LINES
    """Motor angle per motor angle of the profile's gearbox."""
    gain: tuple[float, ...] = (1.0,) * LINES
    """Of the load cells."""
    counter: tuple[float, ...] = (1.0,) * LINES
    """Reading of the length counters per cable length."""
    tilt: Vector = (0.0, 0.0, 0.0)
    """Mounting of the IMU on the platform: roll, pitch, yaw, rad."""
    encoder: float = 1e-4
    swivel: float = 1e-3
    cell: float = 0.05
    imu: float = 5e-4
    length: float = 1e-4

    def lengths(self, pose: Array) -> Array:
        """Cable lengths of x, y, z, roll, pitch, yaw."""
        x, y, z, *angles = pose.tolist()
        rotation = turn(*angles)
        return np.array([self.truth.length(i, (x, y, z), rotation) for i in range(LINES)])

    def height(self, pose: Array) -> float:
        """Of the centre of mass, m."""
        return float(pose[2] + (np.array(turn(*pose[3:].tolist())) @ np.array(self.centre))[2])

    def rest(self, given: Array, start: Array) -> Array:
        """Pose of the lowest centre of mass with cables of these lengths."""
        found = minimize(
            self.height,
            start,
            method="SLSQP",
            constraints={"type": "eq", "fun": lambda pose: self.lengths(pose) - given},
            options={"ftol": 1e-14, "maxiter": 500},
        )
        assert np.max(np.abs(self.lengths(found.x) - given)) < 1e-9
        return np.asarray(found.x)

    def home(self) -> Array:
        """Rest pose with the cables of the upright platform at the home position."""
        return _home(self.truth, self.centre).copy()

    def poses(self, count: int, seed: int) -> Array:
        """Rest poses about home, (count, 6)."""
        rng, home, out = np.random.default_rng(seed), self.home(), []
        for _ in range(count):
            about = home + np.concatenate([rng.uniform(-0.12, 0.12, 3), np.zeros(3)])
            given = self.lengths(about) + rng.uniform(-0.012, 0.012, LINES)
            out.append(self.rest(given, about))
        return np.array(out)

    def forces(self, pose: Array) -> Array:
        """Cable forces: a cable that gets longer pulls back with its force (virtual work)."""
        ends = [(pose + step, pose - step) for step in np.eye(6) * _STEP]
        slope = np.array([(self.lengths(a) - self.lengths(b)) / (2 * _STEP) for a, b in ends])
        rise = np.array([(self.height(a) - self.height(b)) / (2 * _STEP) for a, b in ends])
        found, _, _, _ = np.linalg.lstsq(slope, -self.mass * GRAVITY * rise, rcond=None)
        assert np.max(np.abs(slope @ found + self.mass * GRAVITY * rise)) < 1e-4
        return np.asarray(found)

    def motor_angles(self, pose: Array) -> Array:
        """Since home, with the gearboxes as they are."""
        shorter = self.lengths(self.home()) - self.lengths(pose)
        own, begin = self.truth, 2 * math.pi * self.truth.turns
        return np.array(
            [
                self.ratio[i]
                * brentq(
                    lambda a, i=i: own.wound(i, begin + a) - own.wound(i, begin) - shorter[i],
                    -40,
                    40,
                )
                for i in range(LINES)
            ]
        )

    def swivels(self, pose: Array) -> Array:
        """Angles of the swivel pulleys with zeros of their own."""
        x, y, z, *angles = pose.tolist()
        out = []
        for i in range(LINES):
            arm = np.array(turn(*angles)) @ np.array(self.truth.anchor[i])
            seen = np.array([x, y, z]) + arm - np.array(self.truth.exit[i])
            out.append(math.atan2(seen[1], seen[0]) + 0.3 * i - 1)
        return np.array(out)

    def tilts(self, pose: Array) -> Array:
        """Roll and pitch of the IMU as it is mounted."""
        shown = np.array(turn(*pose[3:].tolist())) @ np.array(turn(*self.tilt))
        return np.array([math.atan2(shown[2, 1], shown[2, 2]), -math.asin(shown[2, 0])])

    def readings(self, pose: Array) -> dict[str, Array]:
        """What every instrument shows at a pose, without noise."""
        return {
            "motor_angle": self.motor_angles(pose),
            "swivel": self.swivels(pose),
            "tension": self.forces(pose) * np.array(self.gain),
            "tilt": self.tilts(pose),
            "cable_length": self.lengths(pose) * np.array(self.counter) + 0.01 * np.arange(LINES),
            "pose": pose,
        }

    def log(
        self,
        poses: Array,
        seed: int,
        *,
        hold: tuple[int, int] = (20, 60),
        ramp: int = 15,
        kinds: Sequence[str] = ("swivel", "tension", "tilt"),
    ) -> str:
        """CSV of a log: at each pose a hold, and a ramp of every reading to the next one."""
        rng = np.random.default_rng(seed)
        shown = [self.readings(pose) for pose in poses]
        columns = [f"{i + 1}.motor_angle [rad]" for i in range(LINES)]
        units = {"swivel": "rad", "tension": "N", "cable_length": "m"}
        columns += [
            f"{i + 1}.{kind} [{units[kind]}]" for kind in kinds if kind in units
            for i in range(LINES)
        ]  # fmt: skip
        columns += ["platform_roll [rad]", "platform_pitch [rad]"] if "tilt" in kinds else []
        columns += [f"platform_{axis} [m]" for axis in "xyz"] if "position" in kinds else []
        rows = []
        for number, here in enumerate(shown):
            count = int(rng.integers(*hold))
            rows += [self._row(here, kinds, rng) for _ in range(count)]
            if number + 1 < len(shown):
                there = shown[number + 1]
                for share in 0.5 - 0.5 * np.cos(np.pi * (np.arange(ramp) + 0.5) / ramp):
                    between = {k: (1 - share) * v + share * there[k] for k, v in here.items()}
                    rows.append(self._row(between, kinds, rng))
        lines = ["time [s]," + ",".join(columns)]
        for n, row in enumerate(rows):
            lines.append(f"{n * 0.02:.2f}," + ",".join(f"{v:.9g}" for v in row))
        return "\n".join(lines) + "\n"

    def _row(self, here: dict[str, Array], kinds: Sequence[str], rng: np.random.Generator) -> Array:
        noise = {"swivel": self.swivel, "tension": self.cell, "cable_length": self.length}
        parts = [here["motor_angle"] + rng.normal(0, self.encoder, LINES)]
        parts += [here[k] + rng.normal(0, noise[k], LINES) for k in kinds if k in noise]
        if "tilt" in kinds:
            parts.append(here["tilt"] + rng.normal(0, self.imu, 2))
        if "position" in kinds:
            parts.append(here["pose"][:3] + rng.normal(0, 2e-5, 3))
        return np.concatenate(parts)

    def profile_text(self, *, offset: float = 0.0, seed: int = 0) -> str:
        """The robot's profile, its points off by normal errors of ``offset``, m."""
        rng, own, home = np.random.default_rng(seed), self.truth, self.home()
        turned = ", ".join(f'"{float(angle)!r} rad"' for angle in home[3:])
        out = [
            f'schema = 1\nkind = "robot"\nname = "hanging"\n\n[platform]\nmass = "{self.mass} kg"\n'
            f"center_of_mass = {_lengths(self.centre)}\n\n[home]\n"
            f"position = {_lengths(home[:3])}\n"
            f"rotation = [{turned}]\n"
        ]
        for i in range(LINES):
            exit_point, anchor = (
                np.array(point) + rng.normal(0, offset, 3) if offset else np.array(point)
                for point in (own.exit[i], own.anchor[i])
            )
            out.append(
                f'\n[[line]]\nname = "{i + 1}"\nexit_point = {_lengths(exit_point)}\n'
                f"anchor_point = {_lengths(anchor)}\n"
                f'swivel_radius = "{own.swivel[i]!r} m"\nswivel_axis = [0, 0, 1]\n'
                f'[line.winch.drum]\nkind = "spiral"\nwinding_radius = "{own.winding[i]!r} m"\n'
                f'layer_growth = "{own.growth!r} m"\n[line.winch.gearbox]\nratio = 1.0\n'
                f"[line.winch.reference]\nwound_turns = {own.turns}\n"
            )
        return "".join(out)


@lru_cache(maxsize=16)
def _home(truth: Truth, centre: Vector) -> Array:
    upright, robot = np.array([*HOME, 0.0, 0.0, 0.0]), Hanging(truth, centre=centre)
    return robot.rest(robot.lengths(upright), upright)


def _lengths(point: Sequence[float] | Array) -> str:
    return "[" + ", ".join(f'"{float(x)!r} m"' for x in point) + "]"
