"""What a pose of a robot must satisfy, with every first derivative: rows of a least-squares fit.

A pose with n lines has n equations "length by geometry = rope by the drum", and one for whatever
else was measured there: three of its position, three of its rotation, a swivel angle and a rope
length per line, and six of the balance of measured rope forces where the payload is in doubt. The
pose itself is always unknown.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.calibration.robot.cable_forces import RopeForces, balance
from winchkit.calibration.robot.elongation import strain_of
from winchkit.calibration.robot.parameters import Parameters
from winchkit.model.drum import Archimedean, Grooved, Spiral, Squared, drum_of
from winchkit.model.robot import (
    Geometry,
    Pose,
    Robot,
    Sensitivities,
    angles_of,
    lengths,
    rotation_of,
    sensitivities,
    swivel_angle,
    swivel_sensitivities,
)
from winchkit.model.robot.rotation import angle_rates, rotation_vector
from winchkit.runs.poses import Measured
from winchkit.schema.profiles.winch import WinchProfile

__all__ = [
    "Equations",
    "Rows",
    "State",
    "Winding",
    "winding_of",
]

_TURN = 2 * np.pi


@dataclass(frozen=True)
class Winding:
    """ΔW = √(r² + lead²) Δφ + g gain + rest, all (p, n) but the lead, which is (n,)."""

    turned: Array
    """Drum angle since home, rad."""
    gain: Array
    """ΔW by the layer growth; zero where a drum has none."""
    rest: Array
    """What neither radius nor growth changes, m."""
    lead: Array
    """Groove pitch over a turn, m/rad."""

    def wound(self, radius: Array, growth: float) -> Array:
        """Rope wound in since home, (p, n), m."""
        return np.hypot(radius, self.lead) * self.turned + growth * self.gain + self.rest

    def by_radius(self, radius: Array) -> Array:
        """Its derivative by the lines' winding radii, (p, n)."""
        return radius / np.hypot(radius, self.lead) * self.turned


def winding_of(winches: Sequence[WinchProfile], motor_angle: Array) -> Winding:
    """Drum angles and what winds by them, from motor angles (p, n), rad."""
    turned, gain, rest = (np.zeros_like(motor_angle) for _ in range(3))
    lead = np.zeros(len(winches))
    for i, winch in enumerate(winches):
        ratio = winch.gearbox.direction * winch.gearbox.ratio
        home = np.asarray(_TURN * winch.reference.wound_turns)
        turned[:, i] = (motor_angle[:, i] - winch.reference.motor_angle) / ratio
        angle = home + turned[:, i]
        match drum_of(winch):
            case Spiral():
                unit: Spiral | Archimedean = Spiral(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Archimedean():
                unit = Archimedean(0.0, 1.0)
                gain[:, i] = unit.wound(angle) - unit.wound(home)
            case Squared(_, build_up):
                unit = Archimedean(0.0, np.pi * build_up)
                rest[:, i] = unit.wound(angle) - unit.wound(home)
            case Grooved(_, pitch):
                lead[i] = pitch / _TURN
    return Winding(turned, gain, rest, lead)


@dataclass(frozen=True)
class State:
    """What is being fitted: parameters (q,), and p poses."""

    values: Array
    pose: Pose


@dataclass(frozen=True)
class Rows:
    """Equations of one kind at p poses, NaN in the residual where nothing was measured."""

    kind: str
    """``rope``, ``position``, ``rotation``, ``swivel``, ``cable_length`` or ``balance``."""
    residual: Array
    """Model less measurement, (p, k)."""
    by_pose: Array
    """By position and rotation vector, (p, k, 6)."""
    by_values: Array | None
    """By the parameters, (p, k, q); None where they have no part in it."""


@dataclass(frozen=True)
class Equations:
    """The equations of a robot at the poses measured."""

    robot: Robot
    parameters: Parameters
    measured: Measured
    forces: RopeForces

    @cached_property
    def winding(self) -> Winding:
        """Of the motor angles measured."""
        return winding_of(self.robot.winches, self.measured.motor_angle)

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of equations that there are, always in the same order."""
        m = self.measured
        there = {
            "rope": m.motor_angle,
            "position": m.position,
            "rotation": m.angles,
            "swivel": m.swivel,
            "cable_length": m.cable_length,
        }
        kinds = [kind for kind, values in there.items() if np.any(np.isfinite(values))]
        return (*kinds, *(["balance"] if self.has_balance else []))

    @property
    def has_balance(self) -> bool:
        """Whether measured rope forces say something of a payload in doubt."""
        block, std = self.parameters.block, self.parameters.std
        doubt = np.concatenate([std[block["payload_mass"]], std[block["payload_centre"]]])
        return bool(np.any(doubt > 0) and np.any(np.isfinite(self.measured.tension)))

    def geometry(self, values: Array) -> Geometry:
        """Geometry with the parameters' values."""
        block = self.parameters.block
        return replace(
            self.robot.geometry,
            exit_point=values[block["exit_point"]],
            anchor_point=values[block["anchor_point"]],
            swivel_radius=values[block["swivel_radius"]],
        )

    def rope(self, values: Array) -> Array:
        """Rope out by drum, home pose and home length, without its strain, (p, n), m."""
        home, block = self.robot.home, self.parameters.block
        there = lengths(self.geometry(values), home.position, home.rotation)[0]
        if "home_length" in block:
            there = there + values[block["home_length"]]
        radius, growth = values[block["winding_radius"]], float(values[block["layer_growth"][0]])
        return np.asarray(there - self.winding.wound(radius, growth))

    def strain(self, values: Array, pose: Pose) -> tuple[Array, Array | None]:
        """Of the ropes at poses, (p, n), and by the parameters, (p, n, q); None for stiff ropes."""
        law, block = self.parameters.law, self.parameters.block
        if law is None:
            return np.zeros_like(self.measured.motor_angle), None
        force, by_payload = self.forces.at(self.geometry(values), values, pose, block)
        strain, by_law = strain_of(law, values[block["law"]], force)
        by = np.zeros((*strain.shape, len(values)))
        by[..., block["law"]] = by_law
        if by_payload is not None:
            step = np.maximum(1e-3 * np.abs(force), 1e-3)
            more = strain_of(law, values[block["law"]], force + step)[0]
            chain = ((more - strain) / step)[..., None] * by_payload
            columns = np.concatenate([block["payload_mass"], block["payload_centre"]])
            by[..., columns] = chain
        return strain, by

    def rows(self, state: State) -> Iterator[Rows]:
        """All equations at a state."""
        for kind in self.kinds:
            yield getattr(self, f"_{kind}")(state)

    def offsets(self, kind: str, state: State) -> Array:
        """What a line's instrument shows beyond what its zero explains, on the average, (n,)."""
        residual = getattr(self, f"_{kind}")(state).residual
        known = np.isfinite(residual)
        turn = np.where(known, np.exp(1j * np.where(known, residual, 0.0)), 0.0).sum(axis=0)
        if kind == "swivel":
            return np.asarray(-np.angle(turn))
        count = np.maximum(np.count_nonzero(known, axis=0), 1)
        return np.asarray(-np.where(known, residual, 0.0).sum(axis=0) / count)

    def _rope(self, state: State) -> Rows:
        geometry, pose, home = self.geometry(state.values), state.pose, self.robot.home
        there = lengths(geometry, pose.position, pose.rotation)
        strain, by_strain = self.strain(state.values, pose)
        stressed = there + self.robot.dead_length
        residual = there - strain * stressed - self.rope(state.values)
        by = sensitivities(geometry, pose.position, pose.rotation)
        at_home = sensitivities(geometry, home.position, home.rotation)
        slack = (1 - strain)[..., None]
        out = np.zeros((*there.shape, len(state.values)))
        self._fill(out, by, slack)
        block, line = self.parameters.block, np.arange(there.shape[1])
        for name, part in (
            ("exit_point", at_home.exit_point),
            ("anchor_point", at_home.anchor_point),
        ):
            out[:, line[:, None], block[name]] -= part
        out[:, line, block["swivel_radius"]] -= at_home.swivel_radius
        radius = state.values[block["winding_radius"]]
        out[:, line, block["winding_radius"]] = self.winding.by_radius(radius)
        out[:, line, block["layer_growth"][0]] = self.winding.gain
        if "home_length" in block:
            out[:, line, block["home_length"]] = -1.0
        if by_strain is not None:
            out -= by_strain * stressed[..., None]
        return Rows("rope", residual, _by_pose(by) * slack, out)

    def _position(self, state: State) -> Rows:
        residual = state.pose.position - self.measured.position
        by = np.zeros((*residual.shape, 6))
        by[:, range(3), range(3)] = 1.0
        return Rows("position", residual, by, None)

    def _rotation(self, state: State) -> Rows:
        """Whole rotations by their rotation vector, partial ones angle by angle."""
        rotation, angles = state.pose.rotation, self.measured.angles
        whole = np.all(np.isfinite(angles), axis=1)
        residual = _wrapped(angles_of(rotation) - angles)
        by = np.zeros((len(angles), 3, 6))
        by[..., 3:] = angle_rates(rotation)
        off = rotation[whole] @ np.swapaxes(rotation_of(*angles[whole].T), 1, 2)
        residual[whole] = rotation_vector(off)
        by[whole, :, 3:] = np.eye(3)
        return Rows("rotation", residual, by, None)

    def _swivel(self, state: State) -> Rows:
        geometry, pose = self.geometry(state.values), state.pose
        zero = state.values[self.parameters.block["swivel_zero"]]
        there = swivel_angle(geometry, pose.position, pose.rotation) + zero
        by = swivel_sensitivities(geometry, pose.position, pose.rotation)
        out = np.zeros((*there.shape, len(state.values)))
        self._fill(out, by, 1.0)
        line = np.arange(there.shape[1])
        out[:, line, self.parameters.block["swivel_zero"]] = 1.0
        return Rows("swivel", _wrapped(there - self.measured.swivel), _by_pose(by), out)

    def _cable_length(self, state: State) -> Rows:
        geometry, pose, block = self.geometry(state.values), state.pose, self.parameters.block
        there = lengths(geometry, pose.position, pose.rotation)
        by = sensitivities(geometry, pose.position, pose.rotation)
        out = np.zeros((*there.shape, len(state.values)))
        self._fill(out, by, 1.0)
        if "length_offset" in block:
            line = np.arange(there.shape[1])
            there = there + state.values[block["length_offset"]]
            out[:, line, block["length_offset"]] = 1.0
        return Rows("cable_length", there - self.measured.cable_length, _by_pose(by), out)

    def _balance(self, state: State) -> Rows:
        geometry = self.geometry(state.values)
        residual, by_values = balance(
            geometry, state.values, state.pose, self.measured.tension, self.parameters.block
        )
        return Rows("balance", residual, np.zeros((*residual.shape, 6)), by_values)

    def _fill(self, out: Array, by: Sensitivities, factor: Array | float) -> None:
        """Put derivatives by a line's own points and pulley into its columns."""
        block, line = self.parameters.block, np.arange(out.shape[1])
        out[:, line[:, None], block["exit_point"]] = by.exit_point * factor
        out[:, line[:, None], block["anchor_point"]] = by.anchor_point * factor
        own = by.swivel_radius[..., None] * factor
        out[:, line, block["swivel_radius"]] = own[..., 0]


def _by_pose(by: Sensitivities) -> Array:
    return np.concatenate([by.position, by.rotation], axis=-1)


def _wrapped(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)
