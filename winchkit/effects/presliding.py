"""Presliding: Dahl friction at a stage, whose state continues over runs and control cycles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Dynamics, Parameter, Plausible, Values
from winchkit.model.friction import dahl
from winchkit.model.recurrence import share
from winchkit.model.stages import At

START = Parameter("start", "1", null=0.0, typical=0.5, low=-1.0, high=1.0, role="fixed")
"""F/F_c at the first sample."""


def sliding_distance(what: str) -> Parameter:
    """The parameter ``distance`` of the motor after which ``what`` slide, rad."""
    return Parameter(
        "distance",
        "rad",
        null=0.1,
        typical=0.1,
        low=1e-6,
        high=6.3,
        role="shape",
        grid=(0.001, 0.004, 0.016, 0.064),
        along="motor_angle",
        plausible=Plausible(0.0, 6.3, f"{what} slide within a motor turn"),
    )


@dataclass(frozen=True)
class Presliding:
    """Dahl friction over a displacement, added to the value of a stage."""

    size: str
    """Parameter at whose zero the friction vanishes."""
    limit: Callable[[Array, At, Values], Array]
    """F_c at each sample, from the value before the friction; in the unit of the stage."""
    displacement: Callable[[At], Array]
    """x at each sample, positive in the direction that the friction makes the value larger."""
    stiffness: Callable[[Values], float]
    """σ at F = 0, unit of the stage per unit of the displacement."""

    def apply(self, value: Array, at: At, values: Values) -> Array:
        """Value plus the friction; exponent β of the parameter ``shape``, 1 without it."""
        if values[self.size] == 0.0:
            return value
        return value + dahl(
            self.displacement(at),
            self.limit(value, at, values),
            self.stiffness(values),
            values.get("shape", 1.0),
            values["start"],
        )

    @property
    def dynamics(self) -> Dynamics:
        """The same law in continuous time; its state is F/F_c."""
        return Dynamics(self._at_state, self._rate)

    def _at_state(self, value: Array, at: At, values: Values) -> Array:
        return value + values["start"] * self.limit(value, at, values)

    def _rate(self, value: Array, at: At, values: Values) -> Array:
        """σ x'/F_c |u|^β sgn u with u = 1 − sgn(x') F/F_c."""
        speed, limit = np.gradient(self.displacement(at), at.time), self.limit(value, at, values)
        left = 1.0 - np.sign(speed) * values["start"]
        bent = np.sign(left) * np.abs(left) ** values.get("shape", 1.0)
        return np.where(limit > 0, self.stiffness(values) * speed * bent / limit, 0.0)

    def carried(self, after: Array, before: Array, at: At, values: Values) -> Array:
        """F/F_c at the last sample, the ``start`` of the next ones."""
        return share(after[-1] - before[-1], self.limit(before[-1:], at, values)[0])
