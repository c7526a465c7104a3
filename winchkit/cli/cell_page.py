"""The report of a cell's calibration as one page without network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from winchkit.cli.cell_report import NAMES, figures
from winchkit.diagnosis.report.markup import Markup, element, join, section, table
from winchkit.diagnosis.report.shell import page

if TYPE_CHECKING:
    from winchkit.calibration.cell_fit import CellFit
    from winchkit.schema.calibration import CalibrationPoint, CellCalibration

__all__ = ["report_page"]

_WIDTH, _HEIGHT, _LEFT, _LOW = 640, 300, 60, 30
_COLOURS = {"up": "#1f77b4", "down": "#d62728"}


def report_page(calibration: CellCalibration, fit: CellFit) -> str:
    """What was calibrated, the fit, the residuals, the points."""
    coefficients = [
        (name, f"{value:.6g}", f"{std:.2g}")
        for name, value, std in zip(NAMES, fit.coefficients, fit.std, strict=False)
    ]
    return page(
        f"Calibration of {calibration.name}",
        (),
        section("about", "What was calibrated", _about(calibration)),
        section(
            "fit",
            "Fit",
            table("True force of the indicated one", ("coefficient", "value", "std"), coefficients),
            table("Figures", ("figure", "value"), figures(fit)),
            join(element("p", warning) for warning in fit.warnings),
        ),
        section("residuals", "Residuals", _drawing(fit, calibration.point)),
        section("points", "Points", _points(calibration.point, fit)),
    )


def _about(calibration: CellCalibration) -> Markup:
    warm = calibration.temperature
    rows = [
        ("device", calibration.device or "not told"),
        ("serial number", calibration.serial_number or "not told"),
        ("date", calibration.date.isoformat()),
        ("direction", calibration.direction),
        ("temperature", "not told" if warm is None else f"{warm:g} degC"),
    ]
    return table("About", ("what", ""), rows, 2)


def _points(points: Sequence[CalibrationPoint], fit: CellFit) -> Markup:
    rows = [
        (
            str(point.series),
            point.going,
            f"{point.load:.4f}",
            f"{point.indicated:.4f}",
            f"{point.std:.2g}",
            f"{residual:+.4f}",
        )
        for point, residual in zip(points, fit.residuals, strict=True)
    ]
    head = ("series", "going", "load [N]", "indicated [N]", "std [N]", "residual [N]")
    return table("Loads in the order in which they were hung", head, rows, 2)


def _drawing(fit: CellFit, points: Sequence[CalibrationPoint]) -> Markup:
    """Residuals over the load."""
    largest = max(abs(residual) for residual in fit.residuals) or 1.0
    first = min(point.load for point in points)
    marks = [
        _mark(point, residual, (point.load - first) / fit.span, residual / largest)
        for point, residual in zip(points, fit.residuals, strict=True)
    ]
    middle, right, bottom = _HEIGHT / 2, _WIDTH - _LEFT, _HEIGHT - 6
    axis = element(
        "line",
        x1=str(_LEFT),
        x2=str(right),
        y1=str(middle),
        y2=str(middle),
        stroke="currentColor",
    )
    words = [
        _label(f"{largest:+.2g} N", _LEFT - 6, _LOW, "end"),
        _label(f"{-largest:+.2g} N", _LEFT - 6, _HEIGHT - _LOW, "end"),
        _label(f"{first:.4g} N", _LEFT, bottom),
        _label(f"{first + fit.span:.4g} N", right, bottom),
        _label("blue going up, red going down", _WIDTH / 2, bottom),
    ]
    box = f"0 0 {_WIDTH} {_HEIGHT}"
    inside = (axis, *marks, *words)
    return element("svg", *inside, viewBox=box, role="img", aria_label="Residuals over the load")


def _mark(point: CalibrationPoint, residual: float, across: float, up: float) -> Markup:
    """One point; ``across`` from 0 to 1, ``up`` from -1 to 1."""
    return element(
        "circle",
        element("title", f"{point.load:.4g} N going {point.going}: {residual:+.3g} N"),
        cx=f"{_LEFT + across * (_WIDTH - 2 * _LEFT):.1f}",
        cy=f"{_HEIGHT / 2 - up * (_HEIGHT / 2 - _LOW):.1f}",
        r="4",
        fill=_COLOURS[point.going],
    )


def _label(text: str, x: float, y: float, anchor: str = "middle") -> Markup:
    return element(
        "text",
        text,
        x=f"{x:.0f}",
        y=f"{y:.0f}",
        text_anchor=anchor,
        font_size="12",
        fill="currentColor",
    )
