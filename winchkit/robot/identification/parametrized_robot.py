"""A robot as a function of the parameters of an identification."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.model.drum import drum_of
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.kinematics import Geometry, lengths
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.instruments import InstrumentValues
from winchkit.robot.identification.parameters import Parameters
from winchkit.schema.profiles.robot import PlatformSpec, RobotProfile
from winchkit.schema.profiles.winch import LAYERED


@dataclass(frozen=True)
class ParametrizedRobot:
    """Parameters, and the robot with its instruments at any values of them."""

    robot: Robot
    """With nominal numbers, without effects."""
    parameters: Parameters
    measured: MeasuredPoses
    """Poses, each in a session of its tracker."""
    instruments: InstrumentValues | None = None
    """Of the measured poses; None where the robot has its own tracker."""
    effects: tuple[str, ...] = ()
    """Effects that are parameters, beside those of the robot's profile."""
    terms: tuple[Term, ...] = ()
    """Effects whose coordinates are parameters, with their starting values."""

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
        mass, centre = float(values[block["payload_mass"][0]]), values[block["payload_centre"]]
        return replace(self.robot.platform, mass=mass, center_of_mass=_point(centre))

    @cached_property
    def _growths(self) -> Array:
        """Of layered drums, (n,), m; NaN of others."""
        return np.array(
            [
                getattr(drum_of(winch), "growth", 0.0) if winch.drum.kind in LAYERED else np.nan
                for winch in self.robot.winches
            ]
        )

    def growth(self, values: Array) -> Array:
        """Growth of each drum's radius per turn, (n,), m; a common change where they differ."""
        known = self._growths[np.isfinite(self._growths)]
        change = values[self.parameters.block["layer_growth"][0]] - known[:1].sum()
        return np.asarray(np.nan_to_num(self._growths + change))

    def profile_at(self, values: Array) -> RobotProfile:
        """The robot's profile with the parameters' values of lines, drums, gears and platform."""
        geometry, block, growth = self.geometry(values), self.parameters.block, self.growth(values)
        lines = []
        for i, (line, winch) in enumerate(
            zip(self.robot.profile.line, self.robot.winches, strict=True)
        ):
            drum = replace(winch.drum, winding_radius=float(values[block["winding_radius"][i]]))
            if drum.kind in LAYERED:
                drum = replace(drum, layer_growth=float(growth[i]))
            gearbox = winch.gearbox
            if "gear_ratio" in block:
                gearbox = replace(gearbox, ratio=float(values[block["gear_ratio"][i]]))
            lines.append(
                replace(
                    line,
                    exit_point=_point(geometry.exit_point[i]),
                    anchor_point=_point(geometry.anchor_point[i]),
                    swivel_radius=float(geometry.swivel_radius[i]),
                    winch=replace(winch, drum=drum, gearbox=gearbox),
                )
            )
        platform = self.platform(values)
        return replace(self.robot.profile, line=tuple(lines), platform=platform)

    def terms_at(self, values: Array) -> tuple[Term, ...]:
        """Effects with the parameters' values."""
        out, left = [], values[self.parameters.block["terms"]]
        for term in self.terms:
            coordinates = Coordinates(term.effect)
            own, left = left[: len(coordinates)], left[len(coordinates) :]
            out.append(Term(term.effect, coordinates.values(own, term.values)))
        return tuple(out)

    def robot_at(self, values: Array) -> Robot:
        """The robot with the parameters' values; with effects, also its drums and gears are
        these."""
        if self.terms:
            return robot_with_terms(self.profile_at(values), self.terms_at(values))
        geometry, home, block = self.geometry(values), self.robot.home, self.parameters.block
        there = lengths(geometry, home.position, home.rotation)[0]
        if "home_length" in block:
            there = there + values[block["home_length"]]
        own = self.instruments_at(values)
        return replace(
            self.robot,
            geometry=geometry,
            home_length=there,
            platform=self.platform(values),
            modifiers=((),) * len(self.robot.names),
            tracker=self.robot.tracker if own is None else own.at(self.measured),
        )

    def instruments_at(self, values: Array) -> InstrumentValues | None:
        """Instruments with the parameters' values."""
        own, block = self.instruments, self.parameters.block
        if own is None:
            return None
        common: dict[str, Any] = {}
        if "reflector" in block:
            common["offset"] = values[block["reflector"]]
        if "tracker_scale" in block:
            common["scale"] = float(values[block["tracker_scale"][0]])
        if "mounting" in block:
            common["mounting"] = values[block["mounting"]]
        out = []
        for n, tracker in enumerate(own.trackers):
            frame: dict[str, Any] = {}
            if "tracker_frame" in block:
                six = values[block["tracker_frame"][n]]
                frame = {"shift": six[:3], "turn": six[3:]}
            out.append(replace(tracker, **common, **frame))
        return replace(own, trackers=tuple(out))

    def _of_lines(self, block: str, values: Array) -> Array:
        """Values of a block with a number per line, (n,); zero where it is no parameter."""
        own = self.parameters.block.get(block)
        return np.zeros(len(self.robot.names)) if own is None else values[own]


def _point(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
