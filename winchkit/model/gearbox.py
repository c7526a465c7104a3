"""A worm gear: its ratio, efficiency in both directions, and self-locking.

Ratios are motor turns per drum turn; efficiencies are shares of power, 0 to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, pi, tan

from winchkit.errors import UsageError


@dataclass(frozen=True)
class GearStage:
    """One reduction."""

    ratio: float
    efficiency: float
    """From the motor to the drum."""
    backward: float
    """From the drum to the motor: share of the drum's power that reaches the motor."""

    @property
    def self_locking(self) -> bool:
        """Whether a torque at the drum cannot turn the motor."""
        return self.backward == 0.0


def worm_stage(
    starts: int, teeth: int, lead_angle: float, friction: float, pressure_angle: float = 0.0
) -> GearStage:
    """Stage of a worm and a worm wheel, u = teeth/starts (Eq. 14 with z1 and z2 exchanged). Raises
    UsageError for values outside their ranges.

    With the lead angle γ and ρ = atan(μ / cos α_n): η = tan γ / tan(γ + ρ), from wheel to worm
    tan(γ − ρ) / tan γ; the stage is self-locking for γ ≤ ρ. Friction decreases with speed, oil and
    vibration (Mott, *Machine Elements in Mechanical Design*, 8-10, relies on self-locking below
    about 5° only): a self-locking gear is no brake. Niemann, Winter, *Maschinenelemente* III;
    Shigley's η = (cos α_n − μ tan γ)/(cos α_n + μ cot γ) is the same.
    """
    friction_angle = atan(friction / cos(pressure_angle))
    if starts < 1 or teeth < 1 or friction < 0.0 or not 0.0 < lead_angle < pi / 2 - friction_angle:
        raise UsageError(
            f"a worm with {starts} starts, {teeth} teeth, a lead angle of {lead_angle:g} rad and "
            f"friction {friction:g} is impossible; starts and teeth must be at least 1, friction "
            f"at least 0, and the angle between 0 and {pi / 2 - friction_angle:.3g} rad"
        )
    forward = tan(lead_angle) / tan(lead_angle + friction_angle)
    back = max(0.0, tan(lead_angle - friction_angle) / tan(lead_angle))
    return GearStage(teeth / starts, forward, back)
