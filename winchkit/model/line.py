"""The line: one winch and its cable, from motor angle to cable length and from load to torque.

Two chains of computation pass the same parts: motor angle, gearbox, drum, guide, cable, frame,
cable length; and load, cable weight, pulleys, load cell, drum, gearbox, motor torque. Each has
stages (:class:`~winchkit.model.stages.Stage`) at which the modifier of an effect may act. Without
modifiers the line is the nominal profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.model.derivatives import SamplingTimes, direction
from winchkit.model.drum import Drum, drum_of
from winchkit.model.stages import At, Modifier, Path, Signals, Stage, WinchKinematics
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.units import GRAVITY

CREEP_SPEED = 1e-3
"""m/s, and with `_CREEP_RATE`, rad/s at the motor, the rates that always have a direction, whatever
their noise. Rule of thumb: below the slowest programmed speed."""
_CREEP_RATE = 0.5
"""rad/s: 5 turns a minute of the motor; see `CREEP_SPEED`."""
_NEWTON_STEPS = 4
"""Each step multiplies the error by the share by which elongation and periodic errors change the
slope, at most some per cent: four reach 1e-7 of the start's error of some centimetres."""


@dataclass(frozen=True)
class Motion:
    """The nominal line along one run, computed once: inputs of the modifiers, and the load."""

    at: At
    clock: SamplingTimes
    load: Array | None
    """Tension at the platform end, N, where measured or known."""
    drum_tension: Array | None
    """The cell's reading, used as the drum-side tension where no load is known, N."""
    load_mass: float | None = None
    """Mass from whose acceleration the load is computed, kg, where no instrument measures it."""
    discretization: Array | None = None
    """Curvature of that load over the span of its differences, N: bound of its smoothing error."""
    smoothed_share: float = 0.0
    """Share, 0 to 1, of second differences in that load's acceleration by the effects."""
    load_std: Array | None = None
    """Standard deviation of that load from the acceleration's, N; None for even samples."""


@dataclass(frozen=True)
class Line:
    """A profile with modifiers: predicts the readings of a winch's instruments."""

    profile: WinchProfile
    modifiers: Sequence[Modifier] = ()

    @cached_property
    def _stages(self) -> dict[Stage, list[Modifier]]:
        stages: dict[Stage, list[Modifier]] = {}
        for modifier in sorted(self.modifiers, key=lambda m: (m.stage, m.order)):
            stages.setdefault(modifier.stage, []).append(modifier)
        return stages

    def _through(self, stage: Stage, value: Any, at: At) -> Any:
        for modifier in self._stages.get(stage, ()):
            value = modifier.apply(value, at)
        return value

    def _force(self, force: Any, at: At) -> Any:
        """Cable force from the one that the runs state or, where none is, from the cell's reading,
        of which the cell's effects are undone, the last first."""
        if not at.reads_cell:
            return self._through(Stage.LOAD, force, at)
        for modifier in reversed(self._stages.get(Stage.CELL, ())):
            if modifier.correct is not None:
                force = modifier.correct(force, at)
        return force

    def _under_force(self, at: At) -> At:
        """Inputs with the corrected cable force."""
        force = self._force(at.tension, at)
        return at if force is at.tension else replace(at, tension=force)

    @cached_property
    def _drum(self) -> Drum:
        return drum_of(self.profile)

    @property
    def _reference_wound(self) -> float:
        return 2 * np.pi * self.profile.reference.wound_turns

    def _nominal_length(self, motor_angle: Array) -> tuple[Array, Array]:
        """Drum angle and free length of the nominal profile."""
        drum_angle = self._gear(motor_angle).value
        phi = self._reference_wound
        wound = self._drum.wound(phi + drum_angle) - self._drum.wound(np.asarray(phi))
        return drum_angle, (self.profile.reference.cable_length or 0.0) - wound

    def _nominal_arm(self, motor_angle: Array) -> Array:
        """Cable wound in per motor angle on the nominal profile, m/rad."""
        gear = self._gear(motor_angle)
        return np.asanyarray(self._drum.arm(self._reference_wound + gear.value) * gear.slope)

    def _gear(self, motor_angle: Array) -> Path:
        gearbox = self.profile.gearbox
        slope = gearbox.direction / gearbox.ratio
        turned = (motor_angle - self.profile.reference.motor_angle) * slope
        return Path(turned, np.full_like(turned, slope))

    def motion(self, signals: Signals) -> Motion:
        """Derivatives, directions and cable force along a run."""
        time, angle = signals.time, signals.motor_angle
        drum_angle, length = self._nominal_length(angle)
        clock = signals.clock or SamplingTimes(time - time[0], angle, signals.motor_velocity)
        arm, rate = self._nominal_arm(angle), clock.rate
        speed = arm * (rate - clock.gradient(angle)) - clock.gradient(length)
        load, mass, discretization, load_std = signals.load, None, None, None
        if load is None and signals.load_mass is not None:
            mass = signals.load_mass
            from_angle = clock.measured_rate is None
            length_acceleration = (
                clock.second_derivative(length) if from_angle else -clock.wide_gradient(speed)
            )
            load = mass * (GRAVITY - length_acceleration)
            discretization = clock.curvature(load)
            if mass and clock.acceleration_std is not None:
                load_std = mass * np.abs(arm) * clock.acceleration_std
        tension = load if load is not None else signals.tension
        missing, zero = np.full_like(time, np.nan), np.zeros_like(time)
        noise = clock.rate_noise if signals.rate_noise is None else signals.rate_noise
        cable_noise = noise * float(np.max(np.abs(arm), initial=0.0))
        at = At(
            profile=self.profile,
            time=clock.time,
            motor_angle=angle,
            motor_rate=rate,
            motor_acceleration=clock.acceleration,
            motor_direction=direction(rate, noise, _CREEP_RATE),
            drum_angle=drum_angle,
            wound_angle=self._reference_wound + drum_angle,
            speed=speed,
            direction=direction(speed, cable_noise, CREEP_SPEED),
            free_length=length,
            tension=zero if tension is None else tension,
            temperature=missing if signals.temperature is None else signals.temperature,
            motor_torque=zero if signals.motor_torque is None else signals.motor_torque,
            predicted_torque=signals.predicted_torque,
            payload=mass if mass is not None else signals.payload,
            reads_cell=load is None and signals.tension is not None,
        )
        drum_tension = signals.tension if load is None else None
        return Motion(at, clock, load, drum_tension, mass, discretization, load_std=load_std)

    def predict(self, motion: Motion) -> dict[str, Array]:
        """Predict ``cable_length``, ``motor_torque`` and, with a known load, ``tension``, (n,)."""
        at = motion.at
        kinematics = self.kinematics(at)
        out = {"cable_length": self.indicated_length(at, kinematics)}
        drum_side = self.drum_side(motion, kinematics)
        if motion.load is not None:
            out["tension"] = self.indicated_tension(at, drum_side)
        out["motor_torque"] = self.indicated_torque(at, kinematics, drum_side)
        return out

    def kinematics(self, at: At) -> WinchKinematics:
        """Drum angle, wound length and arm from the motor angle, by gearbox, drum and guide."""
        at = self._under_force(at)
        turned = self._through(Stage.DRUM_ANGLE, self._gear(at.motor_angle), at)
        wound_angle = self._reference_wound + turned.value
        at = replace(at, drum_angle=turned.value, wound_angle=wound_angle)
        drum = self._through(Stage.DRUM, self._drum, at)
        wound = drum.wound(wound_angle) - drum.wound(np.asarray(self._reference_wound))
        path = self._through(Stage.WOUND, Path(wound, drum.arm(wound_angle)), at)
        free = (self.profile.reference.cable_length or 0.0) - path.value
        return WinchKinematics(turned.value, free, path.slope * turned.slope)

    def indicated_length(self, at: At, kinematics: WinchKinematics) -> Array:
        """Reading of the length instrument, m."""
        at = replace(
            self._under_force(at),
            drum_angle=kinematics.drum_angle,
            wound_angle=self._reference_wound + kinematics.drum_angle,
            free_length=kinematics.free_length,
        )
        length: Array = kinematics.free_length
        for stage in (Stage.CABLE, Stage.FRAME, Stage.LENGTH_INSTRUMENT):
            length = self._through(stage, length, at)
        return length

    def _load(self, motion: Motion, kinematics: WinchKinematics) -> Array:
        """Load of a known mass that moves with the cable, kinematic effects included. The speed is
        the arm times the motor's rate, so that a ripple of the arm is differentiated once only;
        motions that do not pass through the arm are differentiated from the length. The
        acceleration by the cable's strain is left out: it would need the fourth derivative of the
        angle, which is mostly noise."""
        load = motion.load
        assert load is not None
        if motion.load_mass is None or not any(m.stage <= Stage.WOUND for m in self.modifiers):
            return load
        at, clock = motion.at, motion.clock
        longer = kinematics.free_length - at.free_length
        speed = clock.sharp_gradient(longer)
        if clock.spline is not None:
            added = clock.sharp_gradient(speed)  # Linear: what is paid out would cancel.
        else:
            paid_out = (self._nominal_arm(at.motor_angle) - kinematics.arm) * at.motor_rate
            added = clock.sharp_gradient(paid_out) + clock.wide_gradient(speed - paid_out)
        if motion.smoothed_share:
            twice = clock.differences(clock.differences(longer))
            added = added + motion.smoothed_share * (twice - added)
        return load - motion.load_mass * added

    def drum_side(self, motion: Motion, kinematics: WinchKinematics) -> Array:
        """Tension at the drum: from the load along the cable and over the pulleys, N."""
        at = motion.at
        if motion.load is None:
            reading = motion.drum_tension
            return np.zeros_like(at.time) if reading is None else self._force(reading, at)
        return self.drum_tension(self._load(motion, kinematics), at)

    def drum_tension(self, load: Array, at: At) -> Array:
        """Tension at the drum from the tension at the platform, N."""
        tension, at = self._force(load, at), self._under_force(at)
        tension = self._through(Stage.CABLE_WEIGHT, tension, at)
        if Stage.PULLEY in self._stages:
            for index in reversed(range(len(self.profile.pulley))):
                here = replace(at, pulley=index, wrap=self.profile.pulley[index].wrap)
                tension = self._through(Stage.PULLEY, tension, here)
        return np.asanyarray(tension)

    def indicated_tension(self, at: At, drum_side: Array) -> Array:
        """Reading of the load cell, N."""
        return np.asanyarray(self._through(Stage.CELL, drum_side, self._under_force(at)))

    def indicated_torque(self, at: At, kinematics: WinchKinematics, drum_side: Array) -> Array:
        """Reported torque by virtual work: cable force times derivative of wound length, N m."""
        torque, at = drum_side * kinematics.arm, self._under_force(at)
        if at.predicted_torque is not None:
            torque = at.predicted_torque
        for stage in (Stage.GEARBOX, Stage.MOTOR, Stage.TORQUE_CONSTANT, Stage.TORQUE_SIGNAL):
            torque = self._through(stage, torque, at)
        return torque

    def moments(
        self,
        time: Array,
        motor_angle: Array,
        motor_rate: Array,
        tension: Array,
        temperature: Array,
    ) -> At:
        """Inputs of the modifiers for single samples (n,) without a time series, SI and degC.
        Accelerations are zero, and directions smooth below the creep rates, so that a controller's
        friction has no step at standstill."""
        drum_angle, length = self._nominal_length(motor_angle)
        speed = self._nominal_arm(motor_angle) * motor_rate
        return At(
            profile=self.profile,
            time=time,
            motor_angle=motor_angle,
            motor_rate=motor_rate,
            motor_acceleration=np.zeros_like(time),
            motor_direction=np.tanh(motor_rate / _CREEP_RATE),
            drum_angle=drum_angle,
            wound_angle=self._reference_wound + drum_angle,
            speed=speed,
            direction=np.tanh(speed / CREEP_SPEED),
            free_length=length,
            tension=tension,
            temperature=temperature,
            motor_torque=np.zeros_like(time),
        )

    def lengths(self, at: At) -> Array:
        """True cable length with every effect up to the frame, m, shape (n,)."""
        return self.indicated_length(at, self.kinematics(at))

    def readings(self, load: Array, at: At) -> Array:
        """Readings of the load cell under tensions at the platform end, N, shape (n,)."""
        return self.indicated_tension(at, self.drum_tension(load, at))

    def cable_length(self, motor_angle: float, tension: float = 0.0) -> float:
        """Cable length at rest at a motor angle under a tension, effects included, m."""
        at = self.at_rest(motor_angle, tension)
        return float(self.indicated_length(at, self.kinematics(at))[0])

    def arm(self, motor_angle: float) -> float:
        """Cable wound in per motor angle, signed by the gearbox's direction, m/rad."""
        return float(self.kinematics(self.at_rest(motor_angle)).arm[0])

    def nominal_motor_angle(self, cable_length: Array) -> Array:
        """Motor angles of the nominal line at cable lengths (m), any shape, rad."""
        profile, phi = self.profile, self._reference_wound
        wound = (profile.reference.cable_length or 0.0) - cable_length
        total = self._drum.angle(self._drum.wound(np.asarray(phi)) + wound)
        gear = profile.gearbox
        turned = gear.direction * gear.ratio * (total - phi)
        return np.asanyarray(profile.reference.motor_angle + turned)

    def motor_angle(self, cable_length: float, tension: float = 0.0) -> float:
        """Motor angle at a cable length (m) under a tension (N), rad; with effects by Newton's
        method from the closed form of the nominal line."""
        angle = float(self.nominal_motor_angle(np.asarray(cable_length)))
        for _ in range(_NEWTON_STEPS if self.modifiers else 0):
            excess = self.cable_length(angle, tension) - cable_length
            angle += excess / self.arm(angle)
        return angle

    def at_rest(
        self,
        motor_angle: Array | float,
        tension: Array | float = 0.0,
        temperature: Array | float = 20.0,
    ) -> At:
        """Samples at rest, (n,), N and degrees Celsius."""
        angle = np.atleast_1d(np.asarray(motor_angle, dtype=float))
        zero = np.zeros_like(angle)
        return self.moments(zero, angle, zero, zero + tension, zero + temperature)

    def lengths_and_arms(self, at: At) -> tuple[Array, Array]:
        """Cable lengths at rest, (n,), m, and cable wound in per motor angle there, m/rad."""
        kinematics = self.kinematics(at)
        return self.indicated_length(at, kinematics), kinematics.arm

    @property
    def drum(self) -> Drum:
        """The drum with its modifiers."""
        drum: Drum = self._through(Stage.DRUM, self._drum, self.at_rest(0.0))
        return drum
