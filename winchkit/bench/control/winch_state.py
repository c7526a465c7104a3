"""One winch in the control loop: its parts, and their measurements in a cycle."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.controller import Controller
from winchkit.bench.control.frozen_cell import FrozenCell, PredictedTension
from winchkit.bench.control.observation import Instrumented, WinchInput
from winchkit.bench.control.snapshot import Phase, WinchSnapshot
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.feedback import AxisFeedback
from winchkit.drivers.can.cia402.state_machine import FAULTS, DriveState
from winchkit.drivers.reading import InstrumentReading, Sensor
from winchkit.errors import ConnectionLost
from winchkit.estimation.cable_state import Sample
from winchkit.schema.profiles.winch import CableSpec

_IDLE = (Phase.DISABLED, Phase.RESETTING)
_ANSWERED = 2
"""SYNC messages that a drive may leave without a TPDO before it counts as silent."""
_new = tuple.__new__
_NO_WAY = (0.0, 0.0)
_NOTHING = AxisFeedback(math.nan, 0, DriveState.UNKNOWN, 0, math.nan, math.nan, math.nan)
"""Feedback of a drive that has sent nothing yet."""


_LEAP = 2e-3
"""Of cable from one feedback to the next, m: more is another zero, or a motion that is fast."""


class WayAtRest:
    """Cable that a motor has moved, in small steps, since its winch was disabled."""

    def __init__(self) -> None:
        self._angle = math.nan
        self._way = 0.0

    def moved(self, angle: float, arm: float, *, disabled: bool) -> float:
        """Take the motor angle (rad) of a cycle, and the arm (m/rad); returns m."""
        step = (angle - self._angle) * arm
        self._angle = angle
        if not disabled:
            self._way = 0.0
        elif abs(step) <= _LEAP:
            self._way += step
        return self._way

    def forget(self) -> None:
        """A reset has shown it."""
        self._way = 0.0


@dataclass
class WinchParts:
    """Parts of one winch in the control loop."""

    axis: Cia402Axis
    cable: CableMap
    controller: Controller
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    """By role: cell, load, length, temperature."""
    frozen: FrozenCell | None = None
    """The test of its load cell, if it has one."""
    load: PredictedTension = field(default_factory=lambda: PredictedTension(math.nan))
    """Predicts the tension for that test."""
    commander: str = ""
    """Name of the client that commands it."""
    cable_spec: CableSpec = field(default_factory=CableSpec)
    """The cable as the profile declares it."""
    capacity: tuple[float, float] = (-math.inf, math.inf)
    """Least and greatest cable length that its drum can have paid out, m."""
    rested: WayAtRest = field(default_factory=WayAtRest)
    _read: tuple[Any, ...] = ()
    _instruments: Mapping[str, Instrumented] = field(default_factory=dict)

    def instruments(self, resumed: float) -> Mapping[str, Instrumented]:
        """Newest reading of each instrument; the same mapping until another one comes."""
        read = (resumed, [(sensor.latest, sensor.problem) for sensor in self.sensors.values()])
        if read != self._read:
            self._read = read
            self._instruments = {
                role: _instrumented(*seen, self.sensors[role].max_age, resumed)
                for role, seen in zip(self.sensors, read[1], strict=True)
            }
        return self._instruments


def known(parts: WinchParts, now: float, sync: int, resumed: float = -math.inf) -> WinchInput:
    """Measurements of a winch for the supervisor; the model of its cable takes them as well.

    Silence counts from ``resumed`` (s) on at the earliest: before, this computer stood still.
    """
    axis, feedback, controller = parts.axis, parts.axis.feedback, parts.controller
    phase, frozen = controller.phase, parts.frozen
    cable_length = winding_speed = arm = target_speed = math.nan
    following_error, feedback_age, missed_syncs = 0.0, math.inf, sync
    way = _NO_WAY
    fault, doubt = False, axis.position_doubt
    if feedback is not None:
        if parts.cable.has_effects:
            parts.cable.update(_sample(parts, feedback, now))
        cable_length, arm = parts.cable.at(feedback.angle)
        winding_speed = feedback.velocity * arm
        fault = feedback.state in FAULTS
        doubt = doubt or _beyond_the_drum(parts, cable_length)
        if doubt:
            cable_length = math.nan
        feedback_age = now - (feedback.time if feedback.time > resumed else resumed)
        missed_syncs = sync - 1 - feedback.sync
    # The last feedback of a silent drive must not be compared with its present command.
    follows = controller.follows and missed_syncs <= _ANSWERED
    if follows and feedback is not None:
        target_speed, following_error = controller.tracking(feedback.angle, arm)
        way = controller.way(feedback.angle, arm)
    elif feedback is not None:
        rests = phase is Phase.DISABLED
        way = 0.0, parts.rested.moved(feedback.angle, arm, disabled=rests)
    sensors = parts.instruments(resumed)
    heartbeat, operational = axis.heartbeat, axis.operational
    emergencies = () if fault else axis.alarms
    length = sensors.get("length")
    # What WinchInput(...) makes, without matching 28 keywords, which takes ten times as long.
    return _new(
        WinchInput,
        (
            feedback_age,
            missed_syncs,
            heartbeat.missing if heartbeat.lost(now, resumed) else "",
            heartbeat.boot_ups,
            operational,
            axis.mode_kept,
            axis.fault_text if fault else "",
            winding_speed,
            controller.commanded,
            cable_length,
            phase not in _IDLE,  # moving
            sensors.get("cell"),  # tension
            "" if operational else axis.nmt_text,
            controller.take_uncommanded(),
            axis.second_master.heard,
            phase is Phase.DISABLED,
            follows,
            target_speed,
            following_error,
            way,
            math.nan if length is None else _fresh(length, now),
            emergencies,
            axis.emergencies.standing if emergencies else "",
            "" if frozen is None else frozen.unstable,
            "" if frozen is None else _frozen(parts, frozen, now, winding_speed),
            doubt,
            axis.position_jump,
            axis.position.disagreement,
            sensors,
            now,
            feedback,
        ),
    )


def _beyond_the_drum(parts: WinchParts, length: float) -> str:
    """Doubt of a length that no drum of the profile can have paid out; empty for any other."""
    least, greatest = parts.capacity
    if least <= length <= greatest or math.isnan(length):
        return ""
    limit = "below zero" if length < least else f"more than the {greatest:.3f} m that its drum has"
    doubt = f"6064h would mean {length:.3f} m, which is {limit}"
    parts.axis.position.lose(doubt)
    return doubt


def _frozen(parts: WinchParts, test: FrozenCell, now: float, speed: float) -> str:
    """Evidence that the load cell is frozen, in words; empty without it."""
    cell = parts.sensors.get("cell")
    if cell is None:
        return ""
    controller = parts.controller
    predicted = parts.load.tension(now, controller.commanded, speed)
    moving = controller.phase not in _IDLE
    finding = test.update(cell.latest, now, predicted, moving=moving)
    return "" if finding is None else str(finding)


def _fresh(sensor: Instrumented, now: float) -> float:
    """Newest reading of a sensor; NaN where it is too old."""
    return sensor.value if now - sensor.received <= sensor.max_age else math.nan


def _instrumented(
    reading: InstrumentReading | None,
    trouble: ConnectionLost | None,
    max_age: float,
    resumed: float,
) -> Instrumented:
    """Newest reading of a sensor; its age counts from ``resumed`` (s) on at the earliest."""
    problem = "" if trouble is None else str(trouble)
    if reading is None:
        return Instrumented(math.nan, -math.inf, max_age, "", math.nan, problem)
    received = reading.t_receive
    return Instrumented(
        reading.value,
        max(received, resumed),
        max_age,
        str(reading.quality),
        reading.t_sample,
        problem,
        reading.gross,
        received,
    )


def _sample(parts: WinchParts, feedback: AxisFeedback, now: float) -> Sample:
    """Measurements for the model of the cable; NaN for a reading that is too old."""
    fresh = {
        role: sensor.latest.value
        for role, sensor in parts.sensors.items()
        if sensor.latest is not None and now - sensor.latest.t_receive <= sensor.max_age
    }
    return Sample(
        now,
        feedback.angle,
        feedback.velocity,
        cell=fresh.get("cell", math.nan),
        load=fresh.get("load", math.nan),
        temperature=fresh.get("temperature", math.nan),
    )


Captured = tuple[Phase, float, str, float]
"""What a winch is shown by, beside what the supervisor saw of it, as it was in a cycle: phase,
correction of the cell's reading for the tension at the platform end (N), name of its commander,
and the motor angle of corrections of its force (rad)."""


def pictures(
    inputs: Mapping[str, WinchInput], taken: Sequence[Captured], now: float
) -> dict[str, WinchSnapshot]:
    """Snapshots of the winches in the cycle at ``now`` (s)."""
    return {
        name: _picture(seen, one, now)
        for (name, seen), one in zip(inputs.items(), taken, strict=True)
    }


def _picture(seen: WinchInput, taken: Captured, now: float) -> WinchSnapshot:
    phase, correction, commander, trim = taken
    feedback = seen.feedback or _NOTHING
    fresh = {role: _fresh(item, now) for role, item in seen.sensors.items()}
    cell, load = fresh.get("cell", math.nan), fresh.get("load", math.nan)
    return WinchSnapshot(
        phase=phase,
        state=str(feedback.state),
        time=feedback.time,
        motor_angle=feedback.angle,
        motor_velocity=feedback.velocity,
        motor_torque=feedback.torque,
        cable_length=seen.cable_length,
        cable_speed=0.0 - seen.winding_speed,
        tension=cell,
        load=load,
        load_tension=load if math.isfinite(load) else cell + correction,
        length=fresh.get("length", math.nan),
        temperature=fresh.get("temperature", math.nan),
        quality={
            role: item.quality if now - item.received <= item.max_age else "stale"
            for role, item in seen.sensors.items()
        },
        length_known=not seen.length_doubt,
        commander=commander,
        commanded_speed=0.0 - seen.commanded,
        trim_angle=trim,
    )
