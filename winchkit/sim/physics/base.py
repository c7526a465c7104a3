"""Base class of the simulator's physics: the true state, parameters, hooks in the two chains."""

from __future__ import annotations

from dataclasses import dataclass
from math import tanh
from typing import Annotated, ClassVar

from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.quantity import Quantity

Stiffness = Annotated[float, Quantity("stiffness", 0.0, above=True)]
Viscosity = Annotated[float, Quantity("viscosity")]
RotationalViscosity = Annotated[float, Quantity("rotational viscosity")]
Expansion = Annotated[float, Quantity("expansion")]
ForceDrift = Annotated[float, Quantity("force per time")]
ThermalForce = Annotated[float, Quantity("force per temperature")]

_CABLE_STANDSTILL = 2e-5
"""m/s: friction changes its direction within it, a twentieth of the slowest speed of a programme;
the drum follows the servo whatever the friction, so that its direction may be as sharp."""
_MOTOR_STANDSTILL = 0.01
"""rad/s: the same for friction of the motor, by a gearbox of 20 and a radius of 60 mm (0.03 mm/s).
"""


@dataclass(slots=True)
class PlantState:
    """Present true state; SI, mutable, owned by the plant."""

    time: float = 0.0
    temperature: float = 20.0
    """degC."""
    motor_angle: float = 0.0
    motor_speed: float = 0.0
    motor_acceleration: float = 0.0
    drum_angle: float = 0.0
    """Since the reference, positive winds in, rad."""
    wound_angle: float = 0.0
    """Total on the drum, rad."""
    arm: float = 0.0
    """Cable wound in per motor radian, m/rad, signed."""
    winding_speed: float = 0.0
    """Positive winds in, m/s."""
    winding_acceleration: float = 0.0
    unstrained: float = 0.0
    """Unstrained free cable length, m."""
    dead_length: float = 0.0
    inclination: float = 0.0
    cable_length: float = 0.0
    """From the exit point to the attachment, m."""
    load_mass: float = 0.0
    load: float = 0.0
    """Tension at the platform, N."""
    tension: float = 0.0
    """Tension between the pulleys and the drum, N."""
    motor_torque: float = 0.0
    """True torque of the motor, N m."""


def winding_direction(state: PlantState) -> float:
    """Direction of the cable, +1 winding in, sharp to about 0.02 mm/s of standstill."""
    return tanh(state.winding_speed / _CABLE_STANDSTILL)


def motor_direction(state: PlantState) -> float:
    """Direction of the motor, sharp to about 0.01 rad/s of standstill."""
    return tanh(state.motor_speed / _MOTOR_STANDSTILL)


@dataclass
class Physics:
    """One effect; its fields are the parameters in files, with typical defaults.

    The plant calls only overridden hooks, in the order of the table of physics. Objects may have
    state; every plant has its own objects.
    """

    size: ClassVar[str] = ""
    """The field of its size: the first one unless declared; empty where it has no null."""
    inverse: ClassVar[bool] = False
    """Whether a larger ``size`` is a smaller effect (a stiffness)."""

    def __init_subclass__(cls) -> None:
        """Take the first field as that of the size, where none is declared."""
        if "size" not in vars(cls):
            cls.size = next(iter(cls.__annotations__))

    def reshape(self, profile: WinchProfile) -> WinchProfile:
        """Return the true profile; called once."""
        return profile

    def begin(self, profile: WinchProfile) -> None:
        """Read values of the true profile; called once, after every ``reshape``."""

    def rotor_inertia(self) -> float:
        """Inertia that the motor accelerates in addition to the load, kg m²."""
        return 0.0

    def drum_angle(self, state: PlantState, dt: float) -> tuple[float, float, float]:
        """Angle added to the drum angle, its slope by the drum angle, and its rate in time."""
        raise NotImplementedError

    def wound_length(self, state: PlantState) -> tuple[float, float]:
        """Length added to the wound length, and its slope by the drum angle, m and m/rad."""
        raise NotImplementedError

    def compliance(self, state: PlantState) -> float:
        """Elongation per tension at the platform, m/N."""
        raise NotImplementedError

    def stretch(self, state: PlantState, dt: float) -> float:
        """Elongation other than that of a linear spring, m."""
        raise NotImplementedError

    def weight(self, state: PlantState) -> float:
        """Tension added between the platform and the pulleys, N."""
        raise NotImplementedError

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        """Tension added by one pulley, wrap in rad, to that on its platform side, N."""
        raise NotImplementedError

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        """Reading of the load cell after this effect, N."""
        raise NotImplementedError

    def gear(self, state: PlantState, torque: float) -> float:
        """Torque at the motor that carries ``torque`` of the cable, N m."""
        raise NotImplementedError

    def motor(self, state: PlantState) -> float:
        """Torque for the motor itself, N m."""
        raise NotImplementedError

    def torque_signal(self, state: PlantState, reading: float, dt: float) -> float:
        """Torque reported by the drive after this effect, N m."""
        raise NotImplementedError

    def length_signal(self, state: PlantState, reading: float, dt: float) -> float:
        """Reading of the length instrument after this effect, m."""
        raise NotImplementedError


HOOKS = (
    "drum_angle",
    "wound_length",
    "compliance",
    "stretch",
    "weight",
    "pulley",
    "cell",
    "gear",
    "motor",
    "torque_signal",
    "length_signal",
)
