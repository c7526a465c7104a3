"""Constraint equations of a robot's poses as functions of the calibrated parameters.

The equations and their derivatives are those of :mod:`winchkit.robot.geometry.constraints`; this
module places them into the vector of parameters (:mod:`winchkit.robot.calibration.parameters`).
A pose with n lines has n closure equations and one for whatever else was measured there: three of
its position, three of its rotation, a swivel angle and a cable length per line, and six of the
balance of measured cable forces where the payload is fitted or the platform hangs. The pose itself
is always unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.calibration.cable_forces import CableForces
from winchkit.robot.calibration.instruments import Instruments
from winchkit.robot.calibration.parameters import Parameters
from winchkit.robot.files.poses import Measured
from winchkit.robot.forces.balance import balance, hanging_balance
from winchkit.robot.forces.elongation import strain_of
from winchkit.robot.geometry.constraints import (
    Constraint,
    Strain,
    Winding,
    cable_length,
    closure,
    mean_offset,
    position,
    rotation,
    swivel,
    winding_of,
)
from winchkit.robot.geometry.kinematics import Geometry, Pose, lengths
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker, tracked_position, tracked_rotation
from winchkit.robot.identification.bundle_adjustment import Rows, State
from winchkit.schema.profiles.robot import PlatformSpec

_RATIO_STEP = 1e-6
"""Relative step of a gear ratio for its derivative."""


@dataclass(frozen=True)
class Equations:
    """Constraint equations of a robot at measured poses.

    Kinds are ``closure`` (length by the drum), ``position``, ``rotation``, ``swivel``,
    ``cable_length`` and ``balance``.
    """

    robot: Robot
    parameters: Parameters
    measured: Measured
    forces: CableForces
    instruments: Instruments | None = None
    """Of the measured poses; None where they are in the base frame, of the platform's origin."""
    effects: tuple[str, ...] = ()
    """Effects beside those of the robot's profile."""

    def of(self, poses: NDArray[np.bool_]) -> Equations:
        """The equations of some of the poses, (p,)."""
        measured = self.measured[poses]
        forces = replace(self.forces, tension=measured.tension)
        return replace(self, measured=measured, forces=forces)

    @cached_property
    def winding(self) -> Winding:
        """Drum angles and winding laws at the measured motor angles, with nominal gear ratios."""
        return winding_of(self.robot.winches, self.measured.motor_angle)

    def winding_at(self, values: Array, share: float = 0.0) -> Winding:
        """The same with the gear ratios of the parameters, larger by ``share``."""
        if "gear_ratio" not in self.parameters.block:
            return self.winding
        ratios = values[self.parameters.block["gear_ratio"]] * (1 + share)
        winches = [
            replace(winch, gearbox=replace(winch.gearbox, ratio=float(ratio)))
            for winch, ratio in zip(self.robot.winches, ratios, strict=True)
        ]
        return winding_of(winches, self.measured.motor_angle)

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of equations that were measured, always in the same order."""
        m = self.measured
        there = {
            "closure": m.motor_angle,
            "position": m.position,
            "rotation": m.angles,
            "swivel": m.swivel,
            "cable_length": m.cable_length,
        }
        kinds = [kind for kind, values in there.items() if np.any(np.isfinite(values))]
        return (*kinds, *(["balance"] if self.has_balance else []))

    @property
    def count(self) -> int:
        """Number of measured values of motors, positions, rotations, swivels and lengths."""
        m = self.measured
        every = (m.motor_angle, m.position, m.angles, m.swivel, m.cable_length)
        return sum(int(np.count_nonzero(np.isfinite(values))) for values in every)

    @property
    def hangs(self) -> bool:
        """Whether measured cable forces and a known weight determine the pose of the platform."""
        few = self.robot.hangs and self.robot.platform.mass > 0
        return few and bool(np.any(np.all(np.isfinite(self.measured.tension), axis=1)))

    @property
    def has_balance(self) -> bool:
        """Whether cable forces were measured, and the platform hangs, or the payload or cell gains
        are fitted."""
        if self.hangs:
            return True
        block, std = self.parameters.block, self.parameters.std
        if "cell_gain" in block:
            return True
        payload = np.concatenate([std[block["payload_mass"]], std[block["payload_centre"]]])
        return bool(np.any(payload > 0) and np.any(np.isfinite(self.measured.tension)))

    def geometry(self, values: Array) -> Geometry:
        """Geometry with the parameters' values."""
        block = self.parameters.block
        return replace(
            self.robot.geometry,
            exit_point=values[block["exit_point"]],
            anchor_point=values[block["anchor_point"]],
            swivel_radius=values[block["swivel_radius"]],
        )

    def platform(self, values: Array) -> PlatformSpec:
        """Platform with the parameters' values."""
        block = self.parameters.block
        x, y, z = values[block["payload_centre"]].tolist()
        mass = float(values[block["payload_mass"][0]])
        return replace(self.robot.platform, mass=mass, center_of_mass=(x, y, z))

    def by_drum(self, values: Array) -> Array:
        """Unstrained cable lengths by drums, home pose and home lengths, (p, n), m."""
        home, block = self.robot.home, self.parameters.block
        there = lengths(self.geometry(values), home.position, home.rotation)[0]
        if "home_length" in block:
            there = there + values[block["home_length"]]
        radius, growth = values[block["winding_radius"]], float(values[block["layer_growth"][0]])
        return np.asarray(there - self.winding_at(values).wound(radius, growth))

    def strain(self, values: Array, pose: Pose) -> Strain | None:
        """Strains of the cables at poses; None where no law of elongation is fitted.

        The derivative by the payload, which acts through computed forces, is the product of the
        law's slope (a forward difference) and the forces' derivative.
        """
        law, block = self.parameters.law, self.parameters.block
        if law is None:
            return None
        force, by_payload = self.forces.at(self.geometry(values), self.platform(values), pose)
        strain, by_law = strain_of(law, values[block["law"]], force)
        by = {"law": by_law}
        if by_payload is not None:
            step = np.maximum(1e-3 * np.abs(force), 1e-3)
            more = strain_of(law, values[block["law"]], force + step)[0]
            by["payload"] = ((more - strain) / step)[..., None] * by_payload
        return Strain(strain, by)

    def instruments_at(self, values: Array) -> Instruments | None:
        """Instruments with the parameters' values."""
        own, block = self.instruments, self.parameters.block
        if own is None:
            return None
        trackers = own.trackers
        common: dict[str, Any] = {}
        if "reflector" in block:
            common["offset"] = values[block["reflector"]]
        if "tracker_scale" in block:
            common["scale"] = float(values[block["tracker_scale"][0]])
        if "mounting" in block:
            common["mounting"] = values[block["mounting"]]
        out = []
        for n, tracker in enumerate(trackers):
            frame: dict[str, Any] = {}
            if "tracker_frame" in block:
                six = values[block["tracker_frame"][n]]
                frame = {"shift": six[:3], "turn": six[3:]}
            out.append(replace(tracker, **common, **frame))
        return replace(own, trackers=tuple(out))

    def tracker(self, values: Array) -> Tracker | None:
        """The tracker at each measured pose; None where it shows the pose in the base frame."""
        own = self.instruments_at(values)
        return None if own is None else own.at(self.measured)

    def constraints(self, state: State) -> Iterator[tuple[str, Constraint]]:
        """All equations at a state, by kind, with derivatives by each line's own numbers."""
        for kind in self.kinds:
            found = self._constraint_of[kind](state)
            # Guides hold the other coordinates, whatever a tracker shows of them.
            yield kind, replace(found, by_pose=found.by_pose * self.robot.geometry.free)

    def rows(self, state: State) -> Iterator[Rows]:
        """All equations at a state with derivatives by the vector of parameters."""
        for kind, constraint in self.constraints(state):
            by_values = self._by_values(constraint, len(state.values))
            yield Rows(kind, constraint.residual, constraint.by_pose, by_values)

    def offsets(self, kind: str, state: State) -> Array:
        """Mean reading of each line's instrument beyond its zero, (n,)."""
        return mean_offset(self._constraint_of[kind](state).residual, angles=kind == "swivel")

    @property
    def _constraint_of(self) -> dict[str, Callable[[State], Constraint]]:
        return {
            "closure": self._closure,
            "position": self._position,
            "rotation": self._rotation,
            "swivel": self._swivel,
            "cable_length": self._cable_length,
            "balance": self._balance,
        }

    def _closure(self, state: State) -> Constraint:
        values, block = state.values, self.parameters.block
        radius, growth = values[block["winding_radius"]], float(values[block["layer_growth"][0]])
        winding = self.winding_at(values)
        found = closure(
            self.geometry(values),
            state.pose,
            self.robot.home,
            self.by_drum(values),
            winding=winding,
            radius=radius,
            strain=self.strain(values, state.pose),
            dead_length=self.robot.dead_length,
        )
        if "gear_ratio" not in block:
            return found
        change = self.winding_at(values, _RATIO_STEP).wound(radius, growth)
        change = change - winding.wound(radius, growth)
        by_ratio = change / (_RATIO_STEP * values[block["gear_ratio"]])
        return replace(found, by_line={**found.by_line, "gear_ratio": by_ratio})

    def _position(self, state: State) -> Constraint:
        tracker = self.tracker(state.values)
        if tracker is None:
            return position(state.pose, self.measured.position)
        return self._by_session(tracked_position(tracker, state.pose, self.measured.position))

    def _rotation(self, state: State) -> Constraint:
        tracker = self.tracker(state.values)
        if tracker is None:
            return rotation(state.pose, self.measured.angles)
        return self._by_session(tracked_rotation(tracker, state.pose, self.measured.angles))

    def _by_session(self, found: Constraint) -> Constraint:
        """The constraint with the derivatives by the frame in the columns of each session."""
        assert self.instruments is not None
        part = found.by_robot["tracker_frame"]
        which = np.maximum(self.instruments.session_of(self.measured), 0)
        count = len(self.instruments.sessions)
        frame = np.zeros((*part.shape[:2], count, 6))
        for number in range(count):
            rows = which == number
            frame[rows, :, number] = part[rows]
        by = {**found.by_robot, "tracker_frame": frame.reshape(*part.shape[:2], 6 * count)}
        return replace(found, by_robot=by)

    def _swivel(self, state: State) -> Constraint:
        block = self.parameters.block
        zero = state.values[block["swivel_zero"]] if "swivel_zero" in block else 0.0
        return swivel(self.geometry(state.values), state.pose, self.measured.swivel, zero)

    def _cable_length(self, state: State) -> Constraint:
        block, offset = self.parameters.block, np.zeros(len(self.robot.names))
        if "length_offset" in block:
            offset = state.values[block["length_offset"]]
        geometry = self.geometry(state.values)
        if "length_scale" not in block:
            return cable_length(geometry, state.pose, self.measured.cable_length, offset)
        size = 1 + state.values[block["length_scale"]]
        # A reading (1 + s) L + o, compared as the length that it means.
        shown = self.measured.cable_length / size
        found = cable_length(geometry, state.pose, shown, offset / size)
        by_line = {
            **found.by_line,
            "length_offset": np.ones_like(shown) / size,
            "length_scale": (self.measured.cable_length - offset) / size**2,
        }
        return replace(found, by_line=by_line)

    def _balance(self, state: State) -> Constraint:
        values = state.values
        equilibrium = hanging_balance if self.hangs else balance
        block, force = self.parameters.block, self.measured.tension
        gain = 1 + (
            values[block["cell_gain"]] if "cell_gain" in block else np.zeros(force.shape[1])
        )
        force = force / gain
        found = equilibrium(self.geometry(values), state.pose, force, self.platform(values))
        by_gain = found.by_robot["tension"] * np.nan_to_num(-force / gain)[:, None, :]
        return replace(found, by_robot={**found.by_robot, "cell_gain": by_gain})

    def _by_values(self, constraint: Constraint, count: int) -> Array | None:
        """Derivatives by the vector of parameters; those by other quantities are left out."""
        if not (constraint.by_line or constraint.by_robot):
            return None
        block = self._blocks
        out = np.zeros((*constraint.residual.shape, count))
        line = np.arange(out.shape[1])
        for name, part in constraint.by_line.items():
            if name in block:
                out[:, line[:, None] if part.ndim == 3 else line, block[name]] = part
        for name, part in constraint.by_robot.items():
            if name in block:
                out[..., block[name].ravel()] = part
        return out

    @cached_property
    def _blocks(self) -> dict[str, Array]:
        """Blocks of parameters, with those of the payload in one."""
        block = self.parameters.block
        payload = np.concatenate([block["payload_mass"], block["payload_centre"]])
        return {**block, "payload": payload}
