"""Torque of a motor from its current: torque = torque constant × current."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from winchkit.errors import Fault, RunError
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile


def with_torques(runs: Sequence[Run], profile: WinchProfile) -> list[Run]:
    """Runs with a motor torque where only the motor current was recorded.

    A RunError names a run with a current and nothing else to compare where the profile has no
    ``motor.torque_constant``.
    """
    faults: list[Fault] = []
    out = [_with_torque(run, profile, faults) for run in runs]
    if faults:
        raise RunError(faults)
    return out


def _with_torque(run: Run, profile: WinchProfile, faults: list[Fault]) -> Run:
    if "motor_current" not in run or "motor_torque" in run:
        return run
    constant = profile.motor.torque_constant
    if constant is None:
        if not {"cable_length", "tension"} & set(run):
            message = (
                f"has a motor current and no torque, and profile '{profile.name}' no torque "
                'constant; give motor.torque_constant in the profile, e.g. "0.1 N m/A"'
            )
            faults.append(Fault(message, run.path or run.name, key="column 'motor_current'"))
        return run
    current = run.channels["motor_current"]
    torque = Channel(constant * current.values, "N m", current.column)
    return replace(run, channels={**run.channels, "motor_torque": torque})
