"""Contents of an axis profile: a motor with its gearbox, or a linear axis; no drum and cable."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.schema.profiles.control import LinearControlSpec
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    MotorSpec,
    PathSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.schema.quantity import Quantity
from winchkit.schema.table import Rule

_UNIT_DRUM = DrumSpec("grooved", winding_radius=1.0, groove_pitch=0.0)
"""A radius of 1 m: lengths of the line are then angles of the joint."""


@dataclass(frozen=True, repr=False)
class AxisProfile(WinchProfile):
    """A joint or a motor as declared; only its torque is predicted, zero without effects.

    It is a winch profile for the model, with a drum of 1 m that no file can declare: the drum angle
    is that of the joint, and there is no cable, no load and no length.
    """

    drum: DrumSpec = field(default=_UNIT_DRUM, init=False, compare=False)
    gearbox: GearboxSpec = field(default_factory=GearboxSpec)
    reference: ReferenceSpec = field(default_factory=ReferenceSpec)
    cable: CableSpec = field(default_factory=CableSpec, init=False, compare=False)
    path: PathSpec = field(default_factory=PathSpec, init=False, compare=False)
    guide: GuideSpec | None = field(default=None, init=False, compare=False)
    pulley: tuple[PulleySpec, ...] = field(default=(), init=False, compare=False)
    motion: Literal["rotary", "linear"] = "rotary"
    """Rotary for an angle and a torque, linear for a position and a force."""

    @property
    def is_linear(self) -> bool:
        """Whether its runs have a position and a force in place of an angle and a torque."""
        return self.motion == "linear"

    def rules(self) -> Iterator[Rule]:
        """A joint has no cable at its reference, and no turns of it."""
        yield from super().rules()
        for key in ("cable_length", "wound_turns"):
            if getattr(self.reference, key):
                yield f"reference.{key}", "belongs to a winch; an axis has no cable"
        if self.gearbox.efficiency is not None:
            yield (
                "gearbox.efficiency",
                "needs the load of a cable; an axis has none: declare its friction as effects",
            )


@dataclass(frozen=True)
class LinearMotorSpec(MotorSpec):
    """The motor of a linear axis; the moved mass is the effect ``rotor-inertia``."""

    inertia: None = field(default=None, init=False, compare=False)
    torque_constant: float | None = field(default=None, init=False, compare=False)
    force_constant: Annotated[float, Quantity("force per current", 0.0, above=True)] | None = None
    """Force per current, N/A, for runs that have the current in place of the force."""

    def __post_init__(self) -> None:
        """The model has the force as a torque at 1 m."""
        object.__setattr__(self, "torque_constant", self.force_constant)


@dataclass(frozen=True, repr=False)
class LinearAxisProfile(AxisProfile):
    """A carriage, a cylinder or a damper as declared: an axis with 1 m for 1 rad.

    Its position is that of the instrument, without a gearbox between.
    """

    motor: LinearMotorSpec = field(default_factory=LinearMotorSpec)
    control: LinearControlSpec | None = None
    gearbox: GearboxSpec = field(default_factory=GearboxSpec, init=False, compare=False)
    reference: ReferenceSpec = field(default_factory=ReferenceSpec, init=False, compare=False)
