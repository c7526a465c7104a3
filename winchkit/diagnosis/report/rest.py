"""The unexplained rest as a curve along what it lives over, of winches and of robots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.follows import Followed
from winchkit.diagnosis.report.curves import curve_of
from winchkit.diagnosis.report.pose_traces import trace_over
from winchkit.diagnosis.result import Where
from winchkit.diagnosis.robot.answer import RobotAnswer

__all__ = ["rest_of"]

Array = NDArray[np.float64]


def rest_of(answer: Answer, where: Where) -> tuple[Array, Array]:
    """Mean of the variable and of the residual in every bin, (bins,) each, SI."""
    over = Followed(where.output, where.variable, where.share, where.order, line=where.line)
    if isinstance(answer, RobotAnswer):
        problem, errors = answer.seen.rest
        trace = trace_over(problem, over, errors)
        return trace.means(trace.before)
    curve = curve_of(answer.inquiry.problem, answer.found.final.residual, over)
    return curve.x, curve.mean
