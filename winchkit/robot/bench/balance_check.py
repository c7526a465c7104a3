"""Whether measured cable forces and the weight of a platform balance each other.

The structure matrix Aᵀ and readings f that differ from the planned forces f_p leave the wrench
r = Aᵀ (f − f_p) over. It is explained by errors of independent sources, r = B z with one column of
B for the standard deviation of each:

* readings: the class of a load cell, its zero, and the friction of pulleys that is not known;
* mass and centre of mass of the platform;
* exit and anchor points, and the cable lengths: home, winding radius, elongation that the profile
  does not describe. They act through the pose by the lengths, x, too: ∂x/∂L = J⁺ with J = −A;
* inertial forces of a platform that swings, in low-passed readings.

|z| is least for z = Bᵀ (B Bᵀ)⁻¹ r, with |z|² = rᵀ (B Bᵀ)⁻¹ r (Mahalanobis distance): the standard
deviations that all sources together need at least. A hanging platform rests where its weight
balances in the directions that no cable holds; the pose in these, and their wrenches, are
eliminated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.tension_control import HELD
from winchkit.effects.on_tension.pulley import PULLEY_DAHL
from winchkit.estimation.dahl import UNIFORM
from winchkit.estimation.groups import groups_of, sliding_share
from winchkit.robot.dynamics.dynamics import mass_matrix
from winchkit.robot.forces.balance import hanging_balance, wrench_scale
from winchkit.robot.geometry.kinematics import Pose, sensitivities
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.wrench import weight_by_payload
from winchkit.schema.profiles.robot import CENTRE_STD, PRIORS, PriorName, PriorSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.robot_bench import RobotWiring
from winchkit.units import parse

MOST = 5.7
"""Standard deviations of all sources together beyond which readings and weight contradict each
other: eight cells that are all off by two reach √8 · 2 = 5.66, random errors of six equations reach
it once in 60,000 robots (χ²)."""
_ZERO = 1e-3
"""Standard deviation of a cell's zero, as a share of the upper limit of the forces: the class of
usual load cells, whose range is at least that."""
_MASS = 0.03
"""Standard deviation of the platform's mass, as a share: weighed, or by a drawing, without hoses
and screws (rule of thumb)."""
_DESCRIBED = 0.2
"""Standard deviation of an elongation that the profile describes, as a share: EA of a data sheet
against a cable in use (rule of thumb)."""
_SWINGING = 0.1
"""Share of the accelerations of [robot] as the standard deviation of what is left of a swinging in
low-passed forces: at most 0.6 of them at 2 Hz, from the first cycle on (5.7 times this)."""
_BARE = math.sqrt(2)
"""2 sin(wrap/2) of the guide through which a cable without declared pulleys leaves its winch."""
_RANK = 1e-6
"""Share of the largest singular value below which a structure matrix does not carry a wrench:
numerical, far below that of a robot that can be controlled."""


@dataclass(frozen=True)
class BalanceCheck:
    """Readings of n cables against the wrench of a platform at k places of a motion, or at one."""

    names: tuple[str, ...]
    """Of the cables."""
    structure: Array
    """(k, 6, n)."""
    load: Array
    """Wrench that cables carry for one more kilogram at the centre of mass, (q, 6), N and N m."""
    whiten: Array
    """From a wrench to standard deviations, (q, m, 6), at q of the places, equally spaced."""

    def size(self, place: int, deviation: Array) -> float:
        """Standard deviations that explain readings less planned forces (n,), N."""
        left = self.structure[place] @ deviation
        return float(np.linalg.norm(self.whiten[self._near(place)] @ left))

    def words(self, place: int, deviation: Array) -> tuple[str, str]:
        """Cable whose reading explains most, and all that is to be said."""
        near = self._near(place)
        whiten, left = self.whiten[near], self.structure[place] @ deviation
        size = float(np.linalg.norm(whiten @ left))
        one = np.concatenate([self.structure[place], self.load[near][:, None]], axis=1)
        single, shown = whiten @ one, whiten @ left
        scale = np.sum(single**2, axis=0)
        scale = np.where(scale > 0, scale, np.inf)
        amount = shown @ single / scale
        rest = np.sqrt(np.maximum(size**2 - amount**2 * scale, 0.0))
        causes = [f"a reading of cable {name} that is wrong by {{:+.0f}} N" for name in self.names]
        causes.append("a load that is {:+.1f} kg heavier")
        found = [
            causes[i].format(amount[i]) for i in np.argsort(rest)[:2].tolist() if rest[i] <= MOST
        ]
        cause = f"; {' or '.join(found)} would explain it" if found else ""
        force, moment = (float(np.linalg.norm(part)) for part in (left[:3], left[3:]))
        return self.names[int(np.argmin(rest[:-1]))], (
            f"the load cells and the weight contradict each other by {force:.0f} N and "
            f"{moment:.1f} N m, {size:.1f} standard deviations of cells, friction, mass and pose "
            f"(limit {MOST:g}){cause}"
        )

    def _near(self, place: int) -> int:
        return place * len(self.whiten) // len(self.structure)


@dataclass(frozen=True)
class Sources:
    """Standard deviations of what a balance of n cables depends on, SI."""

    reading: Array
    """Of the readings by cells and pulleys, as a share, (n,)."""
    exit_point: Array
    """(n, 3), m."""
    anchor_point: Array
    """(n, 3), m."""
    home: Array
    """Of the lengths at home, (n,), m."""
    winding: Array
    """Of the wound lengths, as a share, (n,)."""
    compliance: Array
    """Elongation that is not known per force, (n,), m/N."""
    payload: Array
    """Of mass and centre of mass, (4,), kg and m."""
    inertial: Array
    """Acceleration of the swinging, (6,), m/s² and rad/s²."""
    zero: float
    """Of the readings, N."""

    def at(self, robot: Robot, pose: Pose, force: Array) -> Array:
        """Matrices from a wrench to standard deviations, (p, m, 6), at poses with forces (p, n)."""
        geometry, scale = robot.geometry, wrench_scale(robot.geometry)
        found = hanging_balance(geometry, pose, force, robot.platform)
        by, count = found.by_robot, min(len(robot.names), geometry.degrees)
        # In coordinates whose rotations are lengths, as all rows are forces.
        pull, stiff = by["tension"], found.by_pose * scale
        by_length = -stiff @ np.swapaxes(np.linalg.pinv(pull, rcond=_RANK), 1, 2)
        lengths = sensitivities(geometry, pose.position, pose.rotation)
        wound = (robot.lengths(pose) - robot.home_length) * self.winding
        length = np.sqrt(self.home**2 + wound**2 + (self.compliance * force) ** 2)
        reading = np.hypot(self.reading * force, self.zero)
        columns = [pull * reading[:, None], by_length * length[:, None]]
        for name, own in (("exit_point", self.exit_point), ("anchor_point", self.anchor_point)):
            by_pose = by_length[..., None] * getattr(lengths, name)[:, None]
            columns.append((by_pose.reshape(by[name].shape) - by[name]) * own.ravel())
        columns.append(by["payload"] * self.payload)
        columns.append((scale * geometry.free)[:, None] * self._inertial(robot, pose))
        sources = np.concatenate(columns, axis=2)
        left = np.linalg.svd(pull)[0]
        held, across = np.swapaxes(left[:, :, :count], 1, 2), left[:, :, count:]
        if count < geometry.degrees:
            free_stiff = np.swapaxes(across, 1, 2) @ stiff @ across
            rest = np.linalg.pinv(free_stiff, rcond=_RANK) @ np.swapaxes(across, 1, 2) @ sources
            sources = sources - stiff @ across @ rest
        seen = held @ sources
        root = np.linalg.cholesky(seen @ np.swapaxes(seen, 1, 2))
        return np.asarray(np.linalg.solve(root, held * scale))

    def _inertial(self, robot: Robot, pose: Pose) -> Array:
        """Inertial wrenches of the swinging, (p, 6, 6); a platform without a moment of inertia has
        its mass at its anchor points."""
        mass, lever = robot.platform.mass, 1.0 / wrench_scale(robot.geometry)[3]
        there = 2 / 3 * mass * lever**2
        platform = replace(robot.platform, inertia=robot.platform.inertia or (there, there, there))
        return mass_matrix(platform, pose.rotation) * self.inertial


def sources_of(robot: Robot, wiring: RobotWiring, compliance: Array, *, described: bool) -> Sources:
    """The sources of a robot: by its calibration or priors, its effects, and rules of thumb;
    ``compliance`` (n,), m/N, is ``described`` where the profile has it."""
    mass = _stated(robot, "payload-mass.mass", "mass", _MASS * robot.platform.mass)
    centre = [_stated(robot, f"payload-centre.{k}", "length", CENTRE_STD) for k in "xyz"]
    radii = np.array([winch.drum.winding_radius for winch in robot.winches])
    return Sources(
        np.array([math.hypot(HELD, _friction(winch)) for winch in robot.winches]),
        _geometry(robot, "exit_point", "xyz"),
        _geometry(robot, "anchor_point", "xyz"),
        _geometry(robot, "home_length"),
        _geometry(robot, "winding_radius") / radii,
        compliance * (_DESCRIBED if described else 1.0),
        np.array([mass, *centre]),
        _SWINGING * np.repeat([wiring.acceleration, wiring.rotation_acceleration], 3),
        _ZERO * wiring.tension[1],
    )


def check_of(
    robot: Robot, sources: Sources, pose: Pose, force: Array, *, places: int = 1
) -> BalanceCheck:
    """The check at k poses with planned forces (k, n), its scales at ``places`` of them."""
    chosen = np.unique(np.arange(places) * len(force) // places).tolist()
    load = -weight_by_payload(robot.platform, pose[chosen].rotation)[..., 0]
    whiten = sources.at(robot, pose[chosen], force[chosen])
    return BalanceCheck(robot.names, robot.structure(pose), load, whiten)


def declared_friction(winch: WinchProfile) -> float:
    """Standard deviation of a cell's reading by its pulleys, as a share; 0 where none is known."""
    known = sum(group.sliding_std for group in groups_of(winch))
    return known if math.isfinite(known) else 0.0


def _friction(winch: WinchProfile) -> float:
    """The same; where none is known, friction anywhere within the usual limit."""
    declared = declared_friction(winch)
    if declared > 0:
        return declared
    usual = PULLEY_DAHL.parameter("friction").typical
    return UNIFORM * usual * max(sliding_share([pulley.wrap for pulley in winch.pulley]), _BARE)


def _geometry(robot: Robot, name: PriorName, axes: str = "") -> Array:
    """Standard deviations by the calibration, else of the priors, (n,) or (n, 3)."""
    usual = robot.profile.prior.get(name, PriorSpec(PRIORS[name])).std
    places = [[f".{axis}" for axis in axes] or [""]] * len(robot.names)
    found = [
        [_stated(robot, f"{line}.{name}{place}", "length", usual) for place in own]
        for line, own in zip(robot.names, places, strict=True)
    ]
    return np.array(found) if axes else np.array(found)[:, 0]


def _stated(robot: Robot, name: str, dimension: str, usual: float) -> float:
    """Standard deviation that a calibration found for a number, else the usual one."""
    fitted = robot.profile.fitted
    stated = fitted.std.get(name) if fitted is not None else None
    return usual if stated is None else parse(stated, dimension)
