"""Errors of poses over the variable that explains the largest share of each output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.model.variables import VARIABLE_UNITS
from winchkit.report.figures.reduction import bin_means, filled_edges
from winchkit.robot.diagnosis.attribution import (
    AXES,
    most_significant,
    on_cables,
    pose_attributions,
    variables_of_poses,
)
from winchkit.robot.diagnosis.diagnose import RobotAnswer
from winchkit.robot.diagnosis.errors import UNITS, Errors
from winchkit.robot.diagnosis.regression import PoseRegression

NUMBER = "number"
"""Number of the pose, for an error that no variable explains."""
_BINS = 12
"""Bins over a variable: about eight poses in each of a hundred."""
_DIGITS = 5
"""Significant digits, more than a pixel resolves."""
_POOLED = ("winch", "pose", NUMBER)
"""Variables for which all lines are drawn; else the line with the largest share."""


@dataclass(frozen=True)
class PoseErrorTrace:
    """Errors of one output along one variable, SI; a value per pose and line, or axis."""

    over: Attribution
    x: Array
    """(k,), finite."""
    before: Array
    """Measured less predicted, (k,)."""
    after: Array | None = None
    line: str | None = None
    """The drawn line or axis; None for all."""

    def means(self, values: Array) -> tuple[Array, Array]:
        """Mean of the variable and of an error in every bin."""
        edges = filled_edges(self.x, _BINS)
        if self.over.variable == "winch":
            edges = np.unique(self.x)[:-1] + 0.5
        centres, (mean,) = bin_means(self.x, [values], edges)
        return centres, mean

    def to_json(self, values: Array) -> dict[str, Any]:
        """Mean of an error as the commands print it."""
        x, mean = self.means(values)
        return {
            "output": self.over.output,
            "variable": self.over.variable,
            "unit": unit_of(self.over.variable),
            "line": self.line,
            "share": self.over.share,
            "x": [float(f"{v:.{_DIGITS}g}") for v in x],
            "mean": [float(f"{v:.{_DIGITS}g}") for v in mean],
        }


def traces_json(answer: RobotAnswer) -> dict[str, Any]:
    """Errors over the variables to which they were attributed, before and after."""
    selection = answer.selection
    drawn = traces(selection.final.regression, *selection.errors)
    after = [t.to_json(t.after) for t in drawn if t.after is not None]
    before = [t.to_json(t.before) for t in drawn]
    return {"residuals": {"before": before, "after": after if answer.diagnosis.steps else None}}


def unexplained_curve(answer: RobotAnswer, where: Attribution) -> tuple[Array, Array]:
    """Mean of the variable and of the unexplained residual in every bin, (bins,) each, SI."""
    regression, errors = answer.selection.rest
    trace = trace_over(regression, where, errors)
    return trace.means(trace.before)


def unit_of(variable: str) -> str:
    """SI unit of a variable of poses."""
    if variable.startswith("platform_"):
        return "m" if variable.endswith(AXES) else "rad"
    return VARIABLE_UNITS.get(variable, "1")


def traces(
    regression: PoseRegression, before: Errors, after: Errors | None = None
) -> list[PoseErrorTrace]:
    """Per output its errors over the variable with the largest share before the change."""
    found: dict[str, Attribution] = {}
    for followed in pose_attributions(regression, before):
        if followed.variable != "pose":
            found.setdefault(followed.output, followed)
    return [
        trace_over(
            regression, found.get(name, Attribution(name, NUMBER, float("nan"))), before, after
        )
        for name in UNITS
        if name in before
    ]


def trace_over(
    regression: PoseRegression, over: Attribution, before: Errors, after: Errors | None = None
) -> PoseErrorTrace:
    """Errors of one output over one variable, of the line with the largest share."""
    name = over.output
    error = on_cables(regression, {name: before[name]})[name]
    then = None if after is None else on_cables(regression, {name: after[name]})[name]
    x = np.broadcast_to(_values(regression, over, error), error.shape)
    line = None
    if over.variable not in _POOLED:
        lines = list(AXES if name == "platform_position" else regression.dataset.names)
        column = lines.index(over.line) if over.line else most_significant(x, error)
        line = lines[column]
        x, error = x[:, [column]], error[:, [column]]
        then = None if then is None else then[:, [column]]
    known = np.isfinite(error) & np.isfinite(x)
    if then is not None:
        known &= np.isfinite(then)
    return PoseErrorTrace(over, x[known], error[known], None if then is None else then[known], line)


def _values(regression: PoseRegression, over: Attribution, error: Array) -> Array:
    count, lines = error.shape
    if over.variable == "winch":
        return np.arange(1.0, lines + 1)[None, :]
    if over.variable == NUMBER:
        return np.arange(1.0, count + 1)[:, None]
    if over.variable == "pose":
        return np.asarray(regression.dataset.pose[:, None] + 1.0, dtype=np.float64)
    return variables_of_poses(regression)[over.variable]
