"""Sources of the motor torque as expressions: a recording, or a position and a velocity loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from winchkit.arrays import Array
from winchkit.dynamics.expression import Expression, number, symbol
from winchkit.dynamics.tracing import expression, traced
from winchkit.schema.profiles.control import ControlSpec

SINCE = "since"
"""Symbol of the start of the present interval between two samples of the inputs."""


@dataclass(frozen=True)
class Inputs:
    """Given signals over time, straight lines between their samples."""

    time: Array
    """(n,), s."""
    signals: Mapping[str, Array]

    @property
    def symbols(self) -> list[str]:
        """Symbols of an interval: its start, and of each signal the value there and the slope."""
        return [SINCE, *(f"{name}_{k}" for name in self.signals for k in ("value", "slope"))]

    def rows(self) -> list[tuple[float, ...]]:
        """Values of these symbols in every interval."""
        steps = np.diff(self.time)
        columns = [self.time[:-1]]
        for values in self.signals.values():
            columns += [values[:-1], np.diff(values) / steps]
        return [tuple(row) for row in np.array(columns).T.tolist()]


def signal(name: str) -> Expression:
    """A given signal at any time."""
    since = symbol("time") - symbol(SINCE)
    return symbol(f"{name}_value") + symbol(f"{name}_slope") * since


@dataclass(frozen=True)
class Drive:
    """The torque of the motor, as its drive reports it, and states of the drive itself."""

    torque: Expression
    states: Mapping[str, float] = field(default_factory=dict)
    """Values at the start."""
    rates: Mapping[str, Expression] = field(default_factory=dict)


RECORDED = Drive(signal("torque"))


def cascade(control: ControlSpec, holding: float) -> Drive:
    """A position loop with feed forward of the speed around a velocity loop: τ = k_v e + i, i' =
    k_v e/T with e = v_ref + k_p (q_ref − q) − v, within the torque limit, where i stays if e leads
    beyond it. ``holding``: i at the start, N m."""
    behind = signal("goal") - symbol("angle")
    error = signal("goal_speed") + number(control.position_gain) * behind - symbol("speed")
    proportional = number(control.velocity_gain) * error
    integral, duration = symbol("integral"), control.integral_time
    wanted = traced(proportional if duration is None else proportional + integral)
    limit = control.torque_limit
    torque = wanted if limit is None else np.clip(wanted, -limit, limit)
    if duration is None:
        return Drive(expression(torque))
    free = (torque == wanted) | (traced(error) * wanted < 0.0)
    growth = np.where(free, traced(proportional) / duration, 0.0)
    return Drive(expression(torque), {"integral": holding}, {"integral": expression(growth)})
