"""The report of a cell's calibration as one page without network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from winchkit.cli.cell_report import NAMES, figures
from winchkit.diagnosis.report.chart import Chart, axis_over, legend
from winchkit.diagnosis.report.markup import Markup, element, join, section, table
from winchkit.diagnosis.report.shell import page

if TYPE_CHECKING:
    from winchkit.calibration.cell_fit import CellFit
    from winchkit.schema.calibration import CalibrationPoint, CellCalibration

__all__ = ["report_page"]

_FORMULA = "True force = c0 + c1 x + c2 x², x the indicated force in N; a line has no c2."
_SPAN = "How well it fits; the span is from the least to the largest load."
_TONES = {"up": "above", "down": "below"}


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
            table(_FORMULA, ("coefficient", "value", "one standard deviation"), coefficients),
            table(
                "How well it fits; span is from the least to the largest load.",
                ("figure", "value"),
                figures(fit),
            ),
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
        ("temperature", "not told" if warm is None else f"{warm:g} °C"),
    ]
    pairs = [part for name, said in rows for part in (element("dt", name), element("dd", said))]
    return element("dl", *pairs, class_="facts")


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
    return table("Loads in the order in which they were hung; std is the reading's.", head, rows, 2)


def _drawing(fit: CellFit, points: Sequence[CalibrationPoint]) -> Markup:
    """Residuals over the load."""
    caption = "True less fitted force over the load; a loop between up and down is hysteresis."
    chart = Chart(
        axis_over("load [N]", [point.load for point in points]),
        axis_over("residual [N]", fit.residuals, zero=True),
        caption,
    )
    marks = [
        chart.dot(
            point.load,
            residual,
            _TONES[point.going],
            f"{point.load:.4g} N going {point.going}: {residual:+.3g} N",
        )
        for point, residual in zip(points, fit.residuals, strict=True)
    ]
    colours = legend([(tone, f"load going {going}") for going, tone in _TONES.items()])
    return element("figure", chart.draw(*marks), colours, element("figcaption", caption))
