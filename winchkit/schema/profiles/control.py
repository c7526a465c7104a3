"""Gains of a drive's control loops, as a profile declares them in ``[control]``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from winchkit.schema.quantity import PositiveDuration, Quantity
from winchkit.schema.table import Table


@dataclass(frozen=True)
class ControlSpec(Table):
    """A position loop around a velocity loop, as of a servo drive, at the motor."""

    position_gain: Annotated[float, Quantity("gain", 0.0)]
    """Speed per position error, 1/s."""
    velocity_gain: Annotated[float, Quantity("rotational viscosity", 0.0, above=True)]
    """Torque per speed error, N m s/rad."""
    integral_time: PositiveDuration | None = None
    """Integral time of the velocity loop, s; None without an integral."""
    torque_limit: Annotated[float, Quantity("torque", 0.0, above=True)] | None = None


@dataclass(frozen=True)
class LinearControlSpec(ControlSpec):
    """The same of a linear axis."""

    velocity_gain: Annotated[float, Quantity("viscosity", 0.0, above=True)]
    """Force per speed error, N s/m."""
    torque_limit: None = field(default=None, init=False, compare=False)
    force_limit: Annotated[float, Quantity("force", 0.0, above=True)] | None = None

    def __post_init__(self) -> None:
        """The model has the force as a torque at 1 m."""
        object.__setattr__(self, "torque_limit", self.force_limit)
