"""Runs made ready for comparison: bridged inputs, marked outputs, repeats, nominal predictions.

Samples that are NaN take no part in any figure; inputs are bridged over them only so that
derivatives and memories stay defined, and the bridged samples are not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.decimation import Thinning, thinning_for
from winchkit.diagnosis.data.input_denoising import calm_motions
from winchkit.diagnosis.data.repeats import Repeats, find_repeats
from winchkit.diagnosis.data.sampling import bridged, gaps
from winchkit.diagnosis.data.spectrum import Band, torque_band
from winchkit.diagnosis.data.transients import jerked
from winchkit.diagnosis.data.validation import admit
from winchkit.errors import UsageError
from winchkit.model.line import Line, Motion
from winchkit.model.stages import OUTPUTS, At, Signals
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["Dataset", "Filtering", "Recording", "assemble", "prepare"]

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Filtering:
    """How outputs are filtered before they are compared."""

    band: float | None = None
    """Low-pass of the torque, Hz; None for the usual one."""
    skirt: float = 1.0
    """How far beyond a cut-off is kept."""
    thinning: Thinning | None = None
    """How long runs are thinned out, if they are."""


_SHAKEN = 0.25


@dataclass(frozen=True)
class Recording:
    """One run, ready: what was measured, and the nominal line along it."""

    name: str
    signals: Signals
    measured: Mapping[str, Array]
    """Outputs, bridged where NaN; (n,)."""
    valid: Mapping[str, Mask]
    """Where an output may be compared."""
    bands: Mapping[str, Band]
    zeroed: bool
    """The length instrument was zeroed: no offset to fit."""
    raw: Motion
    smooth: Motion
    """The same with the noise of its inputs taken out, to evaluate changes on."""
    nominal: Mapping[str, Array]
    """Prediction of the bare profile on ``raw``."""
    nominal_smooth: Mapping[str, Array]
    programme: str = ""
    path: str = ""
    """File that it was read from."""
    thinned: bool = False
    """Its derivatives were taken at a higher rate than its samples have now."""


@dataclass(frozen=True)
class Dataset:
    """Recordings of one winch with its profile, and which of them repeat each other."""

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
        """What every recording's profile makes of its motion."""
        return tuple(recording.raw.at for recording in self.recordings)

    @property
    def repeated(self) -> tuple[Repeats, ...]:
        """Sets with at least two runs."""
        return tuple(group for group in self.repeats if len(group.runs) > 1)


def prepare(
    runs: Sequence[Run],
    profile: WinchProfile,
    band: float | None = None,
    skirt: float = 1.0,
    *,
    thin: bool = False,
) -> Dataset:
    """Build a dataset of one winch's runs. Raises RunError with every fault of every run.

    ``band`` overrides the torque's low-pass, Hz; ``skirt`` is how far beyond it is kept: what
    the filter all but removes tells nothing and is left out of fits, but belongs to an rms.
    ``thin`` lets long runs be thinned out as far as their signals allow.
    """
    if band is not None and not 0 < band < np.inf:
        raise UsageError(f"band {band} Hz: no low-pass; give a frequency above zero")
    notes = admit(runs, profile)
    thinning = thinning_for(runs) if thin else None
    if thinning is not None:
        notes.append(thinning.words)
    filtering = Filtering(band, skirt, thinning)
    return replace(assemble(runs, profile, filtering), notes=tuple(notes))


def assemble(
    runs: Sequence[Run], profile: WinchProfile, filtering: Filtering | None = None
) -> Dataset:
    """Build a dataset of runs that are known to fit the profile."""
    line, filtering = Line(profile), filtering or Filtering()
    fastest = max((_fastest(run) for run in runs), default=0.0)
    raw = [line.motion(_signals(run, fastest)) for run in runs]
    thinning = filtering.thinning
    if thinning is not None:
        raw = [thinning.motion(motion) for motion in raw]
        runs = [thinning.run(run) for run in runs]
    signals = [_signals(run, fastest) for run in runs]
    repeats = find_repeats(signals)
    smooth = calm_motions(line, signals, raw, repeats)
    recordings = tuple(
        _recording(run, own, (motion, calm), line, filtering)
        for run, own, motion, calm in zip(runs, signals, raw, smooth, strict=True)
    )
    return Dataset(profile, recordings, tuple(repeats))


def _fastest(run: Run) -> float:
    """Fastest motor rate of a run, rad/s."""
    rate = np.gradient(bridged(run["motor_angle"]), run.time)
    return float(np.max(np.abs(rate)))


def _signals(run: Run, fastest: float) -> Signals:
    def channel(name: str) -> Array | None:
        return bridged(run[name]) if name in run and np.isfinite(run[name]).any() else None

    return Signals(
        time=run.time,
        motor_angle=bridged(run["motor_angle"]),
        load=channel("load"),
        load_mass=run.load_mass,
        tension=channel("tension"),
        temperature=channel("temperature"),
        motor_velocity=channel("motor_velocity"),
        fastest=fastest,
    )


def _recording(
    run: Run, signals: Signals, motions: tuple[Motion, Motion], line: Line, filtering: Filtering
) -> Recording:
    raw, smooth = motions
    nominal = line.predict(raw)
    outputs = [output for output in OUTPUTS if output in run and output in nominal]
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
        thinned=filtering.thinning is not None,
    )


def _band(run: Run, output: str, filtering: Filtering) -> Band:
    rate, thinning, cut_off = 1 / run.interval, filtering.thinning, None
    if output == "motor_torque":
        full = rate if thinning is None else rate * thinning.factor
        cut_off = filtering.band or torque_band(full)
    if thinning is not None:
        cut_off = min(cut_off or np.inf, thinning.cut_off)
    return Band(len(run), rate, cut_off, filtering.skirt)


def _valid(run: Run, output: str, motion: Motion, band: Band) -> Mask:
    """Samples of an output that may be compared: measured, with known inputs."""
    good = np.isfinite(run[output]) & np.isfinite(run["motor_angle"])
    good &= _away_from_time_gaps(run.time)
    if motion.load is not None and "load" in run:
        good &= np.isfinite(run["load"])
    if output != "cable_length":
        # Accelerations at the ends of a run are not known.
        edge = 1 + motion.clock.reach
        good[:edge] = good[-edge:] = False
    good = _away_from_gaps(good, band.rate, band.cut_off)
    if output != "cable_length":
        good &= ~jerked(run.time, bridged(run[output]), output, motion)
    return good


def _away_from_time_gaps(time: Array) -> Mask:
    """Samples whose motion is known: what happened in a gap, and shook on after it, is not."""
    out = np.ones(len(time), dtype=bool)
    for index in gaps(time):
        out &= (time < time[index] - _SHAKEN) | (time > time[index + 1] + _SHAKEN)
    return out


def _away_from_gaps(good: Mask, rate: float, cut_off: float | None) -> Mask:
    """Samples to compare: away from bridged ones by what the low-pass smears."""
    reach = 1 if cut_off is None else max(1, round(rate / cut_off))
    if good.all():
        return good
    smeared = np.convolve(~good, np.ones(2 * reach + 1), mode="same") > 0
    return ~smeared
