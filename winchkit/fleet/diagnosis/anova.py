"""Analysis of variance of the errors of several winches.

Means over the bins of a variable, the same bins for all winches: first common to all winches, then
for each by itself. The share of the former is common; the winch that contributes most of the
difference is named. The variable ``winch`` has one bin per winch.

References
----------
Box, G. E. P., Hunter, J. S., Hunter, W. G. (2005). Statistics for Experimenters, 2nd ed. Wiley.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.compare import WinchCompared
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.residuals.attribution import (
    BINS,
    chance_share,
    kept_rows,
    quantile_bins,
    ranked,
    variables_of,
)
from winchkit.schema.linear_axis import rotary_name

_MOST_SAMPLES = 50_000
"""Samples per winch; shares do not become more exact with more."""
_OUTLYING_SHARE = 0.5
"""Share of the difference between winches above which one winch is named."""


@dataclass(frozen=True)
class WinchErrors:
    """Errors of one output of one winch, decimated."""

    unit: str
    mean_square: float
    error: Array
    """(n,)."""
    variables: Mapping[str, Array]
    """Variables that may explain them, (n,) each."""
    kept: int
    """Number of independent values among them."""


@dataclass(frozen=True)
class SharedAttribution:
    """A variable and the shares of the error variance that its bins explain."""

    variable: str
    share: float
    """With means of its own for each winch."""
    common: float
    """With the same means for all winches."""
    outlying: tuple[str, ...]
    """Outlying winch, which contributes most of the difference; empty where there is none."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints; the outlying winch is its ``apart``."""
        values = {key: value for key, value in vars(self).items() if key != "outlying"}
        return {**values, "apart": list(self.outlying)}


@dataclass(frozen=True)
class SharedError:
    """Errors of one output over all winches, SI."""

    unit: str
    rms: float
    winches: Mapping[str, float]
    """Share of the squared error per winch."""
    follows: tuple[SharedAttribution, ...]
    """Largest share first."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        follows = [attribution.to_json() for attribution in self.follows]
        return {**vars(self), "winches": dict(self.winches), "follows": follows}


def errors_of(compared: WinchCompared) -> dict[str, WinchErrors]:
    """Errors per output of one winch, decimated to at most about 50,000 samples."""
    regression, out = compared.regression, {}
    profile = regression.dataset.profile
    for name, compared_output in compared.comparison.outputs.items():
        output = rotary_name(name)
        runs = [s.run for s in regression.segments if s.output == output]
        recordings = [regression.dataset.recordings[run] for run in runs]
        valid = [recording.valid[output] for recording in recordings]
        step = max(1, compared_output.samples // _MOST_SAMPLES)
        known = [variables_of(recording) for recording in recordings]
        variables = {
            over: np.concatenate([run[over][v] for run, v in zip(known, valid, strict=True)])[
                ::step
            ]
            for over in known[0]
            if all(over in run for run in known)
        }
        error = regression.compared_samples(compared.residual, output)[::step]
        kept = min(len(error), kept_rows(regression, output))
        out[name] = WinchErrors(
            compared_output.unit,
            compared_output.rms**2,
            error,
            in_units_of(profile, variables),
            kept,
        )
    return out


def shared_errors(winches: Mapping[str, Mapping[str, WinchErrors]]) -> dict[str, SharedError]:
    """Per output the common and the individual part of the errors of several winches
    (:func:`errors_of`)."""
    outputs = dict.fromkeys(output for errors in winches.values() for output in errors)
    out = {}
    for output in outputs:
        own = {name: errors[output] for name, errors in winches.items() if output in errors}
        squares = {name: errors.mean_square for name, errors in own.items()}
        total = sum(squares.values())
        shares = {name: s / total if total else 0.0 for name, s in squares.items()}
        unit = next(iter(own.values())).unit
        out[output] = SharedError(unit, float(np.sqrt(total / len(own))), shares, _follows(own))
    return out


def _follows(own: Mapping[str, WinchErrors]) -> tuple[SharedAttribution, ...]:
    """Every variable that explains more than chance, and the winch itself."""
    errors = np.concatenate([e.error for e in own.values()])
    if len(own) < 2 or not np.any(errors):
        return ()
    # The variable winch has one bin per winch: a constant for each.
    over = {"winch": np.zeros(len(errors), dtype=np.intp)}
    for name in next(iter(own.values())).variables:
        if all(name in e.variables for e in own.values()):
            values = np.concatenate([e.variables[name] for e in own.values()])
            if np.ptp(values) > 0:
                over[name] = quantile_bins(values)
    found = [_attribution(name, bins, errors, own) for name, bins in over.items()]
    worth = chance_share(BINS * len(own), _kept(own))
    return tuple(ranked([f for f in found if f.share > worth]))


def _attribution(
    variable: str, bins: NDArray[np.intp], errors: Array, own: Mapping[str, WinchErrors]
) -> SharedAttribution:
    """Shares that bins explain, less their expectation under independence."""
    winch = np.repeat(np.arange(len(own)), [len(e.error) for e in own.values()])
    shape = len(own), int(bins.max()) + 1
    cells, total, kept = winch * shape[1] + bins, float(errors @ errors), _kept(own)
    number = np.bincount(cells, minlength=shape[0] * shape[1]).reshape(shape)
    sums = np.bincount(cells, weights=errors, minlength=shape[0] * shape[1]).reshape(shape)
    level = sums.sum(axis=0) / np.maximum(number.sum(axis=0), 1)
    common = float(np.sum(number * level**2)) / total
    individual = np.sum(number * (sums / np.maximum(number, 1) - level) ** 2, axis=1) / total
    expected = np.count_nonzero(number, axis=1) / kept
    excess = np.maximum(individual - expected, 0.0)
    outlying = excess > max(_OUTLYING_SHARE * float(excess.sum()), chance_share(shape[1], kept))
    alike = max(0.0, common - np.count_nonzero(number.any(axis=0)) / kept)
    return SharedAttribution(
        variable,
        max(alike, common + float((individual - expected).sum())),
        alike,
        tuple(name for name, one in zip(own, outlying, strict=True) if one),
    )


def _kept(own: Mapping[str, WinchErrors]) -> int:
    """Number of independent values of all winches together."""
    return sum(e.kept for e in own.values())
