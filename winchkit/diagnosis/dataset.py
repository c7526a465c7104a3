"""Runs made ready for comparison: bridged inputs, marked outputs, repeats, nominal predictions.

Samples that are NaN take no part in any figure; inputs are bridged over them only so that
derivatives and memories stay defined, and the bridged samples are not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.admit import OUTPUTS, admit
from winchkit.diagnosis.denoise import agreed, quiet
from winchkit.diagnosis.repeats import Repeats, find_repeats
from winchkit.diagnosis.spectrum import Band, torque_band
from winchkit.model.derivatives import reach_of
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals
from winchkit.runs.run import Run
from winchkit.schema.winch import WinchProfile

__all__ = ["Dataset", "Recording", "assemble", "prepare"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_GAP = 2.5
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
    def repeated(self) -> tuple[Repeats, ...]:
        """Sets with at least two runs."""
        return tuple(group for group in self.repeats if len(group.runs) > 1)


def prepare(
    runs: Sequence[Run], profile: WinchProfile, band: float | None = None, skirt: float = 1.0
) -> Dataset:
    """Build a dataset of one winch's runs. Raises RunError with every fault of every run.

    ``band`` overrides the torque's low-pass, Hz; ``skirt`` is how far beyond it is kept: what
    the filter all but removes tells nothing and is left out of fits, but belongs to an rms.
    """
    notes = admit(runs, profile)
    return replace(assemble(runs, profile, band, skirt), notes=tuple(notes))


def assemble(
    runs: Sequence[Run], profile: WinchProfile, band: float | None = None, skirt: float = 1.0
) -> Dataset:
    """Build a dataset of runs that are known to fit the profile."""
    signals = [_signals(run) for run in runs]
    repeats = find_repeats(signals)
    smooth = _denoised(signals, repeats, profile)
    recordings = tuple(
        _recording(run, raw, quiet_one, profile, (band, skirt))
        for run, raw, quiet_one in zip(runs, signals, smooth, strict=True)
    )
    return Dataset(profile, recordings, tuple(repeats))


def _bridged(values: Array) -> Array:
    """Values with NaN bridged linearly."""
    good = np.isfinite(values)
    if good.all():
        return values
    index = np.arange(len(values))
    return np.interp(index, index[good], values[good])


def _signals(run: Run) -> Signals:
    def channel(name: str) -> Array | None:
        return _bridged(run[name]) if name in run and np.isfinite(run[name]).any() else None

    return Signals(
        time=run.time,
        motor_angle=_bridged(run["motor_angle"]),
        load=channel("load"),
        load_mass=run.load_mass,
        tension=channel("tension"),
        temperature=channel("temperature"),
        motor_velocity=channel("motor_velocity"),
    )


def _denoised(
    signals: list[Signals], repeats: list[Repeats], profile: WinchProfile
) -> list[Signals]:
    """Signals whose load (or tension) and temperature carry no noise."""
    out = list(signals)
    line = Line(profile)
    for group in repeats:
        for name in ("load", "tension"):
            values = [getattr(signals[index], name) for index in group.runs]
            if any(value is None for value in values):
                continue
            followed = [
                _followed(line, signals[i], v) for i, v in zip(group.runs, values, strict=True)
            ]
            rest = [v - f for v, f in zip(values, followed, strict=True)]
            shared = agreed(rest, group.rows)
            for index, f, s in zip(group.runs, followed, shared, strict=True):
                calm = f + s
                out[index] = (
                    replace(out[index], load=calm)
                    if name == "load"
                    else replace(out[index], tension=calm)
                )
        for index in group.runs:
            temperature = signals[index].temperature
            if temperature is not None:
                out[index] = replace(out[index], temperature=quiet(temperature))
    return out


def _followed(line: Line, signals: Signals, force: Array) -> Array:
    """The part of a force that is constant or follows the rope's nominal acceleration."""
    inert = replace(signals, load=None, tension=None, load_mass=1.0)
    weight = line.motion(inert).load
    assert weight is not None
    columns = np.column_stack([np.ones_like(force), weight - weight.mean()])
    return np.asarray(columns @ np.linalg.lstsq(columns, force, rcond=None)[0])


def _recording(
    run: Run,
    raw: Signals,
    smooth: Signals,
    profile: WinchProfile,
    filtered: tuple[float | None, float],
) -> Recording:
    line = Line(profile)
    motion, motion_smooth = line.motion(raw), line.motion(smooth)
    nominal = line.predict(motion)
    rate, (band, skirt) = 1 / run.interval, filtered
    measured, valid, bands = {}, {}, {}
    inputs_ok = np.isfinite(run["motor_angle"]) & _away_from_time_gaps(run.time)
    if motion.load is not None and "load" in run:
        inputs_ok &= np.isfinite(run["load"])
    for output in OUTPUTS:
        if output not in run or output not in nominal:
            continue
        values = run[output]
        cut_off = (band or torque_band(rate)) if output == "motor_torque" else None
        measured[output] = _bridged(values)
        good = np.isfinite(values) & inputs_ok
        if output != "cable_length":
            # Accelerations at the ends of a run are not known.
            edge = 1 + reach_of(run.time)
            good[:edge] = good[-edge:] = False
        valid[output] = _away_from_gaps(good, rate, cut_off)
        bands[output] = Band(len(values), rate, cut_off, skirt)
    return Recording(
        name=run.name,
        signals=raw,
        measured=measured,
        valid=valid,
        bands=bands,
        zeroed=run.length_zeroed,
        raw=motion,
        smooth=motion_smooth,
        nominal=nominal,
        nominal_smooth=line.predict(motion_smooth),
        programme=run.metadata.get("programme", ""),
        path=run.path,
    )


def _away_from_time_gaps(time: Array) -> Mask:
    """Samples whose motion is known: what happened in a gap, and shook on after it, is not."""
    steps = np.diff(time)
    out = np.ones(len(time), dtype=bool)
    for index in np.flatnonzero(steps > _GAP * np.median(steps)):
        out &= (time < time[index] - _SHAKEN) | (time > time[index + 1] + _SHAKEN)
    return out


def _away_from_gaps(good: Mask, rate: float, cut_off: float | None) -> Mask:
    """Samples to compare: away from bridged ones by what the low-pass smears."""
    reach = 1 if cut_off is None else max(1, round(rate / cut_off))
    if good.all():
        return good
    smeared = np.convolve(~good, np.ones(2 * reach + 1), mode="same") > 0
    return ~smeared
