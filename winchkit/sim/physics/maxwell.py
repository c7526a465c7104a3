"""Friction of pulleys by Maxwell-slip elements with a Stribeck curve and bearing drag.

Parallel springs slide at forces of their own (W. D. Iwan, *A distributed-element model for
hysteresis*, 1966); their sum is the presliding hysteresis.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp
from typing import ClassVar

from winchkit.schema.quantity import Number, PositiveSpeed
from winchkit.sim.physics.base import Physics, Stiffness
from winchkit.sim.physics.pulley import pressure
from winchkit.sim.physics.state import PlantState

_ELEMENTS = 4
"""The chords of four elements differ from the parabola of infinitely many by at most 1.6 % (1/64)
of the sliding force."""
_SHARES = tuple((2 * n + 1) / _ELEMENTS**2 for n in range(_ELEMENTS))
"""Share of each element in the sliding force; the sum is one."""


@dataclass
class MaxwellPulleys(Physics):
    """Maxwell-slip friction of the axles, higher at low speed, and drag of the bearings."""

    friction: Number = 0.012
    stiffness: Stiffness = 20000.0
    static_excess: Number = 0.15
    stribeck_speed: PositiveSpeed = 0.01
    drag_speed: PositiveSpeed = 5.0
    """At which the bearing drag equals the sliding force, m/s."""
    size: ClassVar[str] = "friction"
    _forces: dict[int, list[float]] = field(default_factory=dict)

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        """Sum of the elements, each limited to its share of the sliding force."""
        forces = self._forces.setdefault(index, [0.0] * _ELEMENTS)
        speed = state.winding_speed
        excess = self.static_excess * exp(-((speed / self.stribeck_speed) ** 2))
        load = pressure(tension, tension + sum(forces), wrap)
        limit = self.friction * (1 + excess) * load
        move = self.stiffness / _ELEMENTS * speed * dt
        for n, share in enumerate(_SHARES):
            bound = share * limit
            forces[n] = max(-bound, min(bound, forces[n] + move))
        return sum(forces) + self.friction * load * speed / self.drag_speed
