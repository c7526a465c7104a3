"""A profile against measured runs: how far off, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset, prepare
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.data.spectrum import WHOLE_FILTER, low_pass
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import Problem
from winchkit.diagnosis.residuals.attribution import Followed, follows, harmonics
from winchkit.diagnosis.residuals.maps import residual_maps
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["Compared", "begin_hypothesis", "compare", "compared", "repeat_noise", "signal_rms"]


@dataclass(frozen=True)
class Compared:
    """A comparison with everything behind it, for reports."""

    problem: Problem
    residual: Array
    """Measured less predicted, (rows,)."""
    comparison: Comparison


def compare(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Comparison:
    """Compare runs with a profile, its effects at their file values, only the offset fitted.

    Raises RunError with every fault of every run.
    """
    return compared(runs, profile, catalogue, band).comparison


def compared(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Compared:
    """As :func:`compare`, with the residual that the figures were taken from."""
    problem = Problem(prepare(runs, profile, band, skirt=WHOLE_FILTER))
    start = begin_hypothesis(profile, catalogue, problem)
    residual = problem.residual(start)
    offset = None
    if problem.fits_offset:
        column = problem.nuisance_columns[:, 0]
        offset = float(column @ residual / (column @ column))
        residual = residual - offset * column
    shares, orders = follows(problem, residual), harmonics(problem, residual)
    noise = repeat_noise(problem, residual)
    outputs = {}
    for output in problem.dataset.outputs:
        error = _error(problem, residual, output)
        own = [s for s in problem.segments if s.output == output]
        outputs[output] = OutputError(
            unit=OUTPUT_UNITS[output],
            samples=len(error),
            band=own[0].band.cut_off,
            signal_rms=signal_rms(problem.dataset, output),
            rms=float(np.sqrt(np.mean(error**2))),
            max=float(np.max(np.abs(error))),
            bias=float(np.mean(error)),
            noise_rms=noise.get(output),
            follows=tuple((f.variable, f.share) for f in shares if f.output == output),
            orders=tuple((f.variable, _order(f), f.share) for f in orders if f.output == output),
        )
    maps = tuple(residual_maps(problem, residual))
    return Compared(problem, residual, Comparison(outputs, offset, problem.dataset.notes, maps))


def begin_hypothesis(
    profile: WinchProfile, catalogue: Catalogue | None, problem: Problem
) -> Hypothesis:
    """The profile's own effects at their file values."""
    hypothesis = Hypothesis()
    for term in terms_of(profile, catalogue):
        hypothesis = hypothesis.with_term(term, problem.runs)
    return hypothesis


def _order(found: Followed) -> int:
    return found.order or 1


def signal_rms(dataset: Dataset, output: str) -> float:
    """Rms of what was measured, within the band of the comparison."""
    squares, count = 0.0, 0
    for recording in dataset.recordings:
        if output in recording.measured:
            band = recording.bands[output]
            signal = recording.measured[output]
            if band.cut_off is not None:
                signal = low_pass(signal, band.rate, band.cut_off)
            signal = signal[recording.valid[output]]
            squares += float(signal @ signal)
            count += len(signal)
    return float(np.sqrt(squares / count)) if count else float("nan")


def _error(problem: Problem, residual: Array, output: str) -> Array:
    """Residual of one output in time, compared samples of all runs."""
    parts = [
        time[problem.dataset.recordings[s.run].valid[output]]
        for s, time in zip(problem.segments, problem.in_time(residual), strict=True)
        if s.output == output
    ]
    return np.concatenate(parts)


def repeat_noise(problem: Problem, residual: Array) -> dict[str, float]:
    """Rms of the differences of repeats per output; empty without repeats."""
    times = {
        (s.run, s.output): time
        for s, time in zip(problem.segments, problem.in_time(residual), strict=True)
    }
    squares: dict[str, list[Array]] = {}
    for group in problem.dataset.repeated:
        for output in problem.dataset.outputs:
            if all((run, output) in times for run in group.runs):
                aligned = [
                    times[run, output][rows]
                    for run, rows in zip(group.runs, group.rows, strict=True)
                ]
                squares.setdefault(output, []).append(contrasts(np.array(aligned))[1].ravel() ** 2)
    return {o: float(np.sqrt(np.mean(np.concatenate(parts)))) for o, parts in squares.items()}
