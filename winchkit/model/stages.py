"""The stages of a line, the values at each, and the inputs of a modifier."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from winchkit.arrays import Array
from winchkit.model.derivatives import SamplingTimes
from winchkit.schema.profiles.winch import WinchProfile

__all__ = [
    "OUTPUTS",
    "OUTPUT_UNITS",
    "PARTS",
    "RESULT_UNITS",
    "ROBOT_STAGES",
    "At",
    "LinePlace",
    "Modifier",
    "Path",
    "Signals",
    "Stage",
    "WinchKinematics",
]


OUTPUT_UNITS = {"cable_length": "m", "tension": "N", "motor_torque": "N m"}
"""Outputs of a winch model, in the order of reports, with their SI units."""
OUTPUTS = tuple(OUTPUT_UNITS)
RESULT_UNITS = {**OUTPUT_UNITS, "force": "N"}
"""The same of results, in which a linear axis has a force in place of the motor torque."""


class Stage(IntEnum):
    """Where a modifier acts, in the order in which the physics happens."""

    DRUM_ANGLE = 1
    """Value: :class:`Path` of the drum angle over the motor angle."""
    DRUM = 2
    """Value: the :class:`~winchkit.model.drum.Drum`."""
    WOUND = 3
    """Value: :class:`Path` of the wound length over the drum angle."""
    CABLE = 4
    """Value: length including the cable's strain, m."""
    FRAME = 5
    """Value: length at the exit point, m."""
    LENGTH_INSTRUMENT = 6
    """Value: reading of the length instrument, m."""
    LOAD = 7
    """Value: load, N, from that which the runs state: their column or ``load_mass``."""
    CABLE_WEIGHT = 8
    """Value: tension at the last pulley, N."""
    PULLEY = 9
    """Value: tension after one pulley, N; once per pulley, ``At.wrap`` and ``At.pulley`` set."""
    CELL = 10
    """Value: reading of the load cell, N."""
    GEARBOX = 11
    """Value: torque of the cable at the motor, N m."""
    MOTOR = 12
    """Value: torque with the motor's own terms, N m."""
    TORQUE_CONSTANT = 13
    """Value: torque of the motor in the drive's units, N m."""
    TORQUE_SIGNAL = 14
    """Value: torque reported by the drive, N m."""
    LINE_PLACE = 15
    """Value: :class:`LinePlace` of a robot's line."""
    HOME_LENGTH = 16
    """Value: cable of a robot's line at home, m."""
    PAYLOAD = 17
    """Value: the :class:`~winchkit.schema.profiles.robot.PlatformSpec` of a robot."""
    TRACKER = 18
    """Value: :class:`~winchkit.robot.geometry.tracker.Tracker` of a robot's poses."""


ROBOT_STAGES = frozenset({Stage.LINE_PLACE, Stage.HOME_LENGTH, Stage.PAYLOAD, Stage.TRACKER})
"""Stages of effects that only a robot can have."""


PARTS = {
    Stage.DRUM_ANGLE: "gear",
    Stage.DRUM: "drum",
    Stage.WOUND: "drum",
    Stage.CABLE: "cable",
    Stage.FRAME: "frame",
    Stage.LENGTH_INSTRUMENT: "length instrument",
    Stage.LOAD: "load",
    Stage.CABLE_WEIGHT: "cable",
    Stage.PULLEY: "pulley",
    Stage.CELL: "cell",
    Stage.GEARBOX: "gear",
    Stage.MOTOR: "motor",
    Stage.TORQUE_CONSTANT: "drive",
    Stage.TORQUE_SIGNAL: "drive",
    Stage.LINE_PLACE: "frame",
    Stage.HOME_LENGTH: "drum",
    Stage.PAYLOAD: "platform",
    Stage.TRACKER: "tracker",
}
"""Part of the machine at every stage."""


@dataclass(frozen=True)
class LinePlace:
    """Exit point and anchor point of one line of a robot, SI."""

    exit_point: Array
    """In the base frame, (3,)."""
    anchor_point: Array
    """In the platform frame, (3,)."""
    swivel_radius: float


@dataclass(frozen=True)
class Path:
    """A coordinate and its derivative by the one before it, so that torque follows length."""

    value: Array
    slope: Array


@dataclass(frozen=True)
class WinchKinematics:
    """Kinematic chain from the motor angle to the cable; every array of shape (n,)."""

    drum_angle: Array
    free_length: Array
    """Unstrained, from exit point to attachment, m."""
    arm: Array
    """Cable wound in per motor angle, m/rad."""


@dataclass(frozen=True)
class Signals:
    """Measured channels of one line; arrays of shape (n,), SI, None where not measured."""

    time: Array
    motor_angle: Array
    load: Array | None = None
    load_mass: float | None = None
    tension: Array | None = None
    temperature: Array | None = None
    motor_velocity: Array | None = None
    motor_torque: Array | None = None
    predicted_torque: Array | None = None
    """Of another model, in place of the torque of the cable, N m."""
    payload: float | None = None
    """Mass that an axis without a cable carries, as the run states, kg."""
    rate_noise: float | None = None
    """Standard deviation of the noise of the motor's rate, rad/s; None: that of its derivatives."""
    clock: SamplingTimes | None = None
    """Derivatives of the motor angle, where they were computed before; None to compute them."""


@dataclass(frozen=True)
class At:
    """Inputs of a modifier beside the value of its stage; arrays (n,), SI."""

    profile: WinchProfile
    time: Array
    """Since the run's start, s."""
    motor_angle: Array
    motor_rate: Array
    motor_acceleration: Array
    motor_direction: Array
    """Expected sign of the rate, −1 to 1; see ``winchkit.model.derivatives``."""
    drum_angle: Array
    wound_angle: Array
    speed: Array
    """Winding-in speed of the cable, m/s."""
    direction: Array
    """The same of the cable."""
    free_length: Array
    """Unstrained, from exit point to attachment, m."""
    tension: Array
    """Cable force: the load, else the cell's reading, else zero, N."""
    temperature: Array
    """degrees Celsius; NaN where not measured."""
    motor_torque: Array
    """The drive's reading, else zero, N m."""
    predicted_torque: Array | None = None
    """At the motor by another model, in place of the torque of the cable, N m."""
    payload: float | None = None
    """Mass that the run states, on the cable or on an axis without one, kg."""
    reads_cell: bool = False
    """Whether ``tension`` is the cell's reading, since no load is known."""
    pulley: int = -1
    wrap: float = 0.0

    @property
    def stressed_length(self) -> Array:
        """Free length and the stressed cable on the machine, m."""
        return self.free_length + self.profile.cable.dead_length


@dataclass(frozen=True)
class Modifier:
    """One effect with its parameter values at its stage; lower ``order`` acts first."""

    stage: Stage
    apply: Callable[[Any, At], Any]
    order: int = 0
    correct: Callable[[Any, At], Any] | None = None
    """Value before the stage from the value after it, for an instrument that is an input."""
