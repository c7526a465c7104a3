"""Physics of the load cell and of the length instrument."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import exp
from typing import Annotated, ClassVar

from winchkit.schema.quantity import Force, PositiveDuration, PositiveForce, Quantity, Ratio
from winchkit.sim.physics.base import ForceDrift, Physics, PlantState, ThermalForce


@dataclass
class StretchedCell(Physics):
    """The cell's gain is wrong."""

    gain_error: Ratio = 0.02

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading * (1.0 + self.gain_error)


@dataclass
class ShiftedCell(Physics):
    """The cell's zero is wrong."""

    offset: Force = 4.0

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.offset


@dataclass
class BentCell(Physics):
    """The cell's characteristic is quadratic: ``quadratic`` N at 500 N."""

    quadratic: Force = 25.0

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.quadratic * (state.tension / 500.0) ** 2


@dataclass
class DriftingCell(Physics):
    """The cell's zero drifts with time."""

    drift: ForceDrift = 0.4

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.drift * state.time


@dataclass
class WarmCell(Physics):
    """The cell's zero depends on the temperature above 20 degC."""

    sensitivity: ThermalForce = 0.5

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.sensitivity * (state.temperature - 20.0)


@dataclass
class SlowCell(Physics):
    """The amplifier's low-pass, first order."""

    time_constant: PositiveDuration = 0.1
    _value: float | None = None

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        """First-order lag, stepped exactly for a held input."""
        if self._value is None:
            self._value = reading
        self._value += (reading - self._value) * (1.0 - exp(-dt / self.time_constant))
        return self._value


@dataclass
class ClippingCell(Physics):
    """The cell's amplifier saturates; with ``share`` below 1 its gain only decreases."""

    limit: PositiveForce = 195.0
    share: Annotated[float, Quantity("ratio", 0.0, 1.0)] = 1.0
    size: ClassVar[str] = "share"

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading - self.share * max(0.0, reading - self.limit)


@dataclass
class LeakingCurrent(Physics):
    """The motor current couples into the cell's cable."""

    share: Annotated[float, Quantity("force per torque")] = 4.0
    """N per N m of motor torque."""

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.share * state.motor_torque


@dataclass
class LateLength(Physics):
    """The length instrument has a delay of ``delay``."""

    delay: PositiveDuration = 0.003
    _past: deque[tuple[float, float]] = field(default_factory=deque)

    def length_signal(self, state: PlantState, reading: float, dt: float) -> float:
        """Interpolate the past values; before the start, the first value."""
        past = self._past
        past.append((state.time, reading))
        wanted = state.time - self.delay
        while len(past) > 2 and past[1][0] <= wanted:
            past.popleft()
        (t0, x0) = past[0]
        if wanted <= t0 or len(past) == 1:
            return x0
        (t1, x1) = past[1]
        return x0 + (x1 - x0) * (wanted - t0) / (t1 - t0)
