"""Measured and predicted outputs of every run, as figures and tables of a result show them.

Both are within the band of the comparison: a torque is low-passed as it was for the fit. Samples
that are not compared are NaN.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import low_pass
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.tabular import Columns


@dataclass(frozen=True)
class OutputTrace:
    """One output of one run over time, SI, (n,) each; NaN where it is not compared."""

    run: str
    output: str
    unit: str
    time: Array
    """Since the run's start, s."""
    measured: Array
    predicted: Array
    """By the profile; after a diagnosis by the model with the named effects."""
    before: Array | None = None
    """Predicted by the profile, where effects were named."""

    @property
    def residual(self) -> Array:
        """Measured less predicted."""
        return self.measured - self.predicted

    @property
    def residual_before(self) -> Array | None:
        """Measured less predicted by the profile; None where no effect was named."""
        return None if self.before is None else self.measured - self.before


@dataclass(frozen=True)
class PoseTrace:
    """Errors of one output of a robot at every pose, SI, (p, k): lines, or axes of the platform."""

    output: str
    unit: str
    names: tuple[str, ...]
    """Of the k columns."""
    residual: Array
    """Measured less predicted; NaN where it was not measured."""
    residual_before: Array | None = None
    """By the profile, where effects were named."""


def traces_of(
    regression: TimeSeriesRegression, residual: Array, before: Array | None = None
) -> tuple[OutputTrace, ...]:
    """Traces of every output of every run, from residuals that are measured less predicted.

    ``before`` is the residual of the profile, where effects were named.
    """
    after = regression.in_time(residual)
    first = None if before is None else regression.in_time(before)
    out = []
    for index, segment in enumerate(regression.segments):
        recording, output = regression.dataset.recordings[segment.run], segment.output
        band, there = recording.bands[output], recording.valid[output]
        measured = recording.measured[output]
        if band.cut_off is not None:
            measured = low_pass(measured, band.rate, band.cut_off)
        measured = np.where(there, measured, np.nan)
        time = recording.signals.time
        out.append(
            OutputTrace(
                recording.name,
                output,
                OUTPUT_UNITS[output],
                time - time[0],
                measured,
                measured - after[index],
                None if first is None else measured - first[index],
            )
        )
    return tuple(out)


def pose_traces(
    names: Mapping[str, Sequence[str]],
    units: Mapping[str, str],
    errors: Mapping[str, Array],
    before: Mapping[str, Array] | None = None,
) -> tuple[PoseTrace, ...]:
    """Traces of a robot's errors by output; ``names`` are those of their columns."""
    return tuple(
        PoseTrace(
            output,
            units[output],
            tuple(names[output]),
            error,
            None if before is None else before.get(output),
        )
        for output, error in errors.items()
    )


def trace_columns(traces: Sequence[OutputTrace | PoseTrace]) -> Columns:
    """Traces below each other, for pandas and Arrow: one row per sample, or per pose and column."""
    of_runs = [trace for trace in traces if isinstance(trace, OutputTrace)]
    of_poses = [trace for trace in traces if isinstance(trace, PoseTrace)]
    return _pose_columns(of_poses) if of_poses else _run_columns(of_runs)


def _run_columns(traces: Sequence[OutputTrace]) -> Columns:
    count = [len(trace.time) for trace in traces]
    values: dict[str, Any] = {
        "output": np.repeat([trace.output for trace in traces], count).tolist(),
        "run": np.repeat([trace.run for trace in traces], count).tolist(),
        "time": _joined([trace.time for trace in traces]),
        "measured": _joined([trace.measured for trace in traces]),
        "predicted": _joined([trace.predicted for trace in traces]),
        "residual": _joined([trace.residual for trace in traces]),
    }
    if any(trace.before is not None for trace in traces):
        before = [trace.predicted if trace.before is None else trace.before for trace in traces]
        values["predicted_before"] = _joined(before)
    units = {trace.output: trace.unit for trace in traces}
    return Columns(values, {"time": "s"}, {"units": units}, ("output", "run", "time"))


def _pose_columns(traces: Sequence[PoseTrace]) -> Columns:
    rows: dict[str, list[object]] = {n: [] for n in ("output", "line", "pose", "residual")}
    has_before = any(trace.residual_before is not None for trace in traces)
    if has_before:
        rows["residual_before"] = []
    for trace in traces:
        for column, name in enumerate(trace.names):
            error = trace.residual[:, column].tolist()
            rows["output"] += [trace.output] * len(error)
            rows["line"] += [name] * len(error)
            rows["pose"] += range(1, len(error) + 1)
            rows["residual"] += error
            if has_before:
                first = trace.residual if trace.residual_before is None else trace.residual_before
                rows["residual_before"] += first[:, column].tolist()
    units = {trace.output: trace.unit for trace in traces}
    return Columns(rows, {}, {"units": units}, ("output", "line", "pose"))


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate([np.zeros(0), *parts])
