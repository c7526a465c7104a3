"""What usual ways to select terms name on the same cases, from the same signatures.

Each gets what winchkit's own search begins with: the residual of the profile and the columns that
every candidate effect adds, scaled per output to a residual of unit size. None of them knows of
repeats or of coloured noise; that is how they are used.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import Band, to_time
from winchkit.diagnosis.selection.candidates import with_grid_points
from winchkit.diagnosis.selection.orders import has_orders
from winchkit.diagnosis.selection.signatures import Signatures, signatures
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.effect import MOTOR_ORDERS
from winchkit.effects.term import Term

_LEVEL = 0.05
_MOST = 15
_FOLDS = 5
_MOST_ROWS = 10_000
_THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
ALPHA = 1e-3
"""Ridge of STLSQ."""
_NOTHING = 1e-12
_PRESENT = 1e-6


@dataclass(frozen=True)
class Regression:
    """A residual in time and the columns of every candidate, nuisances projected out."""

    residual: Array
    """(rows,), unit size per output."""
    columns: Array
    """(rows, p), unit length."""
    effects: tuple[str, ...]
    """To which effect each column belongs."""
    atoms: tuple[slice, ...]
    """Columns that stand or fall together."""
    fold: NDArray[np.intp]
    """Block of time of every row."""
    terms: tuple[Term, ...] = ()
    """Usual-size step of every column."""
    steps: Array = field(default_factory=lambda: np.ones(0))
    """(p,), usual-size steps per unit coefficient."""


def regression_of(engine: TimeSeriesSelection) -> Regression:
    """The regression of an inquiry before anything is added, decimated to what solvers bear."""
    regression = engine.regression
    # Each output by its own size: metres and newtons on one scale.
    known = regression.nuisance_columns
    residual = regression.residual(engine.initial_model)
    left = residual - known @ np.linalg.lstsq(known, residual, rcond=None)[0]
    size = np.empty(regression.n_rows)
    for output in regression.dataset.outputs:
        own = [s for s in regression.segments if s.output == output]
        total = sum(float(np.sum(left[s.rows] ** 2)) for s in own)
        count = sum(s.rows.stop - s.rows.start for s in own)
        for segment in own:
            size[segment.rows] = np.sqrt(total / count) or 1.0
    tried = all_columns(engine)
    rows = np.column_stack([residual, known, tried.columns]) / size[:, None]
    every = max(1, regression.n_rows // _MOST_ROWS)
    times, folds = [], []
    for segment in regression.segments:
        block = in_time(rows[segment.rows], segment.band)
        # Means of neighbours, not every n-th: thinning must not throw information away.
        kept = len(block) // every * every
        times.append(block[:kept].reshape(-1, every, block.shape[1]).mean(axis=1))
        folds.append((np.arange(kept // every) * _FOLDS) // max(1, kept // every))
    whole = np.concatenate(times)
    nuisances = regression.nuisance_columns.shape[1]
    basis = np.linalg.qr(whole[:, 1 : 1 + nuisances])[0]
    whole = whole - basis @ (basis.T @ whole)
    columns = whole[:, 1 + nuisances :]
    length = np.sqrt(np.sum(columns**2, axis=0))
    length = np.maximum(length, _NOTHING)
    terms = [
        Term(atom.effect, {**atom.effect.null, **atom.shape, **step})
        for atom in tried.candidates
        for step in atom.usual_steps
    ]
    unit = max(float(np.std(whole[:, 0])), _NOTHING)
    return Regression(
        residual=whole[:, 0] / unit,
        columns=columns / length,
        effects=tuple(term.effect.id for term in terms),
        atoms=tuple(atom.columns for atom in tried.candidates),
        fold=np.concatenate(folds),
        terms=tuple(terms),
        steps=unit / length,
    )


def all_columns(engine: TimeSeriesSelection) -> Signatures:
    """Columns of all candidates, those with an order at all that the catalogue lists too.

    winchkit scans every order anew after each step; the other methods choose among columns.
    """
    effects = {candidate.effect.id: candidate.effect for candidate in engine.signatures.candidates}
    longer = (
        with_grid_points(effect, "order", MOTOR_ORDERS) if has_orders(effect) else effect
        for effect in effects.values()
    )
    return signatures(engine.regression, engine.initial_model, longer)


def in_time(rows: Array, band: Band) -> Array:
    """Columns of spectral rows as samples."""
    return np.column_stack([to_time(column, band) for column in rows.T])


def bic_forward(data: Regression) -> list[int]:
    """Add the group of columns that lowers n ln RSS + k ln n most, until none does."""
    count = len(data.residual)

    def enough(gain: float, squares: float, freedom: int) -> bool:
        saved = count * (np.log(squares) - np.log(max(squares - gain, _NOTHING)))
        return saved > freedom * np.log(count)

    return _forward(data, enough)


def score_test(data: Regression) -> list[int]:
    """Add the most significant group while its score test passes Bonferroni, rows independent."""
    count, tests = len(data.residual), len(data.atoms)

    def enough(gain: float, squares: float, freedom: int) -> bool:
        return bool(chi2.sf(gain / (squares / count), freedom) * tests < _LEVEL)

    return _forward(data, enough)


def lasso(data: Regression) -> list[int]:
    """LassoCV with folds that are blocks of time."""
    from sklearn.linear_model import LassoCV

    folds = [(data.fold != k, data.fold == k) for k in range(_FOLDS)]
    splits = [(np.flatnonzero(train), np.flatnonzero(test)) for train, test in folds]
    with warnings.catch_warnings():
        # Columns that are nearly alike never quite converge; what is chosen no longer changes.
        warnings.simplefilter("ignore")
        scale = np.sqrt(len(data.residual))
        model = LassoCV(cv=splits, alphas=40, max_iter=3000, fit_intercept=False)
        model.fit(data.columns * scale, data.residual)
    return _present(np.asarray(model.coef_))


def stlsq(data: Regression) -> list[int]:
    """Sequentially thresholded least squares, its threshold chosen on blocks of time."""
    return _present(_coefficients(data, threshold_of(data), np.ones(len(data.fold), dtype=bool)))


def threshold_of(data: Regression) -> float:
    """Threshold of STLSQ with the least error on blocks of time."""

    def missed(threshold: float) -> float:
        total = 0.0
        for k in range(_FOLDS):
            test = data.fold == k
            scaled = data.columns[test] * np.sqrt(len(data.residual))
            left = data.residual[test] - scaled @ _coefficients(data, threshold, ~test)
            total += float(left @ left)
        return total

    return min(_THRESHOLDS, key=missed)


def _coefficients(data: Regression, threshold: float, kept: NDArray[np.bool_]) -> Array:
    """STLSQ's coefficients of columns of unit rms, from some rows."""
    from pysindy.optimizers import STLSQ

    with warnings.catch_warnings():
        # It warns where every term falls below the threshold: then it names none.
        warnings.simplefilter("ignore")
        model = STLSQ(threshold=threshold, alpha=ALPHA)
        model.fit(data.columns[kept] * np.sqrt(len(data.residual)), data.residual[kept, None])
    return np.asarray(model.coef_)[0]


SELECTIONS: dict[str, Callable[[Regression], list[int]]] = {
    "BIC forward selection": bic_forward,
    "iid score test": score_test,
    "LassoCV, block folds": lasso,
    "pysindy STLSQ": stlsq,
}
"""Columns that each method selects, in the order of its choice."""


def _forward(data: Regression, enough: Callable[[float, float, int], bool]) -> list[int]:
    """Columns in the order in which they were added."""
    residual, columns = data.residual.copy(), data.columns.copy()
    squares = float(residual @ residual)
    selected: list[int] = []
    for _ in range(_MOST):
        found = [(gain, atom, basis) for gain, atom, basis in _gains(data, columns, residual)]
        passing = [f for f in found if enough(f[0], squares, f[2].shape[1])]
        if not passing:
            break
        gain, atom, basis = max(passing, key=lambda f: f[0])
        residual -= basis @ (basis.T @ residual)
        columns -= basis @ (basis.T @ columns)
        squares -= gain
        selected += [i for i in range(atom.start, atom.stop) if i not in selected]
    return selected


def _gains(
    data: Regression, columns: Array, residual: Array
) -> Iterator[tuple[float, slice, Array]]:
    """Squares that each group of columns would take, and its orthonormal basis."""
    for atom in data.atoms:
        left, size, _ = np.linalg.svd(columns[:, atom], full_matrices=False)
        basis = left[:, size > 1e-3]
        if basis.shape[1]:
            yield float(np.sum((basis.T @ residual) ** 2)), atom, basis


def _present(coefficients: Array) -> list[int]:
    """Columns with a coefficient that is not zero, largest first."""
    order = np.argsort(-np.abs(coefficients))
    return [int(i) for i in order if abs(coefficients[i]) > _PRESENT]
