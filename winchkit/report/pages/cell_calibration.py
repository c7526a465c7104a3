"""Report of a load cell's calibration as text and as a self-contained page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from winchkit.quantity_text import scale_for
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.html.markup import Markup, element, facts, folded, join, section, table
from winchkit.report.html.page import figure_block, page

if TYPE_CHECKING:
    from winchkit.calibration.cell.fit import CellFit
    from winchkit.calibration.cell.fit import FigureOfMerit as Merit
    from winchkit.calibration.cell.static_effects import StaticDiagnosis
    from winchkit.schema.calibration import CalibrationPoint, CellCalibration


def names(unit: str) -> tuple[str, str, str]:
    """Names of the coefficients for readings in a unit."""
    per = "" if unit == "N" else f" per {unit}"
    return ("c0 [N]", f"c1 [N{per}]", f"c2 [N{per}²]") if per else ("c0 [N]", "c1 [1]", "c2 [1/N]")


_WIDTH = 56
"""Characters of the plot of residuals; with its scale within 80."""
_ROWS = 11
"""Lines of that plot; odd, so that one is zero."""
_MARKS = {"up": "^", "down": "v"}


def report_lines(
    fit: CellFit, points: Sequence[CalibrationPoint], unit: str = "N", creep: Merit | None = None
) -> list[str]:
    """Coefficients, figures of merit, residuals drawn with characters, warnings."""
    lines = [f"calibration over {fit.span:.5g} N from {len(points)} points:"]
    lines += [
        f"  {name:20}{value:+.6g} ± {std:.2g}"
        for name, value, std in zip(names(unit), fit.coefficients, fit.std, strict=False)
    ]
    lines += [f"  {name:28}{value}" for name, value in figures(fit, creep)]
    lines += ["  residuals (true less fitted), ^ going up, v going down:"]
    lines += [f"  {line}" for line in _residual_lines(fit, points)]
    return lines + [f"  ! {warning}" for warning in fit.warnings]


def effect_lines(needed: StaticDiagnosis) -> list[str]:
    """Effects of the cell that the points need, and what they leave, as lines of text."""
    error = f"reading less load: {needed.before:.3g} N rms"
    alike = [
        f"  cannot be distinguished from: {', '.join(names) or 'none'}"
        for names in needed.alternatives
    ]
    sizes = ", ".join(f"{name} {value:.2g} N" for name, value in needed.detectable)
    found = [f"  smallest error found with 90 % power: {sizes}"] if sizes else []
    if not needed.effects:
        return [f"effects of the cell: none is needed ({error})", *alike, *found]
    lines = [f"effects of the cell (least BIC; {error}, {needed.after:.3g} N beside them):"]
    lines += [f"  {' '.join(row)}" for row in _effect_rows(needed)]
    lines += [*alike, *found]
    if not math.isnan(needed.p_value):
        lines.append(
            f"  lack of fit: p = {needed.p_value:.2g}; repeatability {needed.repeatability:.3g} N"
        )
    return lines


def _effect_rows(needed: StaticDiagnosis) -> list[tuple[str, str, str]]:
    return [
        (e.effect, e.parameter, f"{e.value:+.4g} ± {e.std:.2g}" + ("" if e.unit == "1" else " N"))
        for e in needed.effects
    ]


def figures(fit: CellFit, creep: Merit | None = None) -> list[tuple[str, str]]:
    """Names and values of the figures of merit."""
    crept = "unknown: the readings at one load have no times"
    if creep is not None and not math.isnan(creep.value):
        crept = f"{creep.value:.3%} ± {creep.std:.3%} of a change of load, 1 to 30 minutes after it"
    return [
        ("residual std", f"{fit.residual_std:.3g} N ({fit.residual_std / fit.span:.3%} of span)"),
        ("non-linearity", _share(fit.nonlinearity)),
        ("zero return", _share(fit.zero_return)),
        ("hysteresis (reversibility)", _share(fit.hysteresis)),
        ("repeatability", _share(fit.repeatability)),
        ("creep", crept),
    ]


def _share(figure: Merit) -> str:
    if math.isnan(figure.value):
        return "unknown"
    spread = "" if math.isnan(figure.std) else f" ± {figure.std:.3%}"
    return f"{figure.value:.3%}{spread} of span"


def _residual_lines(fit: CellFit, points: Sequence[CalibrationPoint]) -> list[str]:
    """Residuals over the load, in characters."""
    largest = max(abs(residual) for residual in fit.residuals) or 1.0
    low = min(point.load for point in points)
    grid = [[" "] * _WIDTH for _ in range(_ROWS)]
    middle = _ROWS // 2
    grid[middle] = ["-"] * _WIDTH
    for point, residual in zip(points, fit.residuals, strict=True):
        column = round((point.load - low) / fit.span * (_WIDTH - 1))
        row = middle - round(residual / largest * middle)
        there, mark = grid[row][column], _MARKS[point.going]
        grid[row][column] = mark if there in (" ", "-", mark) else "x"
    labels = {0: f"{largest:+.2g}", middle: "0", _ROWS - 1: f"{-largest:+.2g}"}
    drawn = [f"{labels.get(row, ''):>8} |{''.join(cells)}" for row, cells in enumerate(grid)]
    high = f"{low + fit.span:.4g} N"
    return [*drawn, f"{'':10}{f'{low:.4g}':<{_WIDTH - len(high)}}{high}"]


_FORMULA = "True force in N = c0 + c1 x + c2 x², x the reading; a line has no c2."
_TONES = {"up": "today", "down": "with"}


def report_page(
    calibration: CellCalibration,
    fit: CellFit,
    needed: StaticDiagnosis | None = None,
    creep: Merit | None = None,
) -> str:
    """Page with the load cell, the fit, the residuals and the points."""
    coefficients = [
        (name, f"{value:.6g}", f"{std:.2g}")
        for name, value, std in zip(
            names(calibration.unit), fit.coefficients, fit.std, strict=False
        )
    ]
    drawn = cell_figures(fit, calibration)
    return page(
        f"Calibration of {calibration.name}",
        drawn,
        section("about", "Load cell", _about(calibration)),
        element("div", *(figure_block(figure) for figure in drawn), class_="output"),
        section(
            "fit",
            "Fit",
            table(_FORMULA, ("coefficient", "value", "one standard deviation"), coefficients),
            table(
                "Figures of merit; the span is from the smallest to the largest load.",
                ("figure", "value"),
                figures(fit, creep),
            ),
            join(element("p", warning) for warning in fit.warnings),
        ),
        section("effects", "Effects of the cell", _effects(needed)),
        folded("points", "Points", _points(calibration.point, fit, calibration.unit)),
    )


def _effects(needed: StaticDiagnosis | None) -> Markup:
    if needed is None:
        return Markup("")
    if not needed.effects:
        return element("p", *effect_lines(needed))
    caption, *lines = effect_lines(needed)
    others = lines[len(needed.effects) :]
    head = ("effect", "parameter", "value")
    return join(
        [
            table(caption.removesuffix(":"), head, _effect_rows(needed), words=2),
            *(element("p", line) for line in others),
        ]
    )


def _about(calibration: CellCalibration) -> Markup:
    warm = calibration.temperature
    rows = [
        ("device", calibration.device or "not given"),
        ("serial number", calibration.serial_number or "not given"),
        ("date", calibration.date.isoformat()),
        ("direction", calibration.direction),
        ("temperature", "not given" if warm is None else f"{warm:g} °C"),
    ]
    return facts(rows)


def _points(points: Sequence[CalibrationPoint], fit: CellFit, unit: str) -> Markup:
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
    head = ("series", "going", "load [N]", f"indicated [{unit}]", f"std [{unit}]", "residual [N]")
    caption = "Loads in the order of application; std is that of the reading."
    return table(caption, head, rows, 2)


def cell_figures(fit: CellFit, calibration: CellCalibration) -> list[Figure]:
    """Readings and fit, and the residuals, over the load."""
    points = calibration.point
    load = np.array([point.load for point in points], dtype=float)
    residual = np.asarray(fit.residuals, dtype=float)
    shown = np.array([point.indicated for point in points], dtype=float)
    shown = shown if calibration.unit == "N" else load - residual
    going = np.array([point.going for point in points])
    order = np.argsort(load)
    size = scale_for(float(np.max(np.abs(residual), initial=0.0)), "N")
    readings = [FigureSeries("fitted", "measured", load[order], (load - residual)[order])]
    errors = []
    for word, tone in _TONES.items():
        own = going == word
        name = f"load going {word}"
        readings.append(
            FigureSeries(f"indicated, {name}", tone, load[own], shown[own], "points", name)
        )
        errors.append(
            FigureSeries(
                f"residual, {name}", tone, load[own], residual[own] / size.worth, "points", name
            )
        )
    file = "".join(c if c.isascii() and c.isalnum() else "-" for c in calibration.name)
    return [
        Figure(
            f"calibration-{file or 'cell'}",
            "Force over the load",
            "Indicated and fitted force, and the true less the fitted force; a difference of up "
            "and down is hysteresis.",
            FigureAxis("load", "N"),
            (
                Panel(FigureAxis("indicated and fitted", "N"), tuple(readings)),
                Panel(FigureAxis("residual", size.label, zero=True), tuple(errors)),
            ),
            source=f"calibration of {calibration.name}, {calibration.date.isoformat()}",
        )
    ]
