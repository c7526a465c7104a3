"""Text and figures of simulated motions beside the prediction of the same runs."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.diagnosis.compare import WinchCompared
from winchkit.diagnosis.residuals.traces import OutputTrace
from winchkit.dynamics.comparison import SimulatedError
from winchkit.dynamics.refit import MotionFit
from winchkit.quantity_text import quantity
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.figures.reduction import decimated
from winchkit.report.words.columns import aligned, entries

_INTERVALS = 1000
"""Intervals of a drawing, two per pixel of its width."""
_HEAD = ["simulated motion", "driven by", "error, rms", "largest", "measured, rms"]


def simulated_text(errors: Sequence[SimulatedError]) -> str:
    """A table of the errors, and the times after which an open loop shows nothing of the model."""
    rows = [
        [e.run, e.driven_by, *(quantity(x, e.unit) for x in (e.rms, e.largest, e.motion_rms))]
        for e in errors
    ]
    return "\n".join([*aligned([_HEAD, *rows], 2), *_meaning(errors)])


def _meaning(errors: Sequence[SimulatedError]) -> list[str]:
    """Until when the open loop of each run shows the model."""
    lines = []
    for e in errors:
        if e.meaningful_until is not None:
            text = (
                f"{e.run}: after {quantity(e.meaningful_until, 's')} the comparison means nothing: "
                "the uncertain initial speed alone makes an error as large as that of the model"
            )
            lines += entries([text])
    if all(e.meaningful_until is None for e in errors if e.driven_by == "torque"):
        text = "the uncertain initial speed makes a smaller error than the model, to the end"
        lines += entries([text])
    return lines


def refit_lines(fitted: MotionFit | None) -> list[str]:
    """Error of the simulated motion before and after its values were refitted to it, if any."""
    if fitted is None:
        return []
    errors = (fitted.rms_before, fitted.rms_after)
    before, after = (quantity(x, fitted.unit) for x in errors)
    text = f"simulated from the measured torque, the motion is off by {after} rms; by {before} "
    lines = entries([text + "with the values of the prediction"]) + _meaning(fitted.after)
    if not fitted.converged:
        lines += entries(["the fit to the motion did not converge: its values may change"])
    return lines


def simulated_figures(compared: WinchCompared, errors: Sequence[SimulatedError]) -> list[Figure]:
    """For each simulated motion the measured and the simulated one, above the predicted torque."""
    traces = (t for t in compared.comparison.traces if isinstance(t, OutputTrace))
    torques = {t.run: t for t in traces if t.output in _TORQUES}
    found = []
    for e in errors:
        kept = decimated([e.measured, e.simulated], _INTERVALS)
        time, name = e.time[kept], "position" if e.unit == "m" else "motor angle"
        panels = [
            Panel(
                FigureAxis(name, e.unit),
                (
                    FigureSeries("measured", "measured", time, e.measured[kept]),
                    FigureSeries("simulated", "with", time, e.simulated[kept]),
                ),
            ),
            Panel(
                FigureAxis("error of the simulation", e.unit, zero=True),
                (
                    FigureSeries(
                        "simulated − measured", "with", time, (e.simulated - e.measured)[kept]
                    ),
                ),
            ),
        ]
        if (torque := torques.get(e.run)) is not None:
            panels.append(
                Panel(
                    FigureAxis(torque.output.replace("_", " "), torque.unit),
                    (
                        FigureSeries("measured", "measured", torque.time, torque.measured),
                        FigureSeries("predicted", "today", torque.time, torque.predicted),
                    ),
                )
            )
        found.append(
            Figure(
                f"simulated-{e.run}-{e.driven_by}",
                f"{e.run}: motion simulated from the {e.driven_by}",
                f"Measured and simulated {name}: the error is {quantity(e.rms, e.unit)} rms.",
                FigureAxis("time", "s"),
                tuple(panels),
            )
        )
    return found


_TORQUES = ("motor_torque", "force")
