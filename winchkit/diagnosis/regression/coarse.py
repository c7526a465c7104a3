"""Coarse regression: every k-th sample of one run of each set of repeats.

A fit from several starting values is first made here, where predictions cost a tenth. Samples are
taken without a low-pass: model and measurement have the same instants, so that neither loses a
frequency to which an effect belongs. The fit on all samples from its best points removes the error
of the differences over longer steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.diagnosis.data.spectrum import Band
from winchkit.diagnosis.regression.base import Coarse
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise, bands_at
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.line import Motion

_SAMPLES = 4000
"""Samples of all runs that are aimed at."""
_LEAST_SAMPLES = 400
"""Samples that a run keeps at least."""

Sampled = TypeVar("Sampled")


def coarse_regression(regression: TimeSeriesRegression) -> CoarseTimeSeries | None:
    """Coarse regression of a regression; None where the runs are short already."""
    dataset = regression.dataset
    chosen = sorted(group.runs[0] for group in dataset.repeats)
    counts = [len(dataset.recordings[run].signals.time) for run in chosen]
    step = min(sum(counts) // _SAMPLES, min(counts) // _LEAST_SAMPLES)
    if step < 2:
        return None
    recordings = tuple(_subsampled(dataset.recordings[run], step) for run in chosen)
    repeats = tuple(
        Repeats((index,), (np.arange(len(recording.signals.time)),))
        for index, recording in enumerate(recordings)
    )
    coarse = TimeSeriesRegression(replace(dataset, recordings=recordings, repeats=repeats))
    alike = coarse.nuisance_columns.shape[1] == regression.nuisance_columns.shape[1]
    return CoarseTimeSeries(regression, coarse, chosen) if alike else None


class CoarseTimeSeries(Coarse):
    """Coarse regression of a winch's runs; ``chosen`` are the runs of ``whole`` behind its own."""

    regression: TimeSeriesRegression

    def __init__(
        self, whole: TimeSeriesRegression, regression: TimeSeriesRegression, chosen: list[int]
    ) -> None:
        super().__init__(regression)
        self._chosen = chosen
        first = {run: group.runs[0] for group in whole.dataset.repeats for run in group.runs}
        self._place = [chosen.index(first[run]) for run in range(whole.n_runs)]
        self._band_of_row = bands_at(whole.bands, regression)

    def reduced(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis with the initial states of the chosen runs."""
        return replace(
            hypothesis,
            starts=tuple(
                tuple(s[run] for run in self._chosen) if s else () for s in hypothesis.starts
            ),
        )

    def extended(self, hypothesis: Hypothesis) -> Hypothesis:
        """The hypothesis with the initial states of all runs, repeats alike, and without the
        correction of the discretisation error, which belongs to the coarse step."""
        nuisances = hypothesis.nuisances
        if nuisances and self.regression.fits_discretization:
            nuisances = (*nuisances[:-1], 0.0)
        return replace(
            hypothesis,
            nuisances=nuisances,
            starts=tuple(tuple(s[i] for i in self._place) if s else () for s in hypothesis.starts),
        )

    def inverse_sigma(self, noise: BandNoise) -> Array:
        """1/σ of every row of the coarse regression, from the whole one's bands."""
        return np.asarray(1 / np.sqrt(noise.power[self._band_of_row]))


def _subsampled(recording: Recording, step: int) -> Recording:
    """Every ``step``-th sample of a run."""

    def each(values: Mapping[str, Any]) -> dict[str, Any]:
        return {name: np.ascontiguousarray(own[::step]) for name, own in values.items()}

    return replace(
        recording,
        signals=_every(recording.signals, step),
        measured=each(recording.measured),
        valid=each(recording.valid),
        bands={
            output: Band(-(-band.count // step), band.rate / step, band.cut_off)
            for output, band in recording.bands.items()
        },
        raw=_subsampled_motion(recording.raw, step),
        smooth=_subsampled_motion(recording.smooth, step),
        nominal=each(recording.nominal),
        nominal_smooth=each(recording.nominal_smooth),
    )


def _subsampled_motion(motion: Motion, step: int) -> Motion:
    at = _every(motion.at, step)
    return replace(_every(motion, step), at=at, clock=SamplingTimes(at.time))


def _every(signals: Sampled, step: int) -> Sampled:
    """The same dataclass with every ``step``-th sample of its arrays."""
    arrays = {
        field.name: np.ascontiguousarray(value[::step])
        for field in fields(signals)  # type: ignore[arg-type]
        if isinstance(value := getattr(signals, field.name), np.ndarray)
    }
    return replace(signals, **arrays)  # type: ignore[type-var]
