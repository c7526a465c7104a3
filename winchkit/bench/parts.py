"""One winch as the control loop sees it: its parts, and what they know in a cycle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from winchkit.bench.controller import AxisPort, Controller
from winchkit.bench.rope import RopeMap
from winchkit.bench.snapshot import Phase, WinchSnapshot
from winchkit.bench.supervisor import Instrumented, WinchInput
from winchkit.drivers.can.axis import AxisFeedback
from winchkit.drivers.can.cia402 import State
from winchkit.drivers.reading import Reading
from winchkit.errors import ConnectionLost
from winchkit.estimation.rope_now import Sample

__all__ = ["SensorPort", "WinchParts", "known", "picture"]

_FAULTS = (State.FAULT, State.FAULT_REACTION_ACTIVE)


class SensorPort(Protocol):
    """What the loop needs of an instrument."""

    max_age: float
    """A reading older than this is stale, s."""

    @property
    def latest(self) -> Reading | None:
        """Newest reading."""

    @property
    def problem(self) -> ConnectionLost | None:
        """Why there is no new reading, while there is none."""


@dataclass
class WinchParts:
    """One winch as the loop sees it."""

    axis: AxisPort
    rope: RopeMap
    controller: Controller
    sensors: Mapping[str, SensorPort] = field(default_factory=dict)
    """By role: cell, load, length, temperature."""


def known(parts: WinchParts, now: float, sync: int) -> WinchInput:
    """What the supervisor needs to know of a winch; its rope takes the cycle's measurements."""
    axis, feedback = parts.axis, parts.axis.feedback
    length = speed = math.nan
    if feedback is not None:
        if parts.rope.bends:
            parts.rope.feel(_sample(parts, feedback, now))
        length, arm = parts.rope.at(feedback.angle)
        speed = feedback.velocity * arm
    cell = parts.sensors.get("cell")
    return WinchInput(
        feedback_age=math.inf if feedback is None else now - feedback.time,
        missed_syncs=sync if feedback is None else sync - 1 - feedback.sync,
        heartbeat_lost=axis.heartbeat.lost(now),
        boot_ups=axis.heartbeat.boot_ups,
        operational=axis.operational,
        mode_kept=axis.mode_kept,
        fault=axis.fault_text if feedback is not None and feedback.state in _FAULTS else "",
        speed=speed,
        commanded=parts.controller.commanded,
        cable_length=length,
        moving=parts.controller.phase not in (Phase.DISABLED, Phase.RESETTING),
        tension=None if cell is None else _instrumented(cell, now),
    )


def _instrumented(sensor: SensorPort, now: float) -> Instrumented:
    """Newest reading of a sensor and its age."""
    reading, problem = sensor.latest, str(sensor.problem or "")
    if reading is None:
        return Instrumented(math.nan, math.inf, sensor.max_age, "", math.nan, problem)
    return Instrumented(
        value=reading.value,
        age=now - reading.t_receive,
        max_age=sensor.max_age,
        quality=str(reading.quality),
        time=reading.t_sample,
        problem=problem,
        gross=reading.gross,
    )


def _sample(parts: WinchParts, feedback: AxisFeedback, now: float) -> Sample:
    """What the rope is judged by; NaN for a reading that is too old."""
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


def picture(parts: WinchParts, seen: WinchInput, now: float) -> WinchSnapshot:
    """The winch in this cycle, as others get to see it."""
    feedback = parts.axis.feedback
    sensors = {role: _instrumented(sensor, now) for role, sensor in parts.sensors.items()}
    fresh = {
        role: item.value if item.age <= item.max_age else math.nan for role, item in sensors.items()
    }
    quality = {
        role: item.quality if item.age <= item.max_age else "stale"
        for role, item in sensors.items()
    }
    return WinchSnapshot(
        phase=parts.controller.phase,
        state=str(State.UNKNOWN if feedback is None else feedback.state),
        time=math.nan if feedback is None else feedback.time,
        motor_angle=math.nan if feedback is None else feedback.angle,
        motor_velocity=math.nan if feedback is None else feedback.velocity,
        motor_torque=math.nan if feedback is None else feedback.torque,
        cable_length=seen.cable_length,
        speed=seen.speed,
        tension=(cell := fresh.get("cell", math.nan)),
        load=(load := fresh.get("load", math.nan)),
        rope_tension=parts.rope.tension(cell, load),
        length=fresh.get("length", math.nan),
        temperature=fresh.get("temperature", math.nan),
        quality=quality,
    )
