"""The torque or force that another model predicts, as the channel of a run that the model reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.errors import Fault, RunError, UsageError
from winchkit.runs.columns import unit_fault
from winchkit.runs.run import Channel, Run
from winchkit.schema.mapping import CHANNEL_DIMENSIONS
from winchkit.units import factor

OF_OUTPUT = {"motor_torque": "predicted_torque", "force": "predicted_force"}
"""Channel of the prediction by the output that another model predicts."""


def with_prediction(run: Run, given: str) -> Run:
    """The run with a column as the prediction of an output; raises UsageError, RunError."""
    output, _, column = given.partition("=")
    if output not in OF_OUTPUT or not column:
        raise UsageError(
            f"--predicted: '{given}' names no prediction; write motor_torque=COLUMN, of a linear "
            "axis force=COLUMN"
        )
    if column in {output, "time"}:
        raise UsageError(f"--predicted: '{column}' is measured; name the column of your model")
    values, channel = run[column], OF_OUTPUT[output]
    unit, dimension = run.channels[column].unit, CHANNEL_DIMENSIONS[channel]
    fault = unit_fault(column, unit, dimension)
    if np.any(np.isinf(values)):
        fault = f"column '{column}' is infinite; leave the cell empty where there is no value"
    if fault:
        raise RunError(Fault(fault, run.path or run.name))
    shown = Channel(values * factor(unit, dimension), unit, run.channels[column].column)
    return replace(run, channels={**run.channels, channel: shown})
