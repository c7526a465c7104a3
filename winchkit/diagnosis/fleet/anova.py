"""What the errors of several winches follow: alike in all of them, or each in its own way.

An analysis of variance: the means over the bins of a variable, the same bins for every winch, first
of all winches together, then of each by itself. What the first explain is common; what only the
second explain is not, and the winch that is furthest from the common means is named. The variable
``winch`` has one bin a winch: a level of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.compare import Compared
from winchkit.diagnosis.residuals.attribution import (
    BINS,
    by_chance,
    kept_rows,
    quantile_bins,
    ranked,
    variables_of,
)

__all__ = ["SharedError", "SharedFollowed", "WinchErrors", "errors_of", "shared_errors"]

_MOST = 50_000
"""Samples of a winch that are looked at: shares do not get better with millions."""
_APART = 0.5
"""Part of the difference between winches that makes one of them the one."""


@dataclass(frozen=True)
class WinchErrors:
    """Errors of one output of one winch along its runs, every so many samples of them."""

    unit: str
    mean_square: float
    error: Array
    """(n,)."""
    variables: Mapping[str, Array]
    """What they may follow, (n,) each."""
    kept: int
    """Independent values among them."""


@dataclass(frozen=True)
class SharedFollowed:
    """A variable and the shares of the error's power that its means explain."""

    variable: str
    share: float
    """Each winch with means of its own."""
    common: float
    """One set of means for all winches: what of ``share`` is alike in all."""
    apart: tuple[str, ...]
    """The winch that makes most of the difference; none where no single one does."""


@dataclass(frozen=True)
class SharedError:
    """One output over all winches, SI."""

    unit: str
    rms: float
    winches: Mapping[str, float]
    """Share of the squared error that each winch has."""
    follows: tuple[SharedFollowed, ...]
    """What explains most first."""

    def to_json(self) -> dict[str, Any]:
        """As the command prints it."""
        follows = [{**vars(f), "apart": list(f.apart)} for f in self.follows]
        return {**vars(self), "winches": dict(self.winches), "follows": follows}


def errors_of(compared: Compared) -> dict[str, WinchErrors]:
    """Errors per output of one winch, as few as its shares need."""
    regression, out = compared.regression, {}
    times = regression.in_time(compared.residual)
    for output, told in compared.comparison.outputs.items():
        own = [
            (s, t) for s, t in zip(regression.segments, times, strict=True) if s.output == output
        ]
        recordings = [regression.dataset.recordings[s.run] for s, _ in own]
        valid = [recording.valid[output] for recording in recordings]
        step = max(1, told.samples // _MOST)
        known = [variables_of(recording) for recording in recordings]
        variables = {
            name: np.concatenate([run[name][v] for run, v in zip(known, valid, strict=True)])[
                ::step
            ]
            for name in known[0]
            if all(name in run for run in known)
        }
        error = np.concatenate([t[v] for (_, t), v in zip(own, valid, strict=True)])[::step]
        kept = min(len(error), kept_rows(regression, output))
        out[output] = WinchErrors(told.unit, told.rms**2, error, variables, kept)
    return out


def _few(runs: list[Array], valid: list[NDArray[np.bool_]], step: int) -> Array:
    """Every so many of the compared samples of all runs."""
    return np.concatenate([run[v] for run, v in zip(runs, valid, strict=True)])[::step]


def shared_errors(winches: Mapping[str, Mapping[str, WinchErrors]]) -> dict[str, SharedError]:
    """Per output what the winches (name to :func:`errors_of`) have in common and what not."""
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


def _follows(own: Mapping[str, WinchErrors]) -> tuple[SharedFollowed, ...]:
    """Every variable that explains more than chance, and the winch itself."""
    errors = np.concatenate([e.error for e in own.values()])
    if len(own) < 2 or not np.any(errors):
        return ()
    # A winch by itself is one bin over nothing: a level of its own.
    over = {"winch": np.zeros(len(errors), dtype=np.intp)}
    for name in next(iter(own.values())).variables:
        if all(name in e.variables for e in own.values()):
            values = np.concatenate([e.variables[name] for e in own.values()])
            if np.ptp(values) > 0:
                over[name] = quantile_bins(values)
    found = [_followed(name, bins, errors, own) for name, bins in over.items()]
    worth = by_chance(BINS * len(own), _kept(own))
    return tuple(ranked([f for f in found if f.share > worth]))


def _followed(
    variable: str, bins: NDArray[np.intp], errors: Array, own: Mapping[str, WinchErrors]
) -> SharedFollowed:
    """What the means over bins explain, less the part that chance gives to each."""
    winch = np.repeat(np.arange(len(own)), [len(e.error) for e in own.values()])
    shape = len(own), int(bins.max()) + 1
    cells, total, kept = winch * shape[1] + bins, float(errors @ errors), _kept(own)
    number = np.bincount(cells, minlength=shape[0] * shape[1]).reshape(shape)
    sums = np.bincount(cells, weights=errors, minlength=shape[0] * shape[1]).reshape(shape)
    level = sums.sum(axis=0) / np.maximum(number.sum(axis=0), 1)
    common = float(np.sum(number * level**2)) / total
    beyond = np.sum(number * (sums / np.maximum(number, 1) - level) ** 2, axis=1) / total
    chance = np.count_nonzero(number, axis=1) / kept
    clear = np.maximum(beyond - chance, 0.0)
    apart = clear > max(_APART * float(clear.sum()), by_chance(shape[1], kept))
    alike = max(0.0, common - np.count_nonzero(number.any(axis=0)) / kept)
    return SharedFollowed(
        variable,
        max(alike, common + float((beyond - chance).sum())),
        alike,
        tuple(name for name, one in zip(own, apart, strict=True) if one),
    )


def _kept(own: Mapping[str, WinchErrors]) -> int:
    """Independent values of all winches together."""
    return sum(e.kept for e in own.values())
