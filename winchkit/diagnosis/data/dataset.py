"""Data set of a diagnosis: runs with masks, bands, repeats and nominal predictions.

Samples that are NaN take no part in any figure. Inputs are interpolated over them so that
derivatives and effects with memory stay defined; the interpolated samples are not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.decimation import Decimation, decimation_for
from winchkit.diagnosis.data.input_denoising import denoised_motions
from winchkit.diagnosis.data.repeats import Repeats, find_repeats
from winchkit.diagnosis.data.sampling import bridged, gaps
from winchkit.diagnosis.data.spectrum import Band, torque_band
from winchkit.diagnosis.data.transients import transient_mask
from winchkit.diagnosis.data.validation import validate_runs
from winchkit.errors import UsageError
from winchkit.model.line import Line, Motion
from winchkit.model.stages import OUTPUTS, At, Signals
from winchkit.runs.run import Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["Dataset", "Filtering", "Recording", "assemble", "prepare"]

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Filtering:
    """Filter settings of the outputs before they are compared."""

    band: float | None = None
    """Cut-off of the torque's low-pass, Hz; None for the default."""
    kept_cut_offs: float = 1.0
    """Coefficients are kept up to this many cut-offs."""
    decimation: Decimation | None = None
    """Decimation of long runs; None for none."""


_GAP_MARGIN = 0.25


@dataclass(frozen=True)
class Recording:
    """One run with masks, and the nominal model's prediction along it."""

    name: str
    signals: Signals
    measured: Mapping[str, Array]
    """Outputs, interpolated where NaN, (n,) each."""
    valid: Mapping[str, Mask]
    """Where an output is compared, (n,) each."""
    bands: Mapping[str, Band]
    zeroed: bool
    """Whether the length instrument was zeroed: no offset is fitted."""
    raw: Motion
    smooth: Motion
    """The same motion with denoised inputs, on which changes by effects are evaluated."""
    nominal: Mapping[str, Array]
    """Prediction of the profile without effects on ``raw``."""
    nominal_smooth: Mapping[str, Array]
    programme: str = ""
    path: str = ""
    """File that it was read from."""
    decimated: bool = False
    """Whether the run was decimated, so that its derivatives were taken at a higher rate."""


@dataclass(frozen=True)
class Dataset:
    """Recordings of one winch with its profile and the partition into repeats."""

    profile: WinchProfile
    recordings: tuple[Recording, ...]
    repeats: tuple[Repeats, ...]
    notes: tuple[str, ...] = ()

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs that at least one recording has, in a fixed order."""
        return tuple(o for o in OUTPUTS if any(o in r.measured for r in self.recordings))

    @property
    def motions(self) -> tuple[At, ...]:
        """Nominal motion of every recording."""
        return tuple(recording.raw.at for recording in self.recordings)

    @property
    def used_share(self) -> dict[str, float]:
        """Share of the samples that is compared, by output."""
        out = {}
        for output in self.outputs:
            valid = [r.valid[output] for r in self.recordings if output in r.valid]
            out[output] = float(np.mean(np.concatenate(valid)))
        return out

    @property
    def repeated(self) -> tuple[Repeats, ...]:
        """Sets of at least two repeats."""
        return tuple(group for group in self.repeats if len(group.runs) > 1)


def prepare(
    runs: Sequence[Run],
    profile: WinchProfile,
    band: float | None = None,
    kept_cut_offs: float = 1.0,
    *,
    decimate: bool = False,
) -> Dataset:
    """Validate runs and build their data set.

    Parameters
    ----------
    runs
        Measured runs of one winch.
    profile
        Winch profile.
    band
        Cut-off of the torque's low-pass, Hz; None for 20 Hz or a tenth of the sampling rate.
    kept_cut_offs
        Coefficients are kept up to this many cut-offs: 1 for fits, more for the rms of a filtered
        signal, to which the transition band contributes.
    decimate
        Whether long runs are decimated as far as their signals allow.

    Raises
    ------
    RunError
        With every fault of every run.
    UsageError
        If ``band`` is not a positive frequency.
    """
    if band is not None and not 0 < band < np.inf:
        raise UsageError(f"band {band} Hz: no low-pass; give a frequency above zero")
    notes = validate_runs(runs, profile)
    decimation = decimation_for(runs) if decimate else None
    if decimation is not None:
        notes.append(decimation.words)
    filtering = Filtering(band, kept_cut_offs, decimation)
    return replace(assemble(runs, profile, filtering), notes=tuple(notes))


def assemble(
    runs: Sequence[Run], profile: WinchProfile, filtering: Filtering | None = None
) -> Dataset:
    """Build the data set of runs that were validated before."""
    line, filtering = Line(profile), filtering or Filtering()
    fastest = max((_fastest(run) for run in runs), default=0.0)
    raw = [line.motion(_signals(run, profile, fastest)) for run in runs]
    decimation = filtering.decimation
    if decimation is not None:
        raw = [decimation.motion(motion) for motion in raw]
        runs = [decimation.run(run) for run in runs]
    signals = [_signals(run, profile, fastest) for run in runs]
    repeats = find_repeats(signals)
    smooth = denoised_motions(line, signals, raw, repeats)
    recordings = tuple(
        _recording(run, own, (motion, denoised), line, filtering)
        for run, own, motion, denoised in zip(runs, signals, raw, smooth, strict=True)
    )
    return Dataset(profile, recordings, tuple(repeats))


def _fastest(run: Run) -> float:
    """Fastest motor rate of a run, rad/s."""
    rate = np.gradient(bridged(run["motor_angle"]), run.time)
    return float(np.max(np.abs(rate)))


def _signals(run: Run, profile: WinchProfile, fastest: float) -> Signals:
    def channel(name: str) -> Array | None:
        return bridged(run[name]) if name in run and np.isfinite(run[name]).any() else None

    has_cable = not isinstance(profile, AxisProfile)
    return Signals(
        time=run.time,
        motor_angle=bridged(run["motor_angle"]),
        load=channel("load") if has_cable else None,
        load_mass=run.load_mass if has_cable else None,
        tension=channel("tension") if has_cable else None,
        temperature=channel("temperature"),
        motor_velocity=channel("motor_velocity"),
        motor_torque=channel("motor_torque"),
        fastest=fastest,
    )


def _recording(
    run: Run, signals: Signals, motions: tuple[Motion, Motion], line: Line, filtering: Filtering
) -> Recording:
    raw, smooth = motions
    nominal = line.predict(raw)
    predicted = ("motor_torque",) if isinstance(line.profile, AxisProfile) else OUTPUTS
    outputs = [output for output in predicted if output in run and output in nominal]
    bands = {output: _band(run, output, filtering) for output in outputs}
    return Recording(
        name=run.name,
        signals=signals,
        measured={output: bridged(run[output]) for output in outputs},
        valid={output: _valid(run, output, raw, bands[output]) for output in outputs},
        bands=bands,
        zeroed=run.length_zeroed,
        raw=raw,
        smooth=smooth,
        nominal=nominal,
        nominal_smooth=line.predict(smooth),
        programme=run.metadata.get("programme", ""),
        path=run.path,
        decimated=filtering.decimation is not None,
    )


def _band(run: Run, output: str, filtering: Filtering) -> Band:
    rate, decimation, cut_off = 1 / run.interval, filtering.decimation, None
    if output == "motor_torque":
        full = rate if decimation is None else rate * decimation.factor
        cut_off = filtering.band or torque_band(full)
    if decimation is not None:
        cut_off = min(cut_off or np.inf, decimation.cut_off)
    return Band(len(run), rate, cut_off, filtering.kept_cut_offs)


def _valid(run: Run, output: str, motion: Motion, band: Band) -> Mask:
    """Samples of an output that are compared: measured, with known inputs, away from transients."""
    compared = np.isfinite(run[output]) & np.isfinite(run["motor_angle"])
    compared &= _away_from_time_gaps(run.time)
    if motion.load is not None and "load" in run:
        compared &= np.isfinite(run["load"])
    if output != "cable_length":
        # No acceleration at the ends of a run: finite differences reach beyond them.
        edge = 1 + motion.clock.reach
        compared[:edge] = compared[-edge:] = False
    compared = _away_from_gaps(compared, band.rate, band.cut_off)
    if output != "cable_length":
        compared &= ~transient_mask(run.time, bridged(run[output]), output, motion)
    return compared


def _away_from_time_gaps(time: Array) -> Mask:
    """Samples away from gaps in time, within which the motion is not known."""
    out = np.ones(len(time), dtype=bool)
    for index in gaps(time):
        out &= (time < time[index] - _GAP_MARGIN) | (time > time[index + 1] + _GAP_MARGIN)
    return out


def _away_from_gaps(compared: Mask, rate: float, cut_off: float | None) -> Mask:
    """Samples away from interpolated ones, by the length of the low-pass's response."""
    reach = 1 if cut_off is None else max(1, round(rate / cut_off))
    if compared.all():
        return compared
    affected = np.convolve(~compared, np.ones(2 * reach + 1), mode="same") > 0
    return ~affected
