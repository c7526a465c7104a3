"""Offsets between runs without repeats: an instrument that has another zero in every run.

Repeats show an offset by their differences (:mod:`winchkit.diagnosis.data.zeroing`). Without them
it is what the fitted model leaves between the means of runs: the decrease of the sum of squares by
an offset per run, in linear approximation, is tested against the variation over blocks of time
(batch means, one F test per output). A common offset, and a straight line over the mean load and
temperature of the runs, are fitted beside, since an effect outside the catalogue may be that.

References
----------
Schmeiser, B. (1982). Batch size effects in the analysis of simulation output. Oper. Res. 30,
556-568.
Searle, S. R., Casella, G., McCulloch, C. E. (1992). Variance Components. Wiley, ch. 3 (one-way
classification).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.repeats import mean_load
from winchkit.diagnosis.data.zeroing import (
    BLOCKS,
    LEVEL,
    is_random_walk,
    no_zero,
    zeroed_finding,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import Spread
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.results import RunOffset
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.runs.sanity.finding import Finding

_LEAST_SHARE = 1e-6
"""Share of a column's squared length that other columns must leave, for a direction to count."""


def with_run_offsets(
    dataset: Dataset, regression: TimeSeriesRegression, fit: Fit
) -> Dataset | None:
    """Data set with an offset per run in every output whose run means a fit does not explain; None
    where no output has another offset in every run, or where repeats decide."""
    if dataset.repeated:
        return None
    found = [offset_between_runs(regression, fit, output) for output in regression.outputs]
    findings = [finding for finding in found if finding is not None]
    if not findings:
        return None
    zeroed = dataset.zeroed_anew | {finding.channel for finding in findings}
    return replace(dataset, sanity=(*dataset.sanity, *findings), zeroed_anew=frozenset(zeroed))


def offset_between_runs(regression: TimeSeriesRegression, fit: Fit, output: str) -> Finding | None:
    """Finding ``zeroed-anew`` of an output; value: standard deviation of the offset, SI.

    None with fewer than two runs, or where the offsets are within the variation over eight blocks
    of time of every run, F(k, 7 G) for k contrasts of G runs, or no larger than a random walk from
    a common zero makes them, nor for offsets that are none of a zero
    (:func:`~winchkit.diagnosis.data.zeroing.no_zero`).
    """
    dataset = regression.dataset
    own = [s for s in regression.segments if s.output == output]
    own = [s for s in own if not (output == "cable_length" and dataset.recordings[s.run].zeroed)]
    if len(own) < 2 or output in dataset.zeroed_anew:
        return None
    valid = [dataset.recordings[s.run].valid[output] for s in own]
    run = np.concatenate([np.full(int(good.sum()), k) for k, good in enumerate(valid)])
    place = [regression.segments.index(s) for s in own]

    def in_time(rows: Array) -> Array:
        parts = regression.in_time(rows)
        return np.concatenate([parts[k][good] for k, good in zip(place, valid, strict=True)])

    residual = in_time(fit.residual)
    levels = [np.ones(len(own)), *_settings(dataset, [s.run for s in own])]
    known = [in_time(column) for column in fit.jacobian.T] + [level[run] for level in levels]
    basis = _orthonormal(np.column_stack(known))
    offsets = (run[:, None] == np.arange(len(own))).astype(float)
    offsets -= basis @ (basis.T @ offsets)
    left = residual - basis @ (basis.T @ residual)
    counts = np.bincount(run).astype(float)
    values, vectors = np.linalg.eigh(offsets.T @ offsets / np.sqrt(np.outer(counts, counts)))
    kept = values > _LEAST_SHARE
    if not kept.any():
        return None
    through = vectors[:, kept] / np.sqrt(values[kept]) / np.sqrt(counts)[:, None]
    directions = offsets @ through
    amplitudes = directions.T @ left
    rest = left - directions @ amplitudes
    blocks = [np.array_split(np.flatnonzero(run == k), BLOCKS) for k in range(len(own))]
    means = np.array([[float(rest[b].mean()) for b in every] for every in blocks])
    long_run = float(np.mean(counts / BLOCKS * means.var(axis=1, ddof=1)))
    explained = float(np.mean(amplitudes**2))
    if long_run <= 0.0:
        return None
    p_value = float(fdtrc(len(amplitudes), (BLOCKS - 1) * len(own), explained / long_run))
    shifts = np.array(
        [float((rest + directions @ amplitudes)[run == k].mean()) for k in range(len(own))]
    )
    if p_value >= LEVEL or is_random_walk(means + (shifts - shifts.mean())[:, None]):
        return None
    found = zeroed_finding(output, float(np.std(shifts, ddof=1)), p_value, "runs")
    measured = [dataset.recordings[s.run].measured[output] for s in own]
    rates = [motion.motor_rate for motion in dataset.motions]
    return None if no_zero(found, rates, measured) else found


def run_offsets(
    regression: TimeSeriesRegression, fit: Fit, spread: Spread
) -> tuple[RunOffset, ...]:
    """Fitted offsets of single runs, in the order of the nuisance parameters."""
    return tuple(
        RunOffset(
            output=segment.output,
            run=regression.dataset.recordings[segment.run].name,
            value=float(fit.vector[index]),
            std=float(spread.std[index]),
            unit=OUTPUT_UNITS[segment.output],
        )
        for index, segment in enumerate(regression.run_offset_segments)
    )


def may_be_zeros(regression: TimeSeriesRegression, fit: Fit) -> bool:
    """Whether fitted offsets of runs are still as small as those of an instrument's zero."""
    segments, dataset = regression.run_offset_segments, regression.dataset
    for finding in dataset.sanity:
        places = [k for k, own in enumerate(segments) if own.output == finding.channel]
        if finding.code == "zeroed-anew" and len(places) > 1:
            spread = float(np.std(fit.vector[places], ddof=1))
            runs = [segments[k].run for k in places]
            rates = [dataset.motions[run].motor_rate for run in runs]
            measured = [dataset.recordings[run].measured[finding.channel] for run in runs]
            if no_zero(replace(finding, value=spread), rates, measured):
                return False
    return True


def _settings(dataset: Dataset, runs: list[int]) -> list[Array]:
    """Mean load and temperature of every run, less their means, where they are known and differ."""
    signals = [dataset.recordings[run].signals for run in runs]
    loads = [mean_load(own) for own in signals]
    warmth = [
        None if own.temperature is None else float(np.mean(own.temperature)) for own in signals
    ]
    out = []
    for values in (loads, warmth):
        known = [value for value in values if value is not None]
        if len(known) == len(values) and np.ptp(known) > 0:
            out.append(np.asarray(known) - np.mean(known))
    return out


def _orthonormal(columns: Array) -> Array:
    size = np.sqrt(np.maximum(np.sum(columns**2, axis=0), 1e-300))
    left, values, _ = np.linalg.svd(columns / size, full_matrices=False)
    return np.asarray(left[:, values > np.sqrt(_LEAST_SHARE) * values[0]])
