"""The report of a cell's calibration as text, with its residuals drawn in characters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from winchkit.calibration.cell_fit import CellFit, Figure
    from winchkit.schema.calibration import CalibrationPoint

__all__ = ["NAMES", "figures", "report_lines"]

NAMES = ("c0 [N]", "c1 [1]", "c2 [1/N]")
"""Of the coefficients."""
_WIDTH = 56
_ROWS = 11
_MARKS = {"up": "^", "down": "v"}


def report_lines(fit: CellFit, points: Sequence[CalibrationPoint]) -> list[str]:
    """Coefficients, figures of merit, residuals drawn with characters, warnings."""
    lines = [f"calibration over {fit.span:.5g} N from {len(points)} points:"]
    lines += [
        f"  {name:9}{value:+.6g} ± {std:.2g}"
        for name, value, std in zip(NAMES, fit.coefficients, fit.std, strict=False)
    ]
    lines += [f"  {name:16}{value}" for name, value in figures(fit)]
    lines += ["  residuals (true less fitted), ^ going up, v going down:"]
    lines += [f"  {line}" for line in _drawing(fit, points)]
    return lines + [f"  ! {warning}" for warning in fit.warnings]


def figures(fit: CellFit) -> list[tuple[str, str]]:
    """Figures of merit and what they are."""
    return [
        ("residual std", f"{fit.residual_std:.3g} N ({fit.residual_std / fit.span:.3%} of span)"),
        ("non-linearity", _share(fit.nonlinearity)),
        ("hysteresis", _share(fit.hysteresis)),
        ("repeatability", _share(fit.repeatability)),
    ]


def _share(figure: Figure) -> str:
    if math.isnan(figure.value):
        return "unknown"
    spread = "" if math.isnan(figure.std) else f" ± {figure.std:.3%}"
    return f"{figure.value:.3%}{spread} of span"


def _drawing(fit: CellFit, points: Sequence[CalibrationPoint]) -> list[str]:
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
