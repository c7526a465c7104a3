"""Contents of an axis profile: a motor with its gearbox, without drum and cable."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    PathSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
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
