"""Geometry of a robot as nuisance parameters with a Gaussian prior."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from winchkit.effects.placement import base_of, line_of_effect
from winchkit.effects.term import Term
from winchkit.schema.profiles.robot import LineSpec, PriorName, RobotProfile
from winchkit.schema.profiles.winch import LAYERED, WinchProfile

Point = tuple[float, float, float]
FIELDS: dict[str, PriorName] = {
    "exit-point": "exit_point",
    "anchor-point": "anchor_point",
    "swivel-radius": "swivel_radius",
    "drum-radius": "winding_radius",
    "layer-thickness": "layer_growth",
}
"""Field of a robot's geometry that each effect of the catalogue changes."""


@dataclass(frozen=True)
class GeometryPrior:
    """One number of the geometry as a nuisance parameter.

    Attributes
    ----------
    term : Term
        Geometry effect with its present values.
    parameter : str
        Name of the parameter.
    std : float
        Standard deviation of the prior, SI.
    at : float
        Mean of the prior, SI.
    """

    term: Term
    parameter: str
    std: float
    at: float = 0.0

    @property
    def field(self) -> PriorName:
        """Field of the geometry: ``exit_point``, ``winding_radius`` ..."""
        return FIELDS[base_of(self.term.effect)]

    @property
    def line(self) -> str:
        """Line of the number; empty for one of all lines."""
        return line_of_effect(self.term.effect)

    @property
    def value(self) -> float:
        """Present value, SI."""
        return self.term.values[self.parameter]

    def moved(self, by: float) -> GeometryPrior:
        """The same number, moved by a multiple of its standard deviation."""
        values = {**self.term.values, self.parameter: self.value + by * self.std}
        return replace(self, term=Term(self.term.effect, values))


def profile_with_geometry(profile: RobotProfile, geometry: Iterable[GeometryPrior]) -> RobotProfile:
    """Robot profile with every number of the geometry at its present value."""
    lines = {line.name: line for line in profile.line}
    for item in geometry:
        if not item.value:
            continue
        place = line_of_effect(item.term.effect)
        for name in [place] if place else lines:
            lines[name] = _with(lines[name], base_of(item.term.effect), item)
    return replace(profile, line=tuple(lines.values()))


def _with(line: LineSpec, effect: str, item: GeometryPrior) -> LineSpec:
    """Line with one number of its geometry moved."""
    by, winch = item.value, line.winch
    if effect == "exit-point":
        return replace(line, exit_point=_shifted(line.exit_point, item.parameter, by))
    if effect == "anchor-point":
        return replace(line, anchor_point=_shifted(line.anchor_point, item.parameter, by))
    if effect == "swivel-radius":
        return replace(line, swivel_radius=line.swivel_radius + by)
    assert isinstance(winch, WinchProfile)
    drum = winch.drum
    if effect == "drum-radius":
        drum = replace(drum, winding_radius=drum.winding_radius + by)
    elif drum.kind in LAYERED:
        growth = winch.cable.diameter if drum.layer_growth is None else drum.layer_growth
        drum = replace(drum, layer_growth=(growth or 0.0) + by)
    return replace(line, winch=replace(winch, drum=drum))


def _shifted(point: Point, axis: str, by: float) -> Point:
    x, y, z = (value + by * (name == axis) for name, value in zip("xyz", point, strict=True))
    return x, y, z
