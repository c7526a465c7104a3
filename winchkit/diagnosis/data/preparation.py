"""Preparation of runs for a diagnosis: validated, resampled, masked, and sorted into repeats."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from winchkit.arguments import number, require_type, require_types
from winchkit.arrays import Array
from winchkit.diagnosis.data.copies import without_copies
from winchkit.diagnosis.data.dataset import (
    OUTLYING,
    ROUNDED_ALIKE,
    SEPARATED,
    Dataset,
    Filtering,
    Mask,
    Recording,
    assemble,
)
from winchkit.diagnosis.data.decimation import decimation_for
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.data.low_pass import RemovedBand, UnfilteredOutput, removed_by_low_pass
from winchkit.diagnosis.data.repeats import (
    Repeats,
    excluded_alike,
    outlying_repeat,
    separated,
    step_of,
)
from winchkit.diagnosis.data.sampling import at_new_angles, bridged, evenly_stamped
from winchkit.diagnosis.data.sanity import findings, resolutions, usable
from winchkit.diagnosis.data.spectrum import fast_count
from winchkit.diagnosis.data.standstill import standstill_findings
from winchkit.diagnosis.data.statics import prepared_statics
from winchkit.diagnosis.data.validation import validate_runs, with_torques, without_constants
from winchkit.diagnosis.data.zeroing import angles_from_zero, as_noise, no_zero, zeroed_anew
from winchkit.diagnosis.linear_axis import errors_in_units_of
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import Fault, RunError, UsageError
from winchkit.model.stages import OUTPUT_UNITS, OUTPUTS
from winchkit.quantity_text import quantity
from winchkit.runs.linear_axis import rotary_runs
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.inspection import inspect_runs
from winchkit.runs.sanity.quantisation import quantisation_noise
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_EQUAL_TEMPERATURE = 0.5
"""Difference of mean temperatures above which repeats may differ by a thermal effect, K."""


def prepare(
    runs: Sequence[Run],
    profile: WinchProfile,
    band: float | None = None,
    kept_cut_offs: float = 1.0,
    *,
    decimate: bool = False,
    fast: bool = False,
    catalogue: Catalogue | None = None,
) -> Dataset:
    """Validate runs and build their data set.

    ``band`` is the cut-off of the torque's low-pass, Hz; None chooses it from sampling and
    residuals. ``kept_cut_offs`` is 1 for fits, and more for the rms of a filtered signal, to which
    the transition band contributes. A RunError has every fault of every run; a UsageError is raised
    where ``band`` is no positive frequency.
    """
    require_types(runs, Run, "runs")
    require_type(profile, WinchProfile, "profile")
    if band is not None and number("low-pass", "band", band) <= 0:
        raise UsageError(f"band {band} Hz: no low-pass; give a frequency above zero")
    runs = rotary_runs(runs, is_linear_axis=profile.is_linear)
    with errors_in_units_of(profile):
        return _prepared(
            runs,
            profile,
            Filtering(band, kept_cut_offs),
            decimate=decimate,
            fast=fast,
            catalogue=catalogue,
        )


def _prepared(
    runs: Sequence[Run],
    profile: WinchProfile,
    filtering: Filtering,
    *,
    decimate: bool,
    fast: bool,
    catalogue: Catalogue | None,
) -> Dataset:
    """The data set of runs with the channels of the model."""
    runs, at_rest = prepared_statics(with_torques(runs, profile), profile)
    runs, coarse = without_constants(runs)
    notes = [*at_rest, *validate_runs(runs, profile)]
    runs, copied = without_copies(runs, profile)
    has_cable = not isinstance(profile, AxisProfile)
    inspected = inspect_runs(runs, has_cable=has_cable)
    sanity = findings(inspected, profile, catalogue)
    resolution = resolutions(inspected)
    runs, held = at_new_angles([usable(one) for one in inspected], sanity)
    runs, mended = evenly_stamped(runs)
    notes += [*held, *mended]
    decimation = decimation_for(runs) if decimate else None
    if decimation is not None:
        notes.append(decimation.words)
    if fast:
        runs = [_of_fast_count(run, decimation.factor if decimation else 1) for run in runs]
    filtering = replace(filtering, decimation=decimation)
    dataset = assemble(runs, profile, filtering)
    if not dataset.outputs:
        raise RunError([_nothing_predicted(run, profile) for run in runs])
    left_out = []
    while (outlying := _outlying(dataset)) is not None:
        left_out.append(outlying[1])
        runs = [run for index, run in enumerate(runs) if index != outlying[0]]
        dataset = assemble(runs, profile, filtering)
    repeats, apart = _separated(dataset)
    alike = excluded_alike(repeats, [r.valid for r in dataset.recordings])
    recordings = tuple(map(_with_valid, dataset.recordings, alike))
    dataset = replace(dataset, repeats=repeats, recordings=recordings)
    left_out += apart
    if nowhere := [r for r in recordings if not any(map(np.any, r.valid.values()))]:
        what = "has no sample that can be compared: `winchkit check` shows what is left out"
        raise RunError([Fault(what, r.path or r.name) for r in nowhere])
    zeroed = []
    for output in OUTPUTS:
        found = zeroed_anew(output, *_repeat_differences(dataset, output))
        if found is not None:
            values = [r.measured[output] for r in dataset.recordings if output in r.measured]
            reason = no_zero(found, [motion.motor_rate for motion in dataset.motions], values)
            zeroed.append(as_noise(found, reason) if reason else found)
    if "cable_length" not in {finding.channel for finding in zeroed}:
        zeroed += angles_from_zero(runs)
    factor = 1 if decimation is None else decimation.factor
    removed = tuple(_removed(runs, dataset))
    return replace(
        dataset,
        removed=removed,
        notes=tuple(notes),
        sanity=(
            *(finding for band in removed for finding in band.findings),
            *copied,
            *left_out,
            *coarse,
            *sanity,
            *zeroed,
            *standstill_findings(
                (r.name, r.measured["motor_torque"], r.nominal["motor_torque"], r.raw)
                for r in dataset.recordings
                if "motor_torque" in r.measured
            ),
            *rounded_alike(dataset, resolution),
        ),
        zeroed_anew=frozenset(f.channel for f in zeroed if f.code == "zeroed-anew"),
        resolution=resolution,
        decimation_factor=factor,
    )


def _removed(runs: Sequence[Run], dataset: Dataset) -> Iterator[RemovedBand]:
    """What the low-passes of every output remove; of decimated runs from the measured output."""
    for output in dataset.outputs:
        filtered: dict[float, list[UnfilteredOutput]] = {}
        for run, r in zip(runs, dataset.recordings, strict=True):
            cut_off = r.bands[output].cut_off if output in r.measured else None
            if cut_off is None:
                continue
            if r.decimated:
                whole = bridged(run["motor_angle"]), run[output], run[output], 1 / run.interval
            else:
                error = np.where(r.valid[output], r.measured[output] - r.nominal[output], np.nan)
                whole = r.signals.motor_angle, r.measured[output], error, r.bands[output].rate
            filtered.setdefault(cut_off, []).append(UnfilteredOutput(*whole))
        for cut_off, compared in filtered.items():
            yield removed_by_low_pass(compared, output, cut_off)


def rounded_alike(dataset: Dataset, resolution: Mapping[str, float]) -> list[Finding]:
    """Findings on outputs whose repeats agree to better than their resolution q allows.

    The noise of rounding, q/√12, is the least noise of every frequency band, and that of an output
    of which nothing else is known.
    """
    out = []
    for output in dataset.outputs:
        least = quantisation_noise(resolution.get(output, 0.0))
        differences, thermal = _repeat_differences(dataset, output)
        parts = [d for d, t in zip(differences, thermal, strict=True) if not t.any()]
        if not parts or not least:
            continue
        rms = float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))
        if rms < least:
            unit = OUTPUT_UNITS[output]
            text = (
                f"repeats agree to {quantity(rms, unit)} rms, less than the "
                f"{quantity(least, unit)} of its resolution: they are rounded alike, "
                "and the noise of the resolution is used"
            )
            out.append(Finding(ROUNDED_ALIKE, "", output, rms, text))
    return out


def _repeat_differences(dataset: Dataset, output: str) -> tuple[list[Array], list[Array]]:
    """Contrasts of the residuals of repeats, (n,) each, and of their temperatures and the products
    of temperature and output, (2, n); zero where temperatures are equal or not known."""
    differences: list[Array] = []
    thermal: list[Array] = []
    for group in dataset.repeated:
        own = [dataset.recordings[run] for run in group.runs]
        if not all(output in r.measured for r in own):
            continue
        if output == "cable_length" and any(r.zeroed for r in own):
            continue
        new = contrasts(_aligned_errors(dataset, group, output))[1]
        known = [r.signals.temperature for r in own]
        warmth = np.array(
            [x[rows] for x, rows in zip(known, group.rows, strict=True) if x is not None]
        )
        if len(warmth) == len(own) and np.ptp(warmth.mean(axis=1)) > _EQUAL_TEMPERATURE:
            nominal = own[0].nominal[output][group.rows[0]]
            warmer = contrasts(warmth - warmth.mean())[1]
            thermal += [np.stack([w, w * (nominal - nominal.mean())]) for w in warmer]
        else:
            thermal += [np.zeros((2, new.shape[1]))] * len(new)
        differences += list(new)
    return differences, thermal


def _aligned_errors(dataset: Dataset, group: Repeats, output: str) -> Array:
    """Residuals of repeats on corresponding samples, (m, n); NaN where not compared."""
    own = [dataset.recordings[run] for run in group.runs]
    return np.array(
        [
            np.where(r.valid[output], r.measured[output] - r.nominal[output], np.nan)[rows]
            for r, rows in zip(own, group.rows, strict=True)
        ]
    )


def _outlying(dataset: Dataset) -> tuple[int, Finding] | None:
    """A run that differs from its repeats, and the finding on it."""
    for group in dataset.repeated:
        for output in dataset.outputs:
            if not all(output in dataset.recordings[run].measured for run in group.runs):
                continue
            errors = _aligned_errors(dataset, group, output)
            found = outlying_repeat(errors)
            if found is None:
                continue
            run, unit = group.runs[found.index], OUTPUT_UNITS[output]
            cause = "another zero, load or setting that is not recorded"
            if (step := step_of(errors, found.index)) is not None:
                sample = group.rows[found.index][step[0]]
                time = dataset.recordings[run].signals.time[sample]
                cause = (
                    f"{quantity(step[1], unit)} from {quantity(float(time), 's')} on, and equal "
                    "before: something slipped, or was moved, there"
                )
            text = (
                f"differs by {quantity(found.rms, unit)} rms from its repeats, these by "
                f"{quantity(found.usual, unit)} from each other: {cause}; left out"
            )
            name = dataset.recordings[run].name
            return run, Finding(OUTLYING, name, output, found.rms, text)
    return None


def _with_valid(recording: Recording, valid: Mapping[str, Mask]) -> Recording:
    return replace(recording, valid=valid)


def _separated(dataset: Dataset) -> tuple[tuple[Repeats, ...], list[Finding]]:
    """The repeats in sets that were made under one value of what is not recorded."""
    sets, findings = list(dataset.repeats), []
    for output in dataset.outputs:
        for group in list(sets):
            if not all(output in dataset.recordings[run].measured for run in group.runs):
                continue
            parts = separated(group, _aligned_errors(dataset, group, output))
            if len(parts) == 1:
                continue
            at = sets.index(group)
            sets[at : at + 1] = parts
            names = [" and ".join(dataset.recordings[r].name for r in part.runs) for part in parts]
            text = (
                f"{'; '.join(names)} are sets of repeats that differ from each other as no noise "
                "does: another zero, load or setting that is not recorded; load_mass states a load"
            )
            findings.append(Finding(SEPARATED, "", output, float(len(parts)), text))
    return tuple(sets), findings


def _of_fast_count(run: Run, factor: int) -> Run:
    """The run without its last samples, so that every ``factor``-th are of a fast number."""
    rows = factor * fast_count(-(-len(run) // factor))
    channels = {
        name: replace(channel, values=channel.values[:rows])
        for name, channel in run.channels.items()
    }
    return replace(run, time=run.time[:rows], channels=channels)


def _nothing_predicted(run: Run, profile: WinchProfile) -> Fault:
    """Fault of a run none of whose outputs is predicted from its inputs."""
    needs = (
        "of an axis the torque is compared: add a column 'motor_torque [N m]'"
        if isinstance(profile, AxisProfile)
        else "a tension is predicted from the load: add a column 'load [N]' or the metadata "
        "'load_mass', or a column 'cable_length [m]' or 'motor_torque [N m]'"
    )
    has = ", ".join(output for output in OUTPUTS if output in run)
    return Fault(f"nothing of {has} can be predicted from this run; {needs}", run.path or run.name)
