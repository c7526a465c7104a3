"""A robot's calibration as JSON and as a text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees, floor, isfinite, log10
from typing import Any

import numpy as np

from winchkit.model.rotation import angles_of
from winchkit.robot.calibration.calibrate import Calibrated
from winchkit.robot.calibration.pose_design import NextPose
from winchkit.robot.calibration.prediction import PoseErrors, rms
from winchkit.robot.identification.parameters import Estimated
from winchkit.robot.identification.variance_components import NOISE

_SHOWN = {"m": ("mm", 1e3), "rad": ("deg", degrees(1.0))}


def calibration_json(found: Calibrated, following: Sequence[NextPose]) -> dict[str, Any]:
    """The object that ``winchkit calibrate --json`` prints; SI, rms over poses."""
    after, angle = found.validation_after, found.validation_after.angle
    return {
        "schema": 1,
        "fit": {
            "poses": len(found.equations.measured),
            "rms_before": rms(found.fit_before.distance),
            "rms_after": rms(found.fit_after.distance),
        },
        "validation": {
            "poses": len(after.distance),
            "rms_before": rms(found.validation_before.distance),
            "rms_after": rms(after.distance),
            "max_after": _largest(after.distance),
            "rotation_rms_before": rms(found.validation_before.angle),
            "rotation_rms_after": rms(angle),
            "length_rms_before": found.validation_lengths[0],
            "length_rms_after": found.validation_lengths[1],
            "unfound": after.unfound,
            "noise_ratio": found.noise_ratio,
        },
        "parameters": {name: _entry(estimate) for name, estimate in found.estimates.items()},
        "rank": found.observed.rank,
        "free": found.observed.free,
        "weak": found.observed.weak,
        "unobservable": list(found.observed.unobservable),
        "noise": {
            kind: {"std": sigma, "unit": NOISE[kind].unit}
            for kind, sigma in found.weights.sigma.items()
        },
        "candidates": [{"effect": c.effect, "share": c.share} for c in found.candidates],
        "next_poses": [
            {"position": p.position, "rotation": p.angles, "gain": p.gain} for p in following
        ],
        "instruments": instruments_json(found),
        "ratios": {
            "lines": [vars(ratio) for ratio in found.ratios.lines],
            "named": list(found.ratios.named),
            "alternatives": [list(lines) for lines in found.ratios.alternatives],
        },
        "gross_errors": list(found.gross_errors),
        "reversed_axes": list(found.reversed_axes),
        "refused": found.refusal or None,
        "warnings": list(found.warnings),
        "converged": found.solution.converged,
        "seconds": found.seconds,
        "statistics": found.statistics.to_json(),
    }


def instruments_json(found: Calibrated) -> dict[str, Any]:
    """Numbers of the tracker that were fitted, the base frame's pose in its frame by session, and
    the datum; empty where none were."""
    own = found.equations.instruments_at(found.values)
    if own is None or not own.free:
        return {}
    frames = {}
    if "frame" in own.free:
        for session, tracker in zip(own.sessions, own.trackers, strict=True):
            origin, turned = tracker.frame_in_base
            frames[session] = {"position": origin.tolist(), "rotation": angles_of(turned).tolist()}
    return {
        "fitted": sorted(own.free),
        "undeclared": sorted(found.found_instruments),
        "frames": frames,
        "datum": found.equations.robot.profile.instrument.tracker.datum,
    }


def _entry(estimate: Estimated) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "nominal": estimate.nominal,
        "value": estimate.value,
        "std": estimate.std,
        "unit": estimate.parameter.unit,
    }
    return entry | ({"bound": estimate.bound} if estimate.bound else {})


def calibration_text(found: Calibrated, following: Sequence[NextPose]) -> str:
    """Errors, parameters, unidentifiable directions, candidate effects, warnings, next poses."""
    return "\n".join(
        [
            *_errors(found),
            "",
            *_table(found),
            *_section("not identifiable from these poses:", found.observed.unobservable),
            *_section("candidate effects:", candidate_lines(found)),
            *_section("note:", found.warnings),
            *_section("measure next:", [_pose(p) for p in following]),
        ]
    )


def candidate_lines(found: Calibrated) -> list[str]:
    """Candidate effects in words."""
    return [
        f"the effect {c.effect} would explain {c.share * 100:.0f} % of the remaining cost; "
        f"try --effect {c.effect}"
        for c in found.candidates
    ]


def noise_words(found: Calibrated) -> str:
    """Standard deviation of each kind of measurement in words."""
    return ", ".join(
        f"{kind.replace('_', ' ')} {_shown(sigma, NOISE[kind].unit)}"
        for kind, sigma in found.weights.sigma.items()
    )


def in_words(estimate: Estimated) -> tuple[str, str, str, str]:
    """Nominal value, value, sigma and unit, rounded to the second digit of sigma."""
    unit, worth = _SHOWN.get(estimate.parameter.unit, (estimate.parameter.unit, 1.0))
    std = estimate.std * worth
    if not (isfinite(std) and std > 0):
        nominal, value = (f"{v * worth:.6g}" for v in (estimate.nominal, estimate.value))
        return nominal, value, f"{std:.2g}", unit
    decimals = max(0, 1 - floor(log10(std)))
    nominal, value = (f"{v * worth:.{decimals}f}" for v in (estimate.nominal, estimate.value))
    return nominal, value, f"{std:.{decimals}f}", unit


def _errors(found: Calibrated) -> Iterator[str]:
    yield f"{'position error':24}{'poses':>6}{'before':>12}{'after':>12}{'worst after':>14}"
    for name, before, after in (
        ("fitted", found.fit_before, found.fit_after),
        ("held out", found.validation_before, found.validation_after),
    ):
        if len(after.distance):
            yield _error_row(name, before, after)
    before, after = found.validation_before, found.validation_after
    if isfinite(rms(after.angle)):
        yield (
            f"rotation error held out: {degrees(rms(before.angle)):.4g} deg before, "
            f"{degrees(rms(after.angle)):.4g} deg after"
        )
    if not isfinite(rms(after.distance)) and isfinite(found.validation_lengths[1]):
        first, last = (_shown(value, "m") for value in found.validation_lengths)
        yield f"cable lengths held out, drums against geometry: {first} before, {last} after"
    yield f"noise (1 sigma): {noise_words(found)}"
    if isfinite(found.noise_ratio):
        kind = "position" if isfinite(rms(after.distance)) else "closure"
        yield (
            f"Held out: {found.noise_ratio:.2g} times the instruments' noise of "
            f"{_shown(found.instrument_noise[kind], 'm')} (real robots: 5 to 20)."
        )
    yield (
        f"{found.observed.rank} of {found.observed.free} parameter directions identifiable, "
        f"{found.seconds:.2f} s"
    )


def _error_row(name: str, before: PoseErrors, after: PoseErrors) -> str:
    cells = (rms(before.distance), rms(after.distance), _largest(after.distance))
    first, second, worst = (_shown(value, "m") for value in cells)
    return f"{name:24}{len(after.distance):>6}{first:>12}{second:>12}{worst:>14}"


def _table(found: Calibrated) -> Iterator[str]:
    width = max(len(name) for name in found.estimates) + 2
    yield f"{'parameter':{width}}{'nominal':>12}{'value':>12}{'sigma':>10}  unit"
    for name, estimate in found.estimates.items():
        nominal, value, sigma, unit = in_words(estimate)
        at = f"  at its {estimate.bound} bound" if estimate.bound else ""
        yield f"{name:{width}}{nominal:>12}{value:>12}{sigma:>10}  {unit}{at}"


def _section(heading: str, lines: Sequence[str]) -> list[str]:
    return ["", heading, *(f"  {line}" for line in lines)] if lines else []


def _pose(pose: NextPose) -> str:
    x, y, z = (value * 1e3 for value in pose.position)
    roll, pitch, yaw = (degrees(value) for value in pose.angles)
    return (
        f"x {x:.0f} y {y:.0f} z {z:.0f} mm, roll {roll:.1f} pitch {pitch:.1f} yaw {yaw:.1f} deg "
        f"({pose.gain:.1f} bits)"
    )


def _shown(value: float, unit: str) -> str:
    name, worth = _SHOWN.get(unit, (unit, 1.0))
    return f"{value * worth:.3g} {name}" if isfinite(value) else "not known"


def _largest(values: Any) -> float:
    known = values[np.isfinite(values)]
    return float(np.max(known)) if len(known) else float("nan")
