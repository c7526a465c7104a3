"""Requirements of effects on the data: parts of the winch, channels, and range of motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.data.dataset import Dataset
from winchkit.effects.effect import NEED_WORDS, Effect, Output
from winchkit.model.stages import Stage
from winchkit.schema.profiles.axis import AxisProfile

_PERIODS = 2
"""Periods of an order that the motor must turn through; screened."""

_LEAST_TURN = 0.5
"""Turn from which a sine differs from every straight line by a tenth of it; rule of thumb."""


def missing_needs(effect: Effect, dataset: Dataset) -> list[str]:
    """Parts and channels that an effect needs and that are absent, in words."""
    profile, recordings = dataset.profile, dataset.recordings
    is_axis = isinstance(profile, AxisProfile)
    if is_axis and effect.stage < Stage.MOTOR:
        return ["a drum with a cable; the profile is of kind 'axis'"]
    if not effect.needs:
        measured = set(effect.outputs) & set(dataset.outputs)
        return [] if measured else ["a measured " + " or ".join(effect.outputs)]
    cable = profile.cable
    has_cable = (
        bool(cable.diameter or cable.dead_length or profile.pulley)
        or profile.reference.cable_length is not None
    )
    turns = 0.0 if is_axis else _turns(dataset)
    cable_force = any(bool(r.raw.at.tension.any()) for r in recordings)
    payloads = {r.raw.at.payload for r in recordings}
    # Without a cable force a winch's drum that never turns once is what a joint is.
    is_joint = set(dataset.outputs) == {"motor_torque"} and not cable_force and turns < 1
    have = {
        "cable": has_cable,
        "layers": profile.drum.kind in {"spiral", "archimedean"},
        "guide": profile.guide is not None,
        "pulley": bool(profile.pulley),
        "temperature": all(r.signals.temperature is not None for r in recordings),
        "load": any(r.raw.load is not None for r in recordings),
        "cable_force": cable_force,
        "gearing": profile.gearbox.ratio != 1,
        "robot": False,
        "axis": (is_axis or is_joint) and not profile.is_linear,
        "ungeared": is_axis or profile.gearbox.ratio == 1,
        "half_turn": turns >= _LEAST_TURN and not is_joint,
        "torque": "motor_torque" in dataset.outputs,
        "prediction": any(r.raw.at.predicted_torque is not None for r in recordings),
        "load_mass": None not in payloads,
        "payloads": None not in payloads and len(payloads) > 1,
        "inertia": bool(profile.motor.inertia),
        "cell": any(r.raw.load is not None for r in recordings) or _tension_is_input(dataset),
    }
    lacking = [NEED_WORDS[need] for need in effect.needs if not have[need]]
    if not set(effect.outputs) & set(dataset.outputs):
        lacking.append("a measured " + " or ".join(effect.outputs))
    return lacking


def _tension_is_input(dataset: Dataset) -> bool:
    """Whether some torque is predicted from the reading of a load cell."""
    return any(r.raw.at.reads_cell and "motor_torque" in r.measured for r in dataset.recordings)


def with_inputs(effect: Effect, dataset: Dataset) -> Effect:
    """The effect; of an instrument that is an input too, it changes what the reading predicts."""
    if effect.correct is None or not _tension_is_input(dataset):
        return effect
    compared = [output for output in effect.outputs if output in dataset.outputs]
    torque: Output = "motor_torque"
    return replace(effect, outputs=tuple(dict.fromkeys((*compared, torque))))


def _turns(dataset: Dataset) -> float:
    """Turns of the drum in the run with the longest stroke."""
    return max(float(np.ptp(r.raw.at.drum_angle)) for r in dataset.recordings) / (2 * np.pi)


def excites(shape: Mapping[str, float], dataset: Dataset) -> bool:
    """Whether the motor turns through two periods of the shape's order in at least one run."""
    if "order" not in shape:
        return True
    stroke = max(float(np.ptp(r.signals.motor_angle)) for r in dataset.recordings)
    return shape["order"] * stroke >= _PERIODS * 2 * np.pi
