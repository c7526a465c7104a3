"""Regression problem of a winch's runs: spectral coefficients of every output of every run.

Rows are the discrete cosine transform (DCT-II, orthonormal) of measured minus predicted, within
each output's band. Nuisance parameters are the offset of the length instrument (one of all runs, or
one per run where it was zeroed anew) and, with a known weight as the load, the correction of its
acceleration's discretisation error.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.instrument_rounding import (
    RoundingError,
    instrument_noise,
    rounding_errors,
)
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.diagnosis.data.requirements import excites, missing_needs
from winchkit.diagnosis.data.spectrum import (
    WHOLE_TRANSITION,
    band_edges,
    low_pass,
    narrow_edges,
    to_time,
)
from winchkit.diagnosis.regression.base import Folds, Regression, Segment
from winchkit.diagnosis.regression.discretization import discretization_error
from winchkit.diagnosis.regression.folds import five_blocks, group_folds, time_blocks
from winchkit.diagnosis.regression.hypothesis import Hypothesis, started
from winchkit.diagnosis.regression.prediction_cache import Predictor, masked
from winchkit.effects.effect import Effect
from winchkit.model.line import Line
from winchkit.model.stages import At, Stage


class TimeSeriesRegression(Regression):
    """Regression of a winch's runs on the effects of a hypothesis."""

    def __init__(self, dataset: Dataset) -> None:
        super().__init__(_segments(dataset), len(dataset.recordings))
        self.dataset = dataset
        self._predictors = [Predictor(dataset.profile, r) for r in dataset.recordings]
        self.nominal_residual = self._nominal_residual()
        run_offsets, offset = self._run_offset_columns(), self._offset_column()
        discretization = self._discretization_column()
        self.n_run_offsets = len(run_offsets)
        self.fits_offset = bool(np.any(offset))
        self.fits_discretization = bool(np.any(discretization))
        present = [c for c in (*run_offsets, offset, discretization) if np.any(c)]
        self.nuisance_columns = np.array(present).reshape(len(present), self.n_rows).T

    @property
    def outputs(self) -> tuple[str, ...]:
        """Measured outputs, in a fixed order."""
        return self.dataset.outputs

    @cached_property
    def band_of_row(self) -> NDArray[np.intp]:
        """Noise band of every row, numbered through all outputs, shape (n_rows,)."""
        return self._bands[0]

    @cached_property
    def bands(self) -> list[tuple[str, float, float]]:
        """Output and frequency range in Hz of every noise band."""
        return self._bands[1]

    @cached_property
    def power_floor(self) -> Array:
        """Lower limit of the noise variance.

        The larger of (10⁻⁸ of the output's standard deviation)² and the quantisation noise: white
        noise of variance step²/12 at the full rate, through the low-pass of the output.
        """
        size = {
            output: max(
                float(np.std(r.measured[output]))
                for r in self.dataset.recordings
                if output in r.measured
            )
            for output in self.outputs
        }
        least = np.array([(1e-8 * size[output]) ** 2 or 1e-300 for output, _, _ in self.bands])
        return np.asarray(np.maximum(least, self._quantisation_power))

    @cached_property
    def _quantisation_power(self) -> Array:
        """Variance of a spectral coefficient by rounding, mean over every band; the error that m
        repeats share has m times its variance in each, since in their mean it is whole."""
        power = np.zeros(len(self.bands))
        count = np.zeros(len(self.bands))
        repeats = {run: len(group.runs) for group in self.replicates for run in group.runs}
        for segment in self.segments:
            bands = self.band_of_row[segment.rows]
            np.add.at(count, bands, self.share_of_row[segment.rows])
            measured = self.share_of_row[segment.rows] * segment.band.gain**2
            own = np.zeros(len(bands))
            for error in self.rounding_errors(segment):
                shared = np.sum(error.components**2, axis=0)
                own += error.white * measured + repeats.get(segment.run, 1) * shared
            np.add.at(power, bands, own / self.dataset.decimation_factor)
        return power / np.maximum(count, 1.0)

    @cached_property
    def share_of_row(self) -> Array:
        """Share of a run's samples of an output that are compared, at every row, (n_rows,)."""
        out = np.empty(self.n_rows)
        for segment in self.segments:
            valid = self.dataset.recordings[segment.run].valid[segment.output]
            out[segment.rows] = np.mean(valid)
        return out

    @cached_property
    def _noise_before_rounding(self) -> dict[str, float]:
        return instrument_noise(self.dataset.recordings, self.dataset.resolution)

    def rounding_errors(self, segment: Segment, change: Array | None = None) -> list[RoundingError]:
        """Rounding errors in a segment, of its instrument and of a measured input, at its rows.

        The signal is the prediction with the ``change`` by effects, (n_rows,), if it is given. The
        variance ``white`` is that in time.
        """
        noise = self._noise_before_rounding
        added = None if change is None else to_time(change[segment.rows], segment.band)
        found = rounding_errors(self.dataset, segment.run, segment.output, noise, added)
        return [
            replace(
                one, components=np.array([self._masked(segment, each) for each in one.components])
            )
            for one in found
        ]

    @property
    def n_observations(self) -> int:
        """Number of rows, less the share that is not compared."""
        return max(1, round(float(np.sum(self.share_of_row))))

    def n_samples(self, output: str) -> int:
        """Number of compared samples of an output; the others are zero in every residual."""
        there = [r.valid[output] for r in self.dataset.recordings if output in r.valid]
        return max(1, sum(int(np.count_nonzero(valid)) for valid in there))

    def in_time(self, rows: Array) -> list[Array]:
        """Inverse transform of the rows, one array of samples per segment."""
        return [to_time(rows[s.rows], s.band) for s in self.segments]

    def compared_samples(self, rows: Array, output: str) -> Array:
        """Rows (n_rows,) of one output as samples in time, those compared, runs in sequence."""
        recordings = self.dataset.recordings
        return np.concatenate(
            [
                to_time(rows[s.rows], s.band)[recordings[s.run].valid[output]]
                for s in self.segments
                if s.output == output
            ]
        )

    def measured_of(self, segment: Segment) -> tuple[Array, NDArray[np.bool_]]:
        """Measured output of a segment within its band (n,), SI, and the samples compared (n,)."""
        recording = self.dataset.recordings[segment.run]
        band, signal = recording.bands[segment.output], recording.measured[segment.output]
        if band.cut_off is not None:
            signal = low_pass(signal, band.rate, band.cut_off)
        return signal, recording.valid[segment.output]

    def measured_samples(self, output: str) -> list[tuple[Array, NDArray[np.bool_]]]:
        """The same of every run that measured an output."""
        return [self.measured_of(s) for s in self.segments if s.output == output]

    def has_run_offsets(self, output: str) -> bool:
        """Whether the instrument of an output has an offset in every run."""
        return any(segment.output == output for segment in self.run_offset_segments)

    def signal_rms(self, output: str) -> float:
        """Rms of a measured output within the band of the comparison, SI."""
        known = self._known(output)
        return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")

    def variation(self, output: str) -> float:
        """Standard deviation of the same over all runs, SI."""
        known = self._known(output)
        return float(np.std(known)) if len(known) else float("nan")

    def _known(self, output: str) -> Array:
        return np.concatenate([signal[valid] for signal, valid in self.measured_samples(output)])

    def change(self, hypothesis: Hypothesis, outputs: Container[str] | None = None) -> Array:
        """Change of the prediction by the effects; see :meth:`Regression.change`."""
        if not hypothesis.terms:
            return np.zeros(self.n_rows)
        terms = [started(hypothesis, run) for run in range(self.n_runs)]
        correction = (
            hypothesis.nuisances[-1] if self.fits_discretization and hypothesis.nuisances else None
        )
        out = np.empty(self.n_rows)
        for segment in self.segments:
            if outputs is None or segment.output in outputs:
                predictor = self._predictors[segment.run]
                out[segment.rows] = predictor.change(segment.output, terms[segment.run], correction)
        return out

    def outputs_of(self, stage: Stage) -> set[str]:
        """Measured outputs that a stage of the model acts on in at least one run."""
        reached = {output for p in self._predictors for output in p.outputs_of(stage)}
        return reached & set(self.outputs)

    def discretization_error(self, hypothesis: Hypothesis) -> Array:
        """Change of the prediction on a four times finer time grid, shape (n_rows,)."""
        return discretization_error(self.dataset, self.segments, hypothesis)

    def unfiltered(self) -> TimeSeriesRegression:
        """The same regression with the rows above the low-pass filter's cut-off."""
        recordings = tuple(
            replace(
                r, bands={o: replace(b, kept_cut_offs=WHOLE_TRANSITION) for o, b in r.bands.items()}
            )
            for r in self.dataset.recordings
        )
        return TimeSeriesRegression(replace(self.dataset, recordings=recordings))

    @property
    def motions(self) -> tuple[At, ...]:
        """Motion of every run."""
        return self.dataset.motions

    def missing_needs(self, effect: Effect) -> list[str]:
        """Parts and channels that an effect needs and that are absent, in words."""
        return missing_needs(effect, self.dataset)

    def excites(self, shape: Mapping[str, float]) -> bool:
        """Whether the motor turns through two periods of an effect's order in one run."""
        return excites(shape, self.dataset)

    @property
    def replicates(self) -> Sequence[Repeats]:
        """Sets of at least two runs of one programme and load."""
        return self.dataset.repeated

    @cached_property
    def group_of_run(self) -> tuple[int, ...]:
        """Group of equal programme and load of every run."""
        groups = enumerate(self.dataset.repeats)
        group_of_run = {run: index for index, group in groups for run in group.runs}
        return tuple(group_of_run[run] for run in range(self.n_runs))

    @cached_property
    def blocks(self) -> Folds:
        """48 contiguous blocks of time or, of many runs, at least two per run."""
        return time_blocks(self.segments, [len(r.signals.time) for r in self.dataset.recordings])

    @cached_property
    def five_blocks(self) -> Folds:
        """Five contiguous blocks of time."""
        return five_blocks(self.blocks)

    @cached_property
    def groups(self) -> Folds:
        """Groups of equal programme and load; with one group only, five blocks of time."""
        return group_folds(self.segments, self.group_of_run) or five_blocks(self.blocks)

    def _masked(self, segment: Segment, signal: Array) -> Array:
        return masked(self.dataset.recordings[segment.run], segment.output, signal)

    def _nominal_residual(self) -> Array:
        out = np.zeros(self.n_rows)
        for segment in self.segments:
            recording = self.dataset.recordings[segment.run]
            error = recording.measured[segment.output] - recording.nominal[segment.output]
            out[segment.rows] = self._masked(segment, error)
        return out

    @cached_property
    def run_offset_segments(self) -> tuple[Segment, ...]:
        """Segments of instruments that were zeroed anew, each of which has an offset of its own."""
        recordings = self.dataset.recordings
        return tuple(
            s
            for s in self.segments
            if s.output in self.dataset.zeroed_anew
            and not (s.output == "cable_length" and recordings[s.run].zeroed)
        )

    def _run_offset_columns(self) -> list[Array]:
        out = []
        for segment in self.run_offset_segments:
            column = np.zeros(self.n_rows)
            column[segment.rows] = self._masked(segment, np.ones(segment.band.count))
            out.append(column)
        return out

    def _offset_column(self) -> Array:
        out = np.zeros(self.n_rows)
        if "cable_length" in self.dataset.zeroed_anew:
            return out
        for segment in self.segments:
            recording = self.dataset.recordings[segment.run]
            if segment.output == "cable_length" and not recording.zeroed:
                out[segment.rows] = self._masked(segment, np.ones(segment.band.count))
        return out

    def _discretization_column(self) -> Array:
        """Change of the outputs per unit discretisation correction of a weight's acceleration.

        Second differences of the angle underestimate the acceleration in proportion to its second
        derivative and the squared sampling interval; without this nuisance parameter a lag of the
        cell is fitted to that error.
        """
        out = np.zeros(self.n_rows)
        for run, recording in enumerate(self.dataset.recordings):
            curvature = recording.raw.discretization
            if curvature is None or recording.raw.load is None:
                continue
            line = Line(self.dataset.profile)
            moved = line.predict(replace(recording.raw, load=recording.raw.load + curvature))
            for segment in (s for s in self.segments if s.run == run):
                change = moved[segment.output] - recording.nominal[segment.output]
                out[segment.rows] = self._masked(segment, change)
        return out

    @cached_property
    def _bands(self) -> tuple[NDArray[np.intp], list[tuple[str, float, float]]]:
        ids = np.zeros(self.n_rows, dtype=np.intp)
        bands: list[tuple[str, float, float]] = []
        for output in self.outputs:
            own = [s for s in self.segments if s.output == output]
            longest = max(own, key=lambda s: s.band.count)
            # Narrow bands are smoothed later, for the noise of repeats only.
            frequency = longest.band.frequency
            repeated = bool(self.dataset.repeated)
            edges = narrow_edges(frequency) if repeated else band_edges(frequency, 1)
            for segment in own:
                inside = np.searchsorted(edges, segment.band.frequency, side="right") - 1
                ids[segment.rows] = len(bands) + inside
            bands += [(output, max(0.0, float(low)), float(high)) for low, high in pairwise(edges)]
        return ids, bands


def _segments(dataset: Dataset) -> list[Segment]:
    segments, at = [], 0
    for output in dataset.outputs:
        for run, recording in enumerate(dataset.recordings):
            if output in recording.measured:
                band = recording.bands[output]
                kept = len(band.frequency)
                segments.append(Segment(run, output, slice(at, at + kept), band))
                at += kept
    return segments
