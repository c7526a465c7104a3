"""Calibration of a load cell from known loads, with its figures of merit.

The true force is a line or a parabola of the reading. The loads are exact and the readings have the
noise, so that the squares of the readings' errors are minimised: of the line this is the inverse of
the regression of the reading on the load, whose slope noise does not bias (Draper and Smith 1998,
section 3.2). Figures of merit follow ISO 376 and OIML R 60, as shares of the span:

- non-linearity: largest deviation of a load's mean from the straight line through all points;
- zero return: reading at the smallest load after the largest one less that before it;
- hysteresis (reversibility): largest difference between decreasing and increasing at the same load,
  beyond the zero return;
- repeatability: standard deviation at the same load and direction between series.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from winchkit.arguments import require_types
from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.schema.calibration import CalibrationPoint

_FEWEST_LOADS = 5
"""Three coefficients leave two degrees of freedom per direction; ISO 376 asks for at least eight.
"""
_FOLLOWS = 5.0
"""Least slope in its standard deviations."""
_FAR = 3.0
"""Residual of an outlying point in standard deviations."""
_ITERATIONS = 50
"""At most, where rounding keeps the change above _CONVERGED."""
_CONVERGED = 1e-12
"""Relative change of the coefficients at which the iteration ends: rounding."""
_SAME_LOAD = 1e-3
"""Loads that differ by less than this share of the span are the same load."""


@dataclass(frozen=True)
class FigureOfMerit:
    """A figure of merit with its standard uncertainty, shares of the span; NaN where not known."""

    value: float
    std: float


@dataclass(frozen=True)
class CellFit:
    """A fitted calibration."""

    coefficients: tuple[float, ...]
    """c0 in N, c1 in N per unit of the reading, and for a parabola c2, of force over reading."""
    covariance: tuple[tuple[float, ...], ...]
    residuals: tuple[float, ...]
    """True less fitted, N, in the order of the points."""
    residual_std: float
    """Residual standard deviation with n − p degrees of freedom, N."""
    span: float
    """N."""
    nonlinearity: FigureOfMerit
    zero_return: FigureOfMerit
    hysteresis: FigureOfMerit
    repeatability: FigureOfMerit
    warnings: tuple[str, ...]

    @property
    def std(self) -> tuple[float, ...]:
        """Standard uncertainties of the coefficients."""
        return tuple(math.sqrt(row[k]) for k, row in enumerate(self.covariance))


WEIGHT_CLASSES = {"E2": 1.6e-6, "F1": 5e-6, "F2": 1.6e-5, "M1": 5e-5, "M2": 1.6e-4, "M3": 5e-4}
"""Maximum permissible error by accuracy class, as a share of weights from 100 g (OIML R 111-1)."""


def fit_cell(
    points: Sequence[CalibrationPoint],
    order: Literal["linear", "quadratic"] = "linear",
    tolerance: float = 0.0,
) -> CellFit:
    """Fit a calibration.

    Parameters
    ----------
    points
        Known loads with indicated forces.
    order
        Line or parabola.
    tolerance
        Maximum permissible error of the weights, as a share of them. An error of this size over √3
        that all weights have in common is added to the covariance; it is a factor of the force.

    Returns
    -------
    CellFit
        Coefficients with their covariance, and figures of merit.

    Raises
    ------
    RunError
        Where the points do not determine the coefficients: too few loads, a constant or an inverted
        reading.
    """
    require_types(points, CalibrationPoint, "points")
    degree = 1 if order == "linear" else 2
    load = np.array([point.load for point in points])
    indicated = np.array([point.indicated for point in points])
    _refuse(load, indicated, degree)
    span = float(np.ptp(load))
    coefficients, covariance, residuals, std = _least_squares(indicated, load, degree)
    line, line_covariance, from_line, _ = _least_squares(indicated, load, 1)
    _refuse_slope(float(line[1]), math.sqrt(float(line_covariance[1, 1])))
    groups = _groups(load, span)
    covariance = covariance + tolerance**2 / 3 * np.outer(coefficients, coefficients)
    return CellFit(
        tuple(float(c) for c in coefficients),
        tuple(tuple(float(c) for c in row) for row in covariance),
        tuple(float(r) for r in residuals),
        std,
        span,
        _nonlinearity(from_line, groups, span),
        *_returns(points, from_line, groups, span),
        _repeatability(points, from_line, groups, span),
        tuple(_warnings(points, groups, residuals, std, float(line[1]))),
    )


def _refuse(load: Array, indicated: Array, degree: int) -> None:
    if not (np.isfinite(load).all() and np.isfinite(indicated).all()):
        raise RunError("a calibration point is no number; repeat it")
    different = len(np.unique(load))
    if different < degree + 2:
        raise RunError(
            f"{different} different loads for {degree + 1} coefficients; hang at least "
            f"{degree + 2}, better {_FEWEST_LOADS}, up and down"
        )
    if np.ptp(indicated) == 0:
        raise RunError("the cell shows the same at every load; check that it carries them")


def _refuse_slope(slope: float, std: float) -> None:
    """Raise where the reading does not follow the loads, or decreases with them."""
    if abs(slope) < _FOLLOWS * std:
        raise RunError(
            f"what the cell indicates does not follow the loads (slope {slope:.3g} ± {std:.2g}); "
            "check that the weights hang on this cell"
        )
    if slope < 0:
        raise RunError(
            f"the cell indicates less at more load (slope {slope:.3g}): turn it round, or swap "
            "its signal wires"
        )


def _least_squares(x: Array, y: Array, degree: int) -> tuple[Array, Array, Array, float]:
    """Coefficients with covariance, residuals (true less fitted) and their standard deviation.
    Raises RunError for a parabola that turns round within the loads.

    Gauss-Newton on the readings: minimises Σ (x − g(y))², with g the inverse of the polynomial,
    from the regression of y on x; covariance s² (JᵀJ)⁻¹, ∂g/∂cₖ = −gᵏ/p'(g).
    """
    scale = float(np.max(np.abs(x)))
    powers = np.arange(degree + 1.0)
    found = np.linalg.lstsq(np.vander(x / scale, degree + 1, increasing=True), y, rcond=None)[0]
    for _ in range(_ITERATIONS):
        bow = found[2] if degree > 1 else 0.0
        square = found[1] ** 2 + 4 * bow * (y - found[0])
        if np.any(square <= 0):
            raise RunError("the parabola turns round within the loads; take --order linear")
        inverse = 2 * (y - found[0]) / (found[1] + np.copysign(np.sqrt(square), found[1]))
        slope = found[1] + 2 * bow * inverse
        jacobian = -np.vander(inverse, degree + 1, increasing=True) / slope[:, None]
        step = np.linalg.lstsq(jacobian, x / scale - inverse, rcond=None)[0]
        found = found + step
        if np.max(np.abs(step)) <= _CONVERGED * np.max(np.abs(found)):
            break
    residuals = y - np.vander(x / scale, degree + 1, increasing=True) @ found
    free = len(x) - degree - 1
    error = x / scale - inverse
    variance = float(error @ error) / free if free > 0 else math.nan
    units = scale**-powers
    covariance = variance * np.linalg.pinv(jacobian.T @ jacobian) * np.outer(units, units)
    std = math.sqrt(float(residuals @ residuals) / free) if free > 0 else math.nan
    return found * units, covariance, residuals, std


def _groups(load: Array, span: float) -> list[Array]:
    """Indices of the points at the same load, by increasing magnitude: compression is negative."""
    order = np.argsort(load, kind="stable")
    breaks = np.flatnonzero(np.diff(load[order]) > _SAME_LOAD * span) + 1
    return sorted(np.split(order, breaks), key=lambda group: abs(float(np.mean(load[group]))))


def _nonlinearity(from_line: Array, groups: list[Array], span: float) -> FigureOfMerit:
    means = np.array([from_line[group].mean() for group in groups])
    worst = int(np.argmax(np.abs(means)))
    spread = _pooled(from_line, groups) / math.sqrt(len(groups[worst]))
    return FigureOfMerit(float(abs(means[worst])) / span, spread / span)


def _returns(
    points: Sequence[CalibrationPoint], from_line: Array, groups: list[Array], span: float
) -> tuple[FigureOfMerit, FigureOfMerit]:
    """Zero return, and hysteresis: decreasing less increasing, largest over the other loads."""
    differences = []
    for group in groups:
        up = [from_line[k] for k in group if points[k].going == "up"]
        down = [from_line[k] for k in group if points[k].going == "down"]
        if up and down:
            weight = 1 / len(up) + 1 / len(down)
            differences.append((float(np.mean(up) - np.mean(down)), weight, group is groups[0]))
    spread = _pooled(from_line, _split(points, groups))
    unknown = FigureOfMerit(math.nan, math.nan)
    zero = next(((size, weight) for size, weight, is_zero in differences if is_zero), None)
    loops = [
        (abs(size - (zero[0] if zero else 0.0)), weight + (zero[1] if zero else 0.0))
        for size, weight, is_zero in differences
        if not is_zero
    ]
    largest, weight = max(loops, default=(math.nan, math.nan))
    return (
        unknown
        if zero is None
        else FigureOfMerit(zero[0] / span, spread * math.sqrt(zero[1]) / span),
        FigureOfMerit(largest / span, spread * math.sqrt(weight) / span) if loops else unknown,
    )


def _repeatability(
    points: Sequence[CalibrationPoint], from_line: Array, groups: list[Array], span: float
) -> FigureOfMerit:
    split = _split(points, groups)
    free = sum(len(group) - 1 for group in split)
    std = _pooled(from_line, split)
    return FigureOfMerit(std / span, std / span / math.sqrt(2 * free) if free > 0 else math.nan)


def _split(points: Sequence[CalibrationPoint], groups: list[Array]) -> list[Array]:
    """The groups, divided by direction."""
    return [
        np.array(part)
        for group in groups
        for going in ("up", "down")
        if (part := [k for k in group if points[k].going == going])
    ]


def _pooled(residuals: Array, groups: list[Array]) -> float:
    """Pooled standard deviation within groups; NaN where no load was repeated."""
    free = sum(len(group) - 1 for group in groups)
    if free <= 0:
        return math.nan
    squares = sum(float(np.sum((residuals[g] - residuals[g].mean()) ** 2)) for g in groups)
    return math.sqrt(squares / free)


def _warnings(
    points: Sequence[CalibrationPoint],
    groups: list[Array],
    residuals: Array,
    std: float,
    slope: float,
) -> Iterator[str]:
    """Warnings on missing loads, directions, series, and on outlying points."""
    if len(groups) < _FEWEST_LOADS:
        yield f"only {len(groups)} loads; at least {_FEWEST_LOADS} are usual"
    if {point.going for point in points} != {"up", "down"}:
        yield "loads go one way only, so hysteresis is unknown"
    elif not any(points[k].going == "down" for k in groups[0]):
        yield (
            "no reading at the smallest load after the largest: a moved zero counts as hysteresis"
        )
    if max(point.series for point in points) == 1:
        yield "one series only, so repeatability is unknown"
    yield from (
        f"the point at {point.load:g} N is {residual:+.3g} N off"
        for point, residual in zip(points, residuals, strict=True)
        if abs(residual) > _FAR * std > 0
    )
    if slope * max(point.std for point in points) > std > 0:
        yield "the readings have more noise than the points: wait longer after each load"
