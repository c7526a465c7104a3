"""Contents of a profile of a cable robot: platform, home pose, priors and lines."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from winchkit.rendering import Plotted
from winchkit.schema.profiles.instruments import UNKNOWN, InstrumentSpec
from winchkit.schema.profiles.winch import EffectTable, LedgerEntry, WinchProfile
from winchkit.schema.quantity import (
    Angle,
    Inertia,
    Length,
    Mass,
    Number,
    PositiveLength,
    Quantity,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table

Point = tuple[Length, Length, Length]
Coordinate = Literal["x", "y", "z", "roll", "pitch", "yaw"]
COORDINATES: tuple[Coordinate, ...] = ("x", "y", "z", "roll", "pitch", "yaw")
"""Of a pose. As degrees of freedom the angles are rotations about the base axes x, y and z."""

PriorName = Literal[
    "exit_point", "anchor_point", "winding_radius", "swivel_radius", "layer_growth", "home_length"
]
PRIORS: dict[PriorName, float] = {
    "exit_point": 5e-3,
    "anchor_point": 5e-3,
    "winding_radius": 0.5e-3,
    "swivel_radius": 0.4e-3,
    "layer_growth": 0.04e-3,
    "home_length": 1e-3,
}
"""Standard deviations of priors that a file does not declare, m: half the width of the bounds of
CABTIVE paper, Table 4, is read as two standard deviations. That of the cable lengths at home
(effect ``home-length``) is what remains where the platform is set into a fixture by hand."""
CENTRE_STD = 20e-3
"""The same of a centre of mass, m: it is known from a drawing to some centimetres (rule of thumb;
the data decide where it can be identified)."""


@dataclass(frozen=True)
class PriorSpec(Table):
    """Prior of a parameter for calibration; a quantity alone is ``std``."""

    std: PositiveLength
    """Standard deviation, m."""
    bounds: tuple[Length, Length] | None = None

    def rules(self) -> Iterator[Rule]:
        """The lower bound lies below the upper one."""
        if self.bounds is not None and self.bounds[0] >= self.bounds[1]:
            yield "bounds", "the lower bound is not below the upper one"


@dataclass(frozen=True)
class PlatformSpec(Table):
    """The moving platform."""

    mass: Mass = 0.0
    center_of_mass: Point = (0.0, 0.0, 0.0)
    inertia: tuple[Inertia, Inertia, Inertia] | None = None
    """Principal moments about the centre of mass, in platform axes, kg m²; None where unknown."""
    degrees_of_freedom: tuple[Coordinate, ...] = COORDINATES
    """Motions that the platform can make; guides, or the way it is made, hold the others at their
    values of home. A planar platform has two translations and the rotation about the normal of
    their plane, such as x, z, pitch; a point mass has translations only."""

    @property
    def free(self) -> tuple[float, ...]:
        """1 for each coordinate of a pose that is a degree of freedom, 0 for the others, (6,)."""
        return tuple(float(name in self.degrees_of_freedom) for name in COORDINATES)

    def rules(self) -> Iterator[Rule]:
        """Degrees of freedom form a group; principal moments satisfy the triangle inequality."""
        if not _is_group(self.degrees_of_freedom):
            yield (
                "degrees_of_freedom",
                f"[{', '.join(self.degrees_of_freedom)}] are no motions of a rigid body by "
                "themselves; write translations, alone or with the rotation about the normal of "
                "two of them (x, z, pitch), or all six",
            )
        a, b, c = sorted(self.inertia or (0.0, 0.0, 0.0))
        if c > (a + b) * (1 + 1e-9):
            yield "inertia", f"{c:g} kg m^2 is above the sum of the two others; no body has these"


def _is_group(names: tuple[Coordinate, ...]) -> bool:
    """Whether these motions, one after the other, are motions of the same kind."""
    moved, turned = (
        [name in names for name in part] for part in (COORDINATES[:3], COORDINATES[3:])
    )
    if len(set(names)) < len(names) or not any(moved):
        return False
    across = all(moved[k] for k in range(3) if not turned[k])
    return not any(turned) or (sum(turned) == 1 and across) or all(moved + turned)


@dataclass(frozen=True)
class HomeSpec(Table):
    """The pose at which every line has its reference motor angle."""

    position: Point
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw; R = Rz(yaw) Ry(pitch) Rx(roll), platform to base."""
    frame: Literal["base", "tracker"] = "base"
    """Of the two above; ``tracker`` for a pose as the tracker showed it, which the reader of the
    file converts."""


@dataclass(frozen=True)
class LineSpec(Table):
    """One line: its winch, exit point, anchor point and swivel pulley."""

    name: str
    exit_point: Point
    anchor_point: Point
    winch: str | WinchProfile
    swivel_radius: Annotated[float, Quantity("length", 0.0)] = 0.0
    swivel_axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)

    def rules(self) -> Iterator[Rule]:
        """A direction is not the zero vector."""
        if not any(self.swivel_axis):
            yield "swivel_axis", "is zero; it is the direction of the cable at the pulley"


@dataclass(frozen=True)
class FittedSpec(Table):
    """Origin of the values of a calibrated robot; written by ``winchkit calibrate``."""

    date: datetime.date
    runs: tuple[str, ...] = ()
    poses: WholeNumber = 0
    position_rms: Length | None = None
    """Rms position error of the fitted poses, m."""
    held_out_rms: Length | None = None
    """Rms position error of held-out poses, m."""
    std: Mapping[str, str] = field(default_factory=dict)
    """Posterior standard deviation by parameter, with its unit."""


@dataclass(frozen=True, repr=False)
class RobotProfile(Plotted, Table):
    """A cable robot as declared; frozen, SI."""

    wing: ClassVar[str] = "robot"

    name: str
    home: HomeSpec
    line: tuple[LineSpec, ...]
    platform: PlatformSpec = field(default_factory=PlatformSpec)
    prior: Mapping[PriorName, PriorSpec] = field(default_factory=dict)
    instrument: InstrumentSpec = field(default_factory=InstrumentSpec)
    """Instruments that measure the platform's pose."""
    effect: tuple[EffectTable, ...] = ()
    fitted: FittedSpec | None = None
    ledger: tuple[LedgerEntry, ...] = ()
    description: str = ""

    def rules(self) -> Iterator[Rule]:
        """A robot has lines, each by its own name and from its own exit point."""
        if not self.line:
            yield "line", "a robot needs at least one [[line]]"
        names = [line.name for line in self.line]
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield "line", f"{names.count(name)} lines are named '{name}'"
        for key, name in self.instrument.lines():
            if name not in names:
                yield f"instrument.{key}", f"no line '{name}'; the lines are {', '.join(names)}"
        tracker = self.instrument.tracker
        if self.home.frame == "tracker" and UNKNOWN in (tracker.frame, tracker.reflector):
            message = (
                "needs the frame and the reflector of [instrument.tracker], one of which is "
                f"'{UNKNOWN}'; write the pose in the base frame, or measure what is unknown"
            )
            yield "home.frame", message
        if tracker.datum == "tracker" and not all(self.platform.free):
            message = "degrees_of_freedom are along base axes, which stay; use datum = 'robot'"
            yield "instrument.tracker.datum", message
        seen: dict[Point, str] = {}
        for n, line in enumerate(self.line):
            other = seen.setdefault(line.exit_point, line.name)
            if other != line.name:
                message = f"is that of line {other}; two lines leave the frame in two points"
                yield f"line.{n}.exit_point", message
