"""Runs of a linear axis as the model has them: 1 m for 1 rad, 1 N for 1 N m."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from winchkit.errors import Fault, RunError
from winchkit.runs.run import Run
from winchkit.schema.linear_axis import ROTARY


def is_linear(names: Iterable[str]) -> bool:
    """Whether channels are those of a linear axis: a position or a force and no motor angle."""
    own = {name.rpartition(".")[2] for name in names}
    return bool(own & {"position", "force"}) and "motor_angle" not in own


def rotary_runs(runs: Sequence[Run], *, is_linear_axis: bool) -> list[Run]:
    """Runs with the channels of the model; RunError for a run of the other kind of motion."""
    faults = []
    for run in runs:
        if is_linear_axis and "motor_angle" in run:
            message = (
                "has a motor angle, and the profile is a linear axis: give a profile without "
                'motion = "linear", or a run with position [m] and force [N]'
            )
            faults.append(Fault(message, run.path or run.name))
        elif not is_linear_axis and is_linear(run):
            message = (
                "has a position and a force, and the profile has an angle and a torque: give a "
                'profile of kind "axis" with motion = "linear", or a run with motor_angle [rad]'
            )
            faults.append(Fault(message, run.path or run.name))
    if faults:
        raise RunError(faults)
    return [_rotary(run) for run in runs] if is_linear_axis else list(runs)


def _rotary(run: Run) -> Run:
    channels = {ROTARY.get(name, name): channel for name, channel in run.channels.items()}
    metadata = dict(run.metadata)
    if "position" in metadata:
        metadata["motor_angle"] = metadata.pop("position")
    return replace(run, channels=channels, metadata=metadata)
