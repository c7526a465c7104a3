"""Place of a step: part, output and variable, of an answer that says it or by the effect's id."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Place = tuple[str, str, str]
"""Part, output, variable; the last is empty where it is unknown or there is none."""

_PARTS = {
    "motor": "motor_torque",
    "gear": "motor_torque",
    "pulley": "tension",
    "cell": "tension",
    "cable": "cable_length",
    "drum": "cable_length",
    "guide": "cable_length",
    "frame": "cable_length",
}
_OTHERS = {
    "gear-backlash": ("gear", "cable_length", "direction"),
    "gear-ratio": ("gear", "cable_length", "motor_angle"),
    "gear-transmission-error": ("gear", "cable_length", "motor_angle"),
    "cable-weight": ("cable", "tension", "cable_length"),
    "load-lever": ("load", "tension", "drum_angle"),
    "drum-unbalance": ("drum", "motor_torque", "drum_angle"),
    "drum-winding-tension": ("drum", "cable_length", ""),
    "encoder-slip": ("encoder", "cable_length", "time"),
    "layer-thickness": ("drum", "cable_length", "drum_angle"),
    "length-time-offset": ("length", "cable_length", "speed"),
    "friction-at-place": ("motor", "motor_torque", "drum_angle"),
    "friction-growth": ("motor", "motor_torque", "time"),
    "joint-gravity": ("motor", "motor_torque", "motor_angle"),
    "rotor-inertia": ("motor", "motor_torque", "acceleration"),
    "pulley-inertia": ("pulley", "tension", "acceleration"),
    "spring-balancer": ("motor", "motor_torque", "drum_angle"),
    "motor-cogging": ("motor", "motor_torque", "motor_angle"),
    "motor-coulomb-asymmetry": ("motor", "motor_torque", ""),
    "torque-constant": ("motor", "motor_torque", "load"),
    "torque-lag": ("signal", "motor_torque", ""),
    "torque-lead": ("signal", "motor_torque", ""),
    "torque-ripple": ("motor", "motor_torque", "motor_angle"),
}
"""Where the id's first word does not say it."""
VARIABLES = frozenset({"", "speed", "direction", "velocity", "motor_velocity", "reversal_distance"})
"""Of friction; that of a law with memory is none."""


def places(step: Mapping[str, Any]) -> set[Place]:
    """All places that a step names; of an answer without them those of its effects."""
    said = step.get("place")
    if said:
        return {
            (str(p["part"]), str(p["output"]), str(p.get("variable") or ""))
            if isinstance(p, Mapping)
            else (str(p[0]), str(p[1]), str(p[2] or ""))
            for p in said
        }
    return {_of_id(effect) for effect in step["effects"]}


def _of_id(effect: str) -> Place:
    if effect in _OTHERS:
        return _OTHERS[effect]
    part = effect.partition("-")[0]
    return part, _PARTS.get(part, ""), ""


def is_certain(step: Mapping[str, Any]) -> bool:
    """Whether a name is certain; of an answer that does not say it, one member alone."""
    if step.get("certain") is not None:
        return bool(step["certain"])
    return len(step["effects"]) == 1
