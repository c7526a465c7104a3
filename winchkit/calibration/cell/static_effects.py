"""Effects of a load cell that points at rest determine: zero, span, curvature, hysteresis.

The difference of reading and load is a linear model of up to eight columns; all subsets are fitted
by least squares, and that of least BIC is kept, of those that are better than each of their parts
by an F test. The levels of the tests of all models with one part add up to 5 %: a cell with no
effect, or with those of the part only, has others in at most 5 % of calibrations (closed testing
with Bonferroni's weights). Terms beyond a line are tested beside the line. The terms are those of
the effects ``cell-offset``, ``cell-gain``, ``cell-nonlinearity`` and ``cell-hysteresis``, so that
the values go into a profile, and three that depend on the order of the loads: a zero return (all
readings of a series after its largest load), a zero shift (all readings after the first largest
load, or from that reading on) and a loop that closes at both ends (4h x (1 − x) of the reading on
the way down, x the share of the largest load: the parabolas of Rayleigh's law); of readings with
times, a creep. Readings in a unit of their own (counts, mV/V) have their zero and span by
definition; the other terms are then in newtons of their own span. Series that repeat each other
give the pure error, with which the lack of fit of the kept model is tested.

References
----------
Bertotti, G. (1998). Hysteresis in Magnetism, ch. 2 (Rayleigh's law). Academic Press.
Draper, N. R., Smith, H. (1998). Applied Regression Analysis, 3rd ed., ch. 2 and 15. Wiley.
Marcus, R., Peritz, E., Gabriel, K. R. (1976). On closed testing procedures. Biometrika 63, 655.
ISO 376:2011, Calibration of force-proving instruments.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from math import comb

import numpy as np
from scipy.special import fdtrc, nctdtrinc, stdtr, stdtrit

from winchkit.arguments import require_types
from winchkit.arrays import Array
from winchkit.calibration.cell.fit import fit_cell
from winchkit.errors import RunError
from winchkit.schema.calibration import CalibrationPoint

_TERMS = (
    ("cell-offset", "offset", "N"),
    ("cell-gain", "gain_error", "1"),
    ("cell-nonlinearity", "quadratic", "N"),
    ("cell-hysteresis", "fraction", "1"),
    ("zero-return", "shift", "N"),
    ("zero-shift", "shift", "N"),
    ("hysteresis-loop", "height", "N"),
    ("creep", "share", "1"),
)
_RETURNING = (3, 4, 6)
"""Terms that need loads in both directions."""
_SHIFT = 5
"""Term that needs several series: of one it is the zero return."""
_LINE = (0, 1)
"""Terms of a straight line, which readings in a unit of their own have by definition."""
_LEVEL = 0.025
"""Of all tests of terms beyond a line, and of those of a line: a false effect in 5 % at most."""
_POWER = 0.9
"""Of the smallest sizes that are reported."""
_ALIKE = 2.0
"""Difference of BIC below which two models are reported as a set (Raftery 1995: no evidence)."""
_UNIT_TENSION = 500.0
"""As in the effect ``cell-nonlinearity``: q (T/500 N)²."""
_ROUNDING = 1e-9
"""Relative: residuals below it are rounding of readings with nine digits
(:mod:`~winchkit.calibration.cell.files`), and a column that differs less from the others is none of
its own."""


@dataclass(frozen=True)
class StaticEffect:
    """One effect with its value, SI."""

    effect: str
    parameter: str
    value: float
    std: float
    unit: str
    p_value: float
    """Of the t test that it is zero, two-sided."""


@dataclass(frozen=True)
class StaticDiagnosis:
    """Effects that points at rest need, and what they leave."""

    effects: tuple[StaticEffect, ...]
    before: float
    """Rms of reading less load, N."""
    after: float
    """Residual standard deviation beside the effects, N."""
    repeatability: float
    """Pure error: standard deviation at the same load and direction, N; NaN without series."""
    p_value: float
    """Of the F test of the lack of fit; NaN without series."""
    alternatives: tuple[tuple[str, ...], ...] = ()
    """Effects of other models that explain the points as well."""
    detectable: tuple[tuple[str, float], ...] = ()
    """Effects that were tested and not found, and the smallest error found with 90 % power, N at
    the point where it is largest."""


def static_effects(
    points: Sequence[CalibrationPoint], unit: str = "N", creep_shape: Sequence[float] = ()
) -> StaticDiagnosis:
    """Effects of a cell that explain the differences of its readings and the loads.

    Parameters
    ----------
    points : sequence of CalibrationPoint
        Known loads with readings.
    unit : str, optional
        Unit of the readings; in another one than N their line gives the force.
    creep_shape : sequence of float, optional
        Of a file of points with times: then a creep is an effect too.

    Returns
    -------
    StaticDiagnosis
        An effect that the points do not determine, such as hysteresis with loads in one direction
        only, is not among them.
    """
    require_types(points, CalibrationPoint, "points")
    if not points:
        raise RunError("no point given")
    load = np.array([point.load for point in points])
    reading = np.array([point.indicated for point in points])
    if unit != "N":
        coefficients = fit_cell(points).coefficients
        reading = coefficients[0] + coefficients[1] * reading
    error = reading - load
    up = np.array([1.0 if point.going == "up" else -1.0 for point in points])
    after = np.array([point.going == "down" for point in points], dtype=np.float64)
    bow, loop = (load / _UNIT_TENSION) ** 2, -up * load
    share = load / max(float(np.max(np.abs(load))), 1e-300)
    moved = _moved(load, error, after)
    closed = 4 * after * share * (1 - np.abs(share))
    crept = np.array(creep_shape if len(creep_shape) else np.zeros_like(load))
    columns = np.column_stack([np.ones_like(load), load, bow, loop, after, moved, closed, crept])
    offered = [k for k in range(len(_TERMS)) if k not in (*_RETURNING, _SHIFT) or len(set(up)) > 1]
    if len({point.series for point in points}) == 1 and _SHIFT in offered:
        offered.remove(_SHIFT)
    able = [k for k in offered if _determines(columns, k, offered)]
    forced = () if unit == "N" else _LINE
    free_terms = [k for k in able if k not in forced]
    beyond = [k for k in free_terms if k not in _LINE]
    subsets = [
        frozenset((*forced, *s))
        for n in range(len(free_terms) + 1)
        for s in combinations(free_terms, n)
    ]
    floor = (_ROUNDING * float(np.max(np.abs(load), initial=1.0))) ** 2 * len(load)
    subsets = [s for s in subsets if len(s) < len(load)]
    tests = _Tests(columns, error, floor)
    fits = [_fit(columns[:, sorted(s)], error) for s in subsets]
    bic = [
        len(load) * np.log(max(square, floor) / len(load)) + len(values) * np.log(len(load))
        if tests.beats_its_parts(s.difference(_LINE), frozenset(_LINE), len(beyond))
        and tests.beats_its_parts(s.difference(_LINE), s.intersection(_LINE), len(beyond))
        and (forced or tests.beats_its_parts(s.intersection(_LINE), s.difference(_LINE), 2))
        else np.inf
        for s, (values, _, square) in zip(subsets, fits, strict=True)
    ]
    best = int(np.argmin(bic))
    kept, (values, inverse, square) = subsets[best], fits[best]
    free = len(load) - len(kept)
    variance = square / free
    found = _effects_of(sorted(kept), values, inverse, variance, len(load))
    effects = [e for e in found if e.effect not in _names_of(forced)]
    others = tuple(
        _names_of(sorted(subsets[index].difference(forced)))
        for index in np.argsort(bic)
        if index != best and bic[index] < bic[best] + _ALIKE and len(subsets[index]) == len(kept)
    )
    pure, degrees = _pure_error(points, error)
    lack = free - degrees
    p_value = float("nan")
    if degrees > 0 and lack > 0 and pure > 0:
        p_value = float(fdtrc(lack, degrees, max(square - pure, 0.0) / lack / (pure / degrees)))
    return StaticDiagnosis(
        tuple(effects),
        float(np.sqrt(np.mean(error**2))),
        float(np.sqrt(variance)),
        float(np.sqrt(pure / degrees)) if degrees > 0 else float("nan"),
        p_value,
        others if square > floor else (),
        tuple(tests.detectable(kept.difference(_LINE), beyond)),
    )


@dataclass(frozen=True)
class _Tests:
    """F tests of the terms of a linear model."""

    columns: Array
    error: Array
    floor: float
    """Sum of squares of rounding."""
    squares: dict[frozenset[int], float] = field(default_factory=dict)
    """Of the residuals of the models that were fitted."""

    def beats_its_parts(self, terms: frozenset[int], beside: frozenset[int], offered: int) -> bool:
        """Whether terms are significant beside others, and beside each of their parts.

        ``offered``: number of terms of which these are some. The models that contain one part share
        the level: half for those of one term more, a quarter for those of two, and so on.
        """
        free = len(self.error) - len(terms | beside)
        if not terms or free < 1:
            return not terms
        square = max(self._square(terms | beside), self.floor)
        return all(
            fdtrc(more, free, (self._square(beside.union(part)) - square) / more / (square / free))
            < _level(more, offered - len(part))
            for more in range(1, len(terms) + 1)
            for part in combinations(terms, len(terms) - more)
        )

    def detectable(
        self, kept: frozenset[int], offered: Sequence[int]
    ) -> Iterator[tuple[str, float]]:
        """Terms beyond a line that were not kept, with the largest error found with 90 % power.

        Of readings without noise there are none.
        """
        if self._square(kept.union(_LINE)) <= self.floor:
            return
        for k in sorted(set(offered) - kept):
            terms = sorted({*kept, *_LINE, k})
            free = len(self.error) - len(terms)
            if free < 1:
                continue
            _, inverse, square = _fit(self.columns[:, terms], self.error)
            std = np.sqrt(square / free * np.diag(inverse)[terms.index(k)])
            limit = stdtrit(free, 1 - _level(1, len(offered) - len(kept)) / 2)
            size = nctdtrinc(free, 1 - _POWER, limit) * std * np.max(np.abs(self.columns[:, k]))
            yield _TERMS[k][0], float(size)

    def _square(self, terms: frozenset[int]) -> float:
        if terms not in self.squares:
            self.squares[terms] = _fit(self.columns[:, sorted(terms)], self.error)[2]
        return self.squares[terms]


def _level(more: int, offered: int) -> float:
    """Level of the test of some terms together, of those that are offered beside the same ones."""
    return _LEVEL * 2.0**-more / (1 - 2.0**-offered) / comb(offered, more)


def _moved(load: Array, error: Array, after: Array) -> Array:
    """Where the zero has moved: after the first largest load, or from its reading on.

    The one that explains more: the zero may move before that reading settles.
    """
    if not after.any():
        return after
    line = np.column_stack([np.ones_like(load), load])
    largest = (np.abs(load) >= float(np.max(np.abs(load)))).astype(np.float64)
    both = [np.maximum.accumulate(own) for own in (after, np.maximum(after, largest))]
    return min(both, key=lambda own: _fit(np.column_stack([line, own]), error)[2])


def _names_of(terms: Iterable[int]) -> tuple[str, ...]:
    """Names of effects by the indices of their terms."""
    return tuple(_TERMS[k][0] for k in terms)


def _effects_of(
    terms: Sequence[int], values: Array, inverse: Array, variance: float, count: int
) -> list[StaticEffect]:
    stds = np.sqrt(variance * np.diag(inverse))
    return [
        StaticEffect(
            *_TERMS[k][:2],
            float(value),
            float(std),
            _TERMS[k][2],
            _two_sided(value, std, count - len(terms)),
        )
        for k, value, std in zip(terms, values, stds, strict=True)
    ]


def _determines(columns: Array, index: int, offered: Sequence[int]) -> bool:
    """Whether a column is independent of the others that are offered."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    rest = scaled[:, [k for k in offered if k != index]]
    own = scaled[:, index]
    left = own - rest @ np.linalg.lstsq(rest, own, rcond=None)[0]
    return bool(np.linalg.norm(left) > _ROUNDING)


def _fit(columns: Array, error: Array) -> tuple[Array, Array, float]:
    """Coefficients, (XᵀX)⁻¹ and sum of squares of the residual."""
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    x = columns / scale
    inverse = np.linalg.pinv(x.T @ x)
    values = inverse @ x.T @ error
    left = error - x @ values
    return values / scale, inverse / np.outer(scale, scale), float(left @ left)


def _two_sided(value: float, std: float, free: int) -> float:
    return 2 * float(stdtr(free, -abs(value) / std)) if std > 0 else 0.0


def _pure_error(points: Sequence[CalibrationPoint], error: Array) -> tuple[float, int]:
    """Sum of squares within equal loads and directions, and its degrees of freedom."""
    groups: dict[tuple[float, str], list[float]] = {}
    for point, value in zip(points, error, strict=True):
        groups.setdefault((round(point.load, 6), point.going), []).append(float(value))
    square = sum(float(np.sum((np.array(g) - np.mean(g)) ** 2)) for g in groups.values())
    return square, sum(len(group) - 1 for group in groups.values())
