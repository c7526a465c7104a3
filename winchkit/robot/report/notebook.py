"""Robots in consoles and notebooks: the profile and the calibration; registers their renderers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.rendering import Renderer, renderers
from winchkit.report.html.markup import Markup, element, table
from winchkit.report.notebook.figures import axis_label, common_scale, legend
from winchkit.report.notebook.html import TONES, framed, profile_cell, shortened
from winchkit.report.notebook.style import BLACK, BLUE, GREY, ORANGE, WIDTH, Size, new_figure
from winchkit.report.notebook.text import profile_screen, screen
from winchkit.report.words.columns import paragraph
from winchkit.report.words.sentence import capital
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.calibration.results import calibration_text, in_words
from winchkit.robot.geometry.robot import robot_of
from winchkit.schema.profiles.robot import RobotProfile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def calibration_screen(found: Calibrated) -> str:
    """A robot's calibration: errors before and after, and the first parameters."""
    lines = paragraph(found.refusal) if found.refusal else []
    return screen("\n".join([*lines, calibration_text(found, ())]), "; fit_report() has all")


def calibration_cell(found: Calibrated) -> str:
    """A robot's calibration: errors before and after, and its parameters."""
    pairs = {
        "fitted": (found.fit_before, found.fit_after),
        "held out": (found.validation_before, found.validation_after),
    }
    errors = [
        [
            name,
            str(len(after.distance)),
            *(f"{rms(e.distance) * 1e3:.3g} mm" for e in (before, after)),
        ]
        for name, (before, after) in pairs.items()
        if len(after.distance)
    ]
    rows = [[name, *in_words(estimate)] for name, estimate in found.estimates.items()]
    head = ["parameter", "nominal", "value", "sigma", "unit"]
    notes = [element("li", capital(note)) for note in found.warnings]
    return framed(
        TONES["unknown" if found.refusal else "explained"],
        element("b", "Not calibrated" if found.refusal else "Calibrated"),
        element("p", found.refusal) if found.refusal else Markup(""),
        table("Position error, rms.", ["poses", "number", "before", "after"], errors),
        *shortened("Parameters with their posterior standard deviation.", head, rows),
        element("ul", *notes) if notes else Markup(""),
    )


def robot_figure(profile: RobotProfile, *, figsize: Size = None) -> Figure:
    """Exit points, and the platform with its cables at the home pose."""
    robot = robot_of(profile)
    exits = robot.geometry.exit_point
    anchors = robot.home.position[0] + robot.geometry.anchor_point @ robot.home.rotation[0].T
    with new_figure(figsize or (4.2, 4.2)) as figure:
        axis = figure.add_subplot(projection="3d")
        for name, start, end in zip(robot.names, exits, anchors, strict=True):
            axis.plot(*np.array([start, end]).T, color=GREY, lw=0.8)
            axis.text(*start, f" {name}", fontsize=7, color=BLACK)
        axis.plot(*exits.T, "o", ms=3, color=BLUE, label="exit points")
        axis.plot(*anchors.T, "s", ms=3, color=ORANGE, label="anchor points at home")
        for set_label, letter in zip(
            (axis.set_xlabel, axis.set_ylabel, axis.set_zlabel), "xyz", strict=True
        ):
            set_label(f"{letter} [m]")
        limits = (axis.get_xlim(), axis.get_ylim(), axis.get_zlim())
        axis.set_box_aspect([float(np.ptp(pair)) for pair in limits], zoom=0.85)
        figure.legend(loc="outside upper center", ncols=2)
    return figure


def calibration_figure(found: Calibrated, *, figsize: Size = None) -> Figure:
    """Pose errors before and after a robot's calibration, of fitted and of held-out poses."""
    sides = [
        ("poses fitted", found.fit_before, found.fit_after),
        ("poses held out", found.validation_before, found.validation_after),
    ]
    sides = [side for side in sides if np.isfinite(side[2].distance).any()]
    rows = [("position error", "m", "distance"), ("rotation error", "rad", "angle")]
    rows = [row for row in rows if any(np.isfinite(getattr(s[2], row[2])).any() for s in sides)]
    if not sides:
        raise UsageError("no position was measured: there are no pose errors to draw")
    with new_figure(figsize or (WIDTH, 2.3 * len(rows) + 0.2)) as figure:
        widths = [max(3.0, np.sqrt(len(side[1].distance))) for side in sides]
        axes = figure.subplots(
            len(rows), len(sides), sharey="row", width_ratios=widths, squeeze=False
        )
        for row, (name, unit, field) in enumerate(rows):
            scale = common_scale([getattr(s[k], field) for s in sides for k in (1, 2)], unit)
            for column, (title, *errors) in enumerate(sides):
                axis = axes[row, column]
                for error, color, word in zip(errors, (ORANGE, BLUE), _BEFORE_AFTER, strict=True):
                    values = getattr(error, field) / scale.worth
                    _draw_sizes(axis, values, color, word)
                if row == 0:
                    axis.set_title(title, loc="left")
                if row == len(rows) - 1:
                    axis.set_xlabel("number of the pose")
            shown = next(axis for axis in axes[row] if axis.axison)
            shown.set_ylabel(axis_label(name, scale))
        legend(figure, axes[0, 0])
    return figure


_BEFORE_AFTER = ("before", "after calibration")


def _draw_sizes(axis: Axes, values: Array, color: str, word: str) -> None:
    """Positive values over their number on a logarithmic scale, with their rms."""
    known = np.isfinite(values) & (values > 0)
    if not known.any():
        axis.set_axis_off()
        return
    number = np.arange(1, len(values) + 1)
    axis.plot(number[known], values[known], ".", ms=3, color=color, label=word)
    axis.axhline(rms(values[known]), color=color, lw=0.8, ls="--", label=f"rms {word}")
    axis.set_yscale("log")


renderers.register(RobotProfile, Renderer(profile_screen, profile_cell, robot_figure))
renderers.register(Calibrated, Renderer(calibration_screen, calibration_cell, calibration_figure))
