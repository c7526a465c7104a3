"""Transition of friction: the rate over which its direction turns around at a reversal.

Presliding, a drive's velocity filter and a logger's low-pass all round the reversal of a friction
that does not depend on the rate. Within the transition they are one Coulomb friction: the
direction is multiplied by tanh(|rate|/transition), which is one everywhere at the null.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At

TRANSITION = "transition"
"""Name of the parameter."""
MOTOR_TRANSITION = Parameter(
    TRANSITION, "rad/s", null=0.0, typical=0.1, low=0.0, high=1e3, role="fixed"
)
"""Of friction over the motor's rate; fitted after the search, as no part of the law."""
CABLE_TRANSITION = Parameter(
    TRANSITION, "m/s", null=0.0, typical=2e-3, low=0.0, high=10.0, role="fixed"
)
"""Of friction over the speed of the cable."""
_LEAST = 1e-4
"""Lower bound of a fitted transition, as a share of its typical size: there it is sharp."""


def motor_direction(at: At, values: Values) -> Array:
    """Direction of the motor with the transition of a friction, (n,)."""
    return _rounded(at.motor_direction, at.motor_rate, values.get(TRANSITION, 0.0))


def cable_direction(at: At, values: Values) -> Array:
    """Direction of the cable with the transition of a friction, (n,)."""
    return _rounded(at.direction, at.speed, values.get(TRANSITION, 0.0))


def _rounded(direction: Array, rate: Array, transition: float) -> Array:
    if transition == 0.0:
        return direction
    return np.asanyarray(direction * np.tanh(np.abs(rate) / transition))


def with_transitions(effect: Effect, transitions: Mapping[str, float]) -> Effect:
    """An effect with other transitions by default, given by the unit of the rate (rad/s or m/s);
    its law is the same.
    """
    return replace(
        effect,
        parameters=tuple(
            replace(p, null=transitions[p.unit])
            if p.name == TRANSITION and p.unit in transitions
            else p
            for p in effect.parameters
        ),
    )


def with_free_transition(effect: Effect, largest: float) -> Effect:
    """An effect whose transition is fitted up to a largest one, on a logarithmic scale."""
    return replace(
        effect,
        parameters=tuple(
            replace(p, role="nuisance", low=min(_LEAST * p.typical, largest / 2), high=largest)
            if p.name == TRANSITION
            else p
            for p in effect.parameters
        ),
    )
