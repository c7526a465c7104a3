"""Data set of a diagnosis: runs with masks, bands, repeats and nominal predictions.

Samples that are NaN take no part in any figure. Inputs are interpolated over them so that
derivatives and effects with memory stay defined; the interpolated samples are not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.copies import COPIES
from winchkit.diagnosis.data.decimation import Decimation
from winchkit.diagnosis.data.input_denoising import denoised_motions
from winchkit.diagnosis.data.low_pass import RemovedBand, cut_offs_of
from winchkit.diagnosis.data.reference_length import with_measured_length
from winchkit.diagnosis.data.repeats import Repeats, find_repeats
from winchkit.diagnosis.data.sampling import away_from, bridged, bridged_channel
from winchkit.diagnosis.data.sanity import caveats
from winchkit.diagnosis.data.spectrum import Band
from winchkit.diagnosis.data.standstill import standstill_mask
from winchkit.diagnosis.data.transients import transient_mask, uncertain_force_mask
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.line import Line, Motion
from winchkit.model.stages import OUTPUTS, At, Signals
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.saturation import SATURATED
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

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


NO_REPEATS = "no-repeats"
OUTLYING = "outlying-repeat"
SEPARATED = "separate-repeats"
ROUNDED_ALIKE = "noise-floor-implausible"


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
    sanity: tuple[Finding, ...] = ()
    """Findings on the runs as recorded."""
    resolution: Mapping[str, float] = field(default_factory=dict)
    unexplained: Mapping[str, float] = field(default_factory=dict)
    """Outputs that no law explains, and the noise of their repeats, rms, SI: they are weighted by
    what the candidates leave."""
    """Resolution (quantisation step) of every output and of the load at the full rate, rms over the
    runs, SI."""
    zeroed_anew: frozenset[str] = frozenset()
    """Outputs whose instrument has another offset in every run."""
    decimation_factor: int = 1
    """Samples of the recording per sample of the data set."""
    removed: tuple[RemovedBand, ...] = ()
    """What the low-pass of every output that has one removes."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs that at least one recording has, in a fixed order."""
        return tuple(o for o in OUTPUTS if any(o in r.measured for r in self.recordings))

    @property
    def motions(self) -> tuple[At, ...]:
        """Nominal motion of every recording."""
        return tuple(recording.raw.at for recording in self.recordings)

    @property
    def profile_name(self) -> str:
        """Name within the profile's file."""
        return self.profile.name

    @property
    def run_names(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(recording.name for recording in self.recordings)

    @property
    def run_files(self) -> tuple[str, ...]:
        """Files of the runs; the name of a run that is in none."""
        return tuple(recording.path or recording.name for recording in self.recordings)

    @property
    def used_share(self) -> dict[str, float]:
        """Share of the samples that is compared, by output."""
        out = {}
        for output in self.outputs:
            valid = [r.valid[output] for r in self.recordings if output in r.valid]
            out[output] = float(np.mean(np.concatenate(valid)))
        return out

    @property
    def caveats(self) -> tuple[str, ...]:
        """Codes of what these runs cannot exclude: suspect channels first, then their repeats."""
        limits = [
            f.code
            for f in self.sanity
            if f.code in (COPIES, OUTLYING, ROUNDED_ALIKE)
            or (f.code, f.channel) == (SATURATED, "motor_torque")
        ]
        return tuple(
            dict.fromkeys(
                [*caveats(self.sanity), *limits, *([] if self.repeated else [NO_REPEATS])]
            )
        )

    @property
    def repeated(self) -> tuple[Repeats, ...]:
        """Sets of at least two repeats."""
        return tuple(group for group in self.repeats if len(group.runs) > 1)


def assemble(
    runs: Sequence[Run], profile: WinchProfile, filtering: Filtering | None = None
) -> Dataset:
    """Build the data set of runs of one winch that were validated before; at least one run."""
    line, filtering = Line(profile), filtering or Filtering()
    clocks = [_clock(run) for run in runs]
    signals = [_signals(run, profile, clock) for run, clock in zip(runs, clocks, strict=True)]
    raw = [line.motion(own) for own in signals]
    profile = with_measured_length(profile, line, runs, raw)
    if profile is not line.profile:
        line = Line(profile)
        raw = [line.motion(own) for own in signals]
    decimation = filtering.decimation
    if decimation is not None:
        raw = [decimation.motion(motion) for motion in raw]
        runs = [decimation.run(run) for run in runs]
        signals = [_signals(run, profile) for run in runs]
    repeats = find_repeats(signals, [run.load_mass for run in runs])
    smooth = denoised_motions(line, signals, raw, repeats)
    nominal = [line.predict(motion) for motion in raw]
    stands = [
        standstill_mask(bridged(run["motor_torque"]), predicted["motor_torque"], motion)
        if "motor_torque" in run and "motor_torque" in predicted
        else np.zeros(len(run), dtype=bool)
        for run, predicted, motion in zip(runs, nominal, raw, strict=True)
    ]
    cut_offs = (
        [filtering.band] * len(runs) if filtering.band else cut_offs_of(runs, nominal, stands, raw)
    )
    outputs = ("motor_torque",) if isinstance(profile, AxisProfile) else OUTPUTS
    recordings = tuple(
        Recording(
            name=run.name,
            signals=own,
            measured={output: bridged(run[output]) for output in shown},
            valid={output: _valid(run, output, motion, predicted, still) for output in shown},
            bands={output: _band(run, output, filtering, cut_off) for output in shown},
            zeroed=run.length_zeroed,
            raw=motion,
            smooth=denoised,
            nominal=predicted,
            nominal_smooth=line.predict(denoised),
            programme=run.metadata.get("programme", ""),
            path=run.path,
            decimated=decimation is not None,
        )
        for run, own, motion, denoised, predicted, still, cut_off in zip(
            runs, signals, raw, smooth, nominal, stands, cut_offs, strict=True
        )
        for shown in ([output for output in outputs if output in run and output in predicted],)
    )
    return Dataset(profile, recordings, tuple(repeats))


def _clock(run: Run) -> SamplingTimes:
    return SamplingTimes(
        run.time - run.time[0], bridged(run["motor_angle"]), bridged_channel(run, "motor_velocity")
    )


def _signals(run: Run, profile: WinchProfile, clock: SamplingTimes | None = None) -> Signals:
    has_cable = not isinstance(profile, AxisProfile)
    return Signals(
        time=run.time,
        motor_angle=bridged(run["motor_angle"]),
        load=bridged_channel(run, "load") if has_cable else None,
        load_mass=run.load_mass if has_cable else None,
        payload=None if has_cable else run.load_mass,
        tension=bridged_channel(run, "tension") if has_cable else None,
        temperature=bridged_channel(run, "temperature"),
        motor_velocity=bridged_channel(run, "motor_velocity"),
        motor_torque=bridged_channel(run, "motor_torque"),
        predicted_torque=bridged_channel(run, "predicted_torque"),
        clock=clock,
    )


def _band(run: Run, output: str, filtering: Filtering, torque_cut_off: float | None) -> Band:
    cut_off = torque_cut_off if output == "motor_torque" else None
    if filtering.decimation is not None:
        cut_off = min(cut_off or np.inf, filtering.decimation.cut_off)
    return Band(len(run), 1 / run.interval, cut_off, filtering.kept_cut_offs)


def _valid(
    run: Run, output: str, motion: Motion, nominal: Mapping[str, Array], still: Mask
) -> Mask:
    """Samples of an output that are compared: measured, with known inputs, away from transients.

    A torque at standstills that static friction determines (``still``) is not compared. Samples
    that are not compared are zero in measurement and prediction before the low-pass, so that they
    change no others.
    """
    compared = np.isfinite(run[output]) & np.isfinite(run["motor_angle"])
    if motion.load is not None and "load" in run:
        compared &= np.isfinite(run["load"])
    if output == "cable_length":
        return compared
    if output == "motor_torque" and "predicted_torque" in run:
        compared &= np.isfinite(run["predicted_torque"])
    if motion.clock.spline is None:
        # No acceleration at the ends of a run and beside gaps: differences reach beyond them.
        compared &= away_from(~np.isfinite(run["motor_angle"]), 1 + motion.clock.reach)
    measured = bridged(run[output])
    uncertain = uncertain_force_mask(measured, nominal[output], motion)
    if output == "motor_torque":
        uncertain |= still
    return compared & ~uncertain & ~transient_mask(measured, output, motion)
