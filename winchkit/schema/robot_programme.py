"""Contents of a robot programme: poses of the platform, lines, arcs, blended corners and holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from winchkit.schema.quantity import (
    Angle,
    Length,
    PositiveAcceleration,
    PositiveDuration,
    PositiveSpeed,
    Quantity,
    Whole,
)
from winchkit.schema.table import Rule, Table

_ACTIONS = ("to", "by", "hold")


@dataclass(frozen=True)
class PlaceSpec(Table):
    """A position on an arc, m."""

    x: Length
    y: Length
    z: Length


@dataclass(frozen=True)
class PoseSpec(Table):
    """Some coordinates of a pose, m and rad; the others keep their values."""

    x: Length | None = None
    y: Length | None = None
    z: Length | None = None
    roll: Angle | None = None
    pitch: Angle | None = None
    yaw: Angle | None = None

    @property
    def given(self) -> dict[str, float]:
        """The coordinates that are given, by name."""
        names = ("x", "y", "z", "roll", "pitch", "yaw")
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def rules(self) -> Iterator[Rule]:
        """At least one coordinate is given."""
        if not self.given:
            yield "", "a pose has at least one of x, y, z, roll, pitch, yaw"


@dataclass(frozen=True)
class PoseStep(Table):
    """One step: exactly one of ``to``, ``by`` and ``hold`` is given."""

    to: PoseSpec | None = None
    by: PoseSpec | None = None
    """Change of the coordinates against the step before."""
    via: PlaceSpec | None = None
    """Position on the arc to the pose; without it the platform moves on a line."""
    blend: Annotated[float, Quantity("length", 0.0, above=True)] | None = None
    """Distance from the pose at which the path leaves for the next one; without it the platform
    stops there."""
    hold: PositiveDuration | None = None

    def rules(self) -> Iterator[Rule]:
        """A step has one action, and only keys of this action."""
        given = [key for key in _ACTIONS if getattr(self, key) is not None]
        if len(given) != 1:
            had = f"; it has {' and '.join(given)}" if given else ""
            yield "", f"a step has exactly one of {', '.join(_ACTIONS)}{had}"
        for key in ("via", "blend"):
            if self.hold is not None and getattr(self, key) is not None:
                yield key, "belongs to a motion, not to 'hold'"


@dataclass(frozen=True)
class RobotProgramme(Table):
    """A programme of the platform; the whole list of steps runs ``repeat`` times."""

    wing: ClassVar[str] = "robot"

    name: str
    step: tuple[PoseStep, ...]
    speed: PositiveSpeed
    acceleration: PositiveAcceleration | None = None
    frame: Literal["base", "home"] = "base"
    """``home``: positions are differences from the home pose, in base axes, and so are angles."""
    repeat: Annotated[int, Whole(1, 1_000_000)] = 1
    description: str = ""

    def rules(self) -> Iterator[Rule]:
        """A blended corner joins two lines."""
        if not self.step:
            yield "step", "a robot programme needs at least one [[step]]"
        for n, step in enumerate(self.step):
            if step.blend is None:
                continue
            following = self.step[n + 1] if n + 1 < len(self.step) else None
            if step.via is not None or following is None or following.hold is not None:
                yield f"step.{n}.blend", "a blended corner lies between two lines"
            elif following.via is not None:
                yield f"step.{n}.blend", "the next step is an arc; a blended corner joins two lines"
