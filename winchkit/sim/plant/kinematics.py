"""Nominal kinematics of a profile: motor angle to cable length and inverse."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.errors import UsageError
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.sim.plant.drum import PlantDrum, drum_of


@dataclass(frozen=True)
class Kinematics:
    """Rigid cable on a drum behind a gearbox; angles of the motor in rad, lengths in m."""

    drum: PlantDrum
    gain: float
    """Drum radians per motor radian, signed by the gearbox's direction."""
    motor_reference: float
    wound_reference: float
    """Total wound angle at the reference, rad."""
    length_reference: float

    @classmethod
    def of(cls, profile: WinchProfile, climb: float = 0.0) -> Kinematics:
        """Kinematics of a profile; raises UsageError where reference.cable_length is missing."""
        length = profile.reference.cable_length
        if length is None:
            raise UsageError(
                f"{profile.name}: reference.cable_length is missing; it is needed here"
            )
        return cls(
            drum_of(profile, climb),
            profile.gearbox.direction / profile.gearbox.ratio,
            profile.reference.motor_angle,
            2 * pi * profile.reference.wound_turns,
            length,
        )

    def motor_angle(self, cable_length: float) -> float:
        """Motor angle at which the free cable has this length."""
        wound = self.drum.wound(self.wound_reference)[0] + self.length_reference - cable_length
        return (self.drum.angle(wound) - self.wound_reference) / self.gain + self.motor_reference

    def cable_length(self, motor_angle: float) -> float:
        """Free length at a motor angle."""
        angle = self.wound_reference + (motor_angle - self.motor_reference) * self.gain
        wound = self.drum.wound(angle)[0] - self.drum.wound(self.wound_reference)[0]
        return self.length_reference - wound

    def arm(self, motor_angle: float) -> float:
        """Cable wound in per motor radian, m/rad; negative with a reversing gearbox."""
        angle = self.wound_reference + (motor_angle - self.motor_reference) * self.gain
        return self.drum.wound(angle)[1] * self.gain
