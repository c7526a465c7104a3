"""Comparison of a profile with runs: errors per output and the variables that explain them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.spectrum import WHOLE_TRANSITION
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.profiles import Profile, of_wing, require_winch
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import evaluated
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import replicate_rms
from winchkit.diagnosis.regression.run_offsets import offset_between_runs
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import Attribution, attributions, harmonics
from winchkit.diagnosis.residuals.maps import residual_maps
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile


@dataclass(frozen=True)
class Compared:
    """A comparison with the data and the model that it was derived from, for reports."""

    regression: Regression
    comparison: Comparison
    """What is printed."""


@dataclass(frozen=True)
class WinchCompared(Compared):
    """A comparison of a winch's runs."""

    regression: TimeSeriesRegression
    residual: Array
    """Measured minus predicted, shape (n_rows,)."""


def compare(
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Comparison:
    """Compare runs with a profile, its effects at their file values, only the length offset fitted.

    Parameters
    ----------
    runs
        Recorded runs; of a robot with motor angles and measured poses.
    profile
        The winch, or the robot, of which nothing is fitted.
    catalogue
        Effects; by default all that are installed.
    band
        Cut-off frequency of the torque's low-pass filter, Hz.

    Returns
    -------
    Comparison
        Errors per output, with their noise floor and their attribution.

    Raises
    ------
    RunError
        With every fault of every run.
    """
    return compared(runs, profile, catalogue, band).comparison


@overload
def compared(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> WinchCompared: ...


@overload
def compared(
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Compared: ...


def compared(
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Compared:
    """The same as :func:`compare`, with the data and the model."""
    if (by_wing := of_wing("compare", profile, band)) is not None:
        found: Compared = by_wing(runs, profile, catalogue)
        return found
    profile = require_winch(profile)
    regression = TimeSeriesRegression(
        prepare(runs, profile, band, kept_cut_offs=WHOLE_TRANSITION, catalogue=catalogue)
    )
    hypothesis = initial_hypothesis(profile, catalogue, regression)
    residual, offset = _without_offsets(hypothesis, regression)
    shares, orders = attributions(regression, residual), harmonics(regression, residual)
    noise = replicate_rms(regression, residual)
    offsets = _offsets_between_runs(hypothesis, regression)
    outputs = {}
    for output in regression.dataset.outputs:
        error = regression.compared_samples(residual, output)
        own = [s for s in regression.segments if s.output == output]
        outputs[output] = OutputError(
            unit=OUTPUT_UNITS[output],
            samples=len(error),
            band=own[0].band.cut_off,
            signal_rms=regression.signal_rms(output),
            rms=float(np.sqrt(np.mean(error**2))),
            max=float(np.max(np.abs(error))),
            bias=float(np.mean(error)),
            noise_rms=noise.get(output),
            follows=tuple((f.variable, f.share) for f in shares if f.output == output),
            orders=tuple((f.variable, _order(f), f.share) for f in orders if f.output == output),
            rms_with_run_offsets=_rms_within_runs(regression, residual, output)
            if output in offsets
            else None,
            variation=regression.variation(output),
        )
    maps = tuple(residual_maps(regression, residual))
    dataset = regression.dataset
    comparison = Comparison(
        outputs,
        offset,
        (*dataset.notes, *(_offset_note(o, outputs[o], offsets[o]) for o in offsets)),
        maps,
        sanity=dataset.sanity,
        used_share=dataset.used_share,
        removed=dataset.removed,
        caveats=dataset.caveats,
        traces=traces_of(regression, residual),
    )
    return WinchCompared(regression, in_units_of(profile, comparison), residual)


def initial_residual(catalogue: Catalogue, regression: TimeSeriesRegression) -> Array:
    """Measured minus predicted by a profile at its file values, only the length offset fitted."""
    hypothesis = initial_hypothesis(regression.dataset.profile, catalogue, regression)
    return _without_offsets(hypothesis, regression)[0]


def _without_offsets(
    hypothesis: Hypothesis, regression: TimeSeriesRegression
) -> tuple[Array, float | None]:
    """Residual of a hypothesis with the offsets of the length fitted, and their mean, m."""
    residual = regression.residual(hypothesis)
    offsets = regression.n_run_offsets + int(regression.fits_offset)
    if not offsets:
        return residual, None
    columns = regression.nuisance_columns[:, :offsets]
    fitted = np.linalg.lstsq(columns, residual, rcond=None)[0]
    lengths = _of_length(regression, columns)
    return residual - columns @ fitted, float(np.mean(fitted[lengths])) if lengths.any() else None


def _offsets_between_runs(
    hypothesis: Hypothesis, regression: TimeSeriesRegression
) -> dict[str, float]:
    """Standard deviation of an offset between runs without repeats, SI, of outputs that have one.

    It is reported and not taken out: a model with another constant error in every run looks the
    same.
    """
    if regression.dataset.repeated:
        return {}
    at = evaluated(regression, hypothesis, np.ones(regression.n_rows))
    found = {output: offset_between_runs(regression, at, output) for output in regression.outputs}
    return {output: one.value for output, one in found.items() if one is not None}


def _rms_within_runs(regression: TimeSeriesRegression, residual: Array, output: str) -> float:
    """Error of an output less its mean in every run, rms, SI."""
    squares, count = 0.0, 0
    for segment, error in zip(regression.segments, regression.in_time(residual), strict=True):
        if segment.output == output:
            own = error[regression.dataset.recordings[segment.run].valid[output]]
            squares, count = squares + len(own) * float(np.var(own)), count + len(own)
    return float(np.sqrt(squares / count))


def _offset_note(output: str, error: OutputError, spread: float) -> str:
    return (
        f"{output.replace('_', ' ')}: the mean error differs between the runs by "
        f"{quantity(spread, error.unit)} (standard deviation): another zero of the "
        "instrument in every run, or an effect of what differs between them; with an offset per "
        "run the error is "
        f"{quantity(error.rms_with_run_offsets or 0.0, error.unit)} rms"
    )


def initial_hypothesis(
    profile: WinchProfile, catalogue: Catalogue | None, regression: TimeSeriesRegression
) -> Hypothesis:
    """The profile's own effects at their file values."""
    hypothesis = Hypothesis()
    for term in terms_of(profile, catalogue):
        hypothesis = hypothesis.with_term(term, regression.n_runs)
    return hypothesis


def _of_length(regression: TimeSeriesRegression, columns: Array) -> NDArray[np.bool_]:
    """Offset columns of the length instrument."""
    rows = np.zeros(regression.n_rows, dtype=bool)
    for segment in regression.segments:
        rows[segment.rows] = segment.output == "cable_length"
    return np.asarray(np.any(columns[rows] != 0, axis=0))


def _order(found: Attribution) -> int:
    return found.order or 1
