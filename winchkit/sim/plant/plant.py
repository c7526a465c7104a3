"""One simulated winch with its cable, pulleys, load and instruments, integrated in time."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

from winchkit.errors import UsageError
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import NoiseSpec, WinchTruth
from winchkit.sim.physics.base import HOOKS, Physics, PlantState
from winchkit.sim.physics.parameters import overridden
from winchkit.sim.physics.table import build, declared
from winchkit.sim.plant.drum import CLIMB
from winchkit.sim.plant.hanging_load import CableLoad, HangingLoad
from winchkit.sim.plant.kinematics import Kinematics
from winchkit.sim.plant.sensors import Measurement, NoisyReadings
from winchkit.sim.plant.servo import DriveCommand, Servo

MAX_STEP = 1e-3
"""s: a quarter of the servo's lag (rule of thumb)."""
_SMALLEST_INERTIA_SHARE = 0.05
"""Share of the load's mass that an elastic cable passes to the motor within a step; some remains,
so that a motor without inertia of its own stays stable (rule of thumb)."""


class WinchPlant:
    """Mechanics of one winch, integrated in short steps.

    It starts at rest, loaded, with all effects with memory at their null. Formulas and signs are
    those of the line model; the code is independent of it.

    ``cable_length``: initial cable length, m; by default that of the reference. ``longest_step``:
    of the integration, s. Raises FileError, UsageError where the truth does not match the profile.
    """

    def __init__(
        self,
        profile: WinchProfile,
        truth: WinchTruth,
        *,
        seed: int | str,
        noise: NoiseSpec | None = None,
        cable_length: float | None = None,
        load: CableLoad | None = None,
        longest_step: float = MAX_STEP,
    ) -> None:
        self._longest_step = longest_step
        nominal = Kinematics.of(profile)
        true, self._pieces = _true_winch(profile, truth)
        self._kinematics = Kinematics.of(true, CLIMB)
        self._wound_reference = self._kinematics.drum.wound(self._kinematics.wound_reference)[0]
        self._wraps = tuple(pulley.wrap for pulley in true.pulley)
        self._inertia = sum(piece.rotor_inertia() for piece in self._pieces)
        self._temperature = truth.temperature
        self._drift = truth.temperature_drift / 3600
        self._servo = Servo()
        self._bind_hooks()
        length = nominal.length_reference if cable_length is None else cable_length
        self._state = PlantState(
            temperature=truth.temperature,
            motor_angle=nominal.motor_angle(length),
            dead_length=true.cable.dead_length,
            inclination=true.path.inclination,
        )
        self._load = load or HangingLoad(truth.load_mass, 0.0)
        self._powered = False
        self._settle()
        self._instruments = NoisyReadings(noise if noise is not None else NoiseSpec(), seed)

    def _bind_hooks(self) -> None:
        bound: dict[str, list[Callable[..., Any]]] = {
            hook: [
                getattr(piece, hook)
                for piece in self._pieces
                if getattr(type(piece), hook) is not getattr(Physics, hook)
            ]
            for hook in HOOKS
        }
        self._drum_angle = bound["drum_angle"]
        self._wound_length = bound["wound_length"]
        self._compliance = bound["compliance"]
        self._stretch = bound["stretch"]
        self._weight = bound["weight"]
        self._pulley = bound["pulley"]
        self._cell = bound["cell"]
        self._gear = bound["gear"]
        self._motor = bound["motor"]
        self._torque_signal = bound["torque_signal"]
        self._length_signal = bound["length_signal"]
        self._carried_share = 1.0 if not self._compliance else _SMALLEST_INERTIA_SHARE

    # True state.

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._state.time

    @property
    def motor_angle(self) -> float:
        """rad."""
        return self._state.motor_angle

    @property
    def motor_velocity(self) -> float:
        """rad/s."""
        return self._state.motor_speed

    @property
    def motor_torque(self) -> float:
        """True torque of the motor, N m; zero while the drive is off or the brake holds."""
        return self._state.motor_torque

    @property
    def tension(self) -> float:
        """True tension at the cell, N."""
        return self._state.tension

    @property
    def load(self) -> float:
        """True tension at the platform, N."""
        return self._state.load

    @property
    def load_mass(self) -> float:
        """Mass of the load, kg."""
        return self._load.mass

    @property
    def cable_length(self) -> float:
        """True free length, m."""
        return self._state.cable_length

    @property
    def temperature(self) -> float:
        """degC."""
        return self._state.temperature

    # Inputs.

    def hang(self, mass: float) -> None:
        """Attach another load (kg), which is at rest at once; UsageError unless positive."""
        if not mass > 0:
            raise UsageError(
                f"a load of {mass:g} kg is impossible; an empty hook has some grams, 0.01 kg"
            )
        self._load.mass = mass
        self._settle()

    def warm(self, temperature: float) -> None:
        """Set the temperature (degC), from which the declared drift continues."""
        self._temperature = temperature - self._drift * self._state.time
        self._state.temperature = temperature
        self._settle()

    def advance(self, duration: float, command: DriveCommand) -> None:
        """Integrate ``duration`` s under one command; UsageError for a negative duration."""
        if not duration >= 0:
            raise UsageError(f"time cannot advance by {duration:g} s")
        count = ceil(duration / self._longest_step - 1e-9)
        for _ in range(count):
            self._step(duration / count, command)

    def measure(self) -> Measurement:
        """Read every instrument, each with new noise."""
        return self._instruments.read(
            self._state,
            motor_torque=self._torque_reading,
            tension=self._cell_reading,
            cable_length=self._length_reading,
        )

    def read(self, quantity: str) -> float:
        """Read one instrument, by the name of its quantity in :class:`Measurement`."""
        read = {"tension": self._cell_reading, "cable_length": self._length_reading}
        true: float = read.get(quantity, getattr(self._state, quantity))
        return true + self._instruments.noise(quantity, self._state.time)

    # Integration.

    def _settle(self) -> None:
        """Find the state at rest under the present load."""
        state, load = self._state, self._load
        state.motor_speed = state.motor_acceleration = 0.0
        state.winding_speed = state.winding_acceleration = 0.0
        state.load_mass = load.mass
        # The compliance depends on the cable's end, an elongation on the tension: two iterations.
        for _ in range(2):
            self._wind(0.0)
            compliance = sum(hook(state) for hook in self._compliance)
            load.rest(state.unstrained, compliance)
            state.load = load.tension
        load.rest(state.unstrained + self._stretched(0.0), compliance)
        state.cable_length = load.position
        self._pull(0.0)
        self._sense(0.0)

    def _step(self, dt: float, command: DriveCommand) -> None:
        state, load = self._state, self._load
        acceleration = self._servo.acceleration(
            command,
            angle=state.motor_angle,
            speed=state.motor_speed,
            idle_torque=self._torque_needed - self._total_inertia * state.motor_acceleration,
            inertia=self._total_inertia,
            dt=dt,
        )
        state.motor_angle += dt * (state.motor_speed + dt * acceleration / 2)
        state.motor_speed += dt * acceleration
        state.motor_acceleration = acceleration
        state.time += dt
        state.temperature = self._temperature + self._drift * state.time
        winding_speed = self._wind(dt)
        state.winding_acceleration = (winding_speed - state.winding_speed) / dt
        state.winding_speed = winding_speed
        compliance = 0.0
        for hook in self._compliance:
            compliance += hook(state)
        stretched = self._stretched(dt) if self._stretch else 0.0
        load.step(state.unstrained + stretched, -winding_speed, compliance, dt)
        state.load = load.tension
        state.cable_length = load.position
        self._powered = command.power and not command.brake
        self._pull(dt)
        self._sense(dt)

    def _wind(self, dt: float) -> float:
        """Motor angle to unstrained cable; returns the winding speed."""
        state, chain = self._state, self._kinematics
        slope, rate = 1.0, 0.0
        state.drum_angle = (state.motor_angle - chain.motor_reference) * chain.gain
        for turn in self._drum_angle:
            extra, extra_slope, extra_rate = turn(state, dt)
            state.drum_angle += extra
            slope += extra_slope
            rate += extra_rate
        state.wound_angle = chain.wound_reference + state.drum_angle
        wound, radius = chain.drum.wound(state.wound_angle)
        wound -= self._wound_reference
        for lay in self._wound_length:
            extra, extra_slope = lay(state)
            wound += extra
            radius += extra_slope
        state.arm = radius * slope * chain.gain
        state.unstrained = chain.length_reference - wound
        return state.arm * state.motor_speed + radius * rate

    def _stretched(self, dt: float) -> float:
        total = 0.0
        for hook in self._stretch:
            total += hook(self._state, dt)
        return total

    def _pull(self, dt: float) -> None:
        """Tension from the platform to the drum, and the motor torque against it."""
        state = self._state
        tension = state.load
        for weigh in self._weight:
            tension += weigh(state)
        if self._pulley:
            change = self._load.wrap_change
            for index in range(len(self._wraps) - 1, -1, -1):
                before = tension
                for rub in self._pulley:
                    tension += rub(state, index, self._wraps[index] + change, before, dt)
                change = 0.0
        state.tension = max(0.0, tension)
        torque = state.tension * state.arm
        for mesh in self._gear:
            torque = mesh(state, torque)
        for spend in self._motor:
            torque += spend(state)
        carried = state.arm * state.arm * state.load_mass
        self._total_inertia = self._inertia + self._carried_share * carried
        self._torque_needed = torque
        state.motor_torque = torque if self._powered else 0.0

    def _sense(self, dt: float) -> None:
        """Readings of the instruments without noise."""
        state = self._state
        reading = state.tension
        for sense in self._cell:
            reading = sense(state, reading, dt)
        self._cell_reading = reading
        reading = state.motor_torque
        for sense in self._torque_signal:
            reading = sense(state, reading, dt)
        self._torque_reading = reading
        reading = state.cable_length
        for sense in self._length_signal:
            reading = sense(state, reading, dt)
        self._length_reading = reading


def _true_winch(profile: WinchProfile, truth: WinchTruth) -> tuple[WinchProfile, list[Physics]]:
    """The true profile, and the effects outside it."""
    true = overridden(profile, truth.overrides)
    pieces = declared(true, build(truth.hidden))
    for piece in pieces:
        true = piece.reshape(true)
    for piece in pieces:
        piece.begin(true)
    return true, pieces
