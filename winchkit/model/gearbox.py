"""Gearboxes: stages in a row, their ratio, efficiency both ways, and whether they lock.

Ratios are motor turns per drum turn; efficiencies are shares of power, 0 to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, nan, pi, prod, tan

from winchkit.errors import UsageError

__all__ = ["GearStage", "Gearbox", "worm_stage"]


@dataclass(frozen=True)
class GearStage:
    """One reduction."""

    ratio: float
    efficiency: float = 1.0
    """From the motor to the drum."""
    back_efficiency: float | None = None
    """From the drum to the motor; None: 2 − 1/η, the same torque lost either way."""

    @property
    def backward(self) -> float:
        """Share of the drum's power that reaches the motor; 0 where the stage holds."""
        if self.back_efficiency is not None:
            return max(0.0, self.back_efficiency)
        return max(0.0, 2.0 - 1.0 / self.efficiency)

    @property
    def self_locking(self) -> bool:
        """Whether no torque at the drum turns the motor."""
        return self.backward == 0.0


@dataclass(frozen=True)
class Gearbox:
    """Stages from the motor to the drum."""

    stages: tuple[GearStage, ...]

    @property
    def ratio(self) -> float:
        """Motor turns per drum turn."""
        return prod(stage.ratio for stage in self.stages)

    @property
    def efficiency(self) -> float:
        """From the motor to the drum."""
        return prod(stage.efficiency for stage in self.stages)

    @property
    def back_efficiency(self) -> float:
        """From the drum to the motor."""
        return prod(stage.backward for stage in self.stages)

    @property
    def self_locking(self) -> bool:
        """Whether one of the stages holds the drum without motor and brake."""
        return any(stage.self_locking for stage in self.stages)

    def motor_torque(self, drum_torque: float, *, lowering: bool = False) -> float:
        """Motor torque that moves a drum torque (N m) at a steady speed, N m.

        Lifting the motor gives more than the drum needs; lowering it holds back less. A gearbox
        that locks must be driven down, by a torque that these numbers do not tell: NaN.
        """
        if lowering:
            held = drum_torque * self.back_efficiency / self.ratio
            return nan if self.self_locking else held
        return drum_torque / (self.ratio * self.efficiency)


def worm_stage(
    starts: int, teeth: int, lead_angle: float, friction: float, pressure_angle: float = 0.0
) -> GearStage:
    """A worm (``starts`` threads) on a wheel (``teeth``): u = teeth/starts (Eq. 14, z swapped).

    ``lead_angle`` γ in rad, ``friction`` μ on the flanks, ``pressure_angle`` α_n in rad. With
    ρ = atan(μ / cos α_n): η = tan γ / tan(γ + ρ), backwards tan(γ − ρ) / tan γ; it locks for γ ≤ ρ.
    Sources: Niemann, Winter, *Maschinenelemente* III, worm gears; the same as Shigley's
    η = (cos α_n − μ tan γ)/(cos α_n + μ cot γ). Friction falls with speed, oil and vibration (Mott,
    *Machine Elements in Mechanical Design*, 8-10, counts on locking below about 5° alone): a gear
    that locks is no brake. Raises UsageError.
    """
    rub = atan(friction / cos(pressure_angle))
    if starts < 1 or teeth < 1 or friction < 0.0 or not 0.0 < lead_angle < pi / 2 - rub:
        raise UsageError(
            f"a worm with {starts} starts, {teeth} teeth, a lead angle of {lead_angle:g} rad and "
            f"friction {friction:g} cannot be; starts and teeth count from 1, friction is not "
            f"negative, the angle lies between 0 and {pi / 2 - rub:.3g} rad"
        )
    back = tan(lead_angle - rub) / tan(lead_angle) if lead_angle > rub else 0.0
    return GearStage(teeth / starts, tan(lead_angle) / tan(lead_angle + rub), back)
