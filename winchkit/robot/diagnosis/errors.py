"""Errors of a robot's model in SI: in sample, held out and by noise alone.

``cable_length`` is the length by the drum less the length by geometry at the measured pose, with
what unmeasured coordinates of the pose can explain projected out (of a hanging platform at the
pose that all but the drums determine, its statics included); ``platform_position`` the
position by the motor angles (linearised forward kinematics) less the measured one; ``tension`` the
whitened wrench that measured cable forces and the weight leave over.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.cross_validation import held_out_rms as held_out_rows
from winchkit.diagnosis.regression.cross_validation import left_out_steps
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import Spread, spread_of
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import OutputFit
from winchkit.model.rotation import rotation_by, skew
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.files.poses import held_unmeasured
from winchkit.robot.identification.variance_components import PoseNoise

Errors = dict[str, Array]
UNITS = {"cable_length": "m", "platform_position": "m", "tension": "N"}
_LEAST_SINGULAR_VALUE = 1e-9
"""Singular values of a hanging pose's derivatives below this share of the largest are zero;
numerical."""


@dataclass(frozen=True)
class FittedModel:
    """Fitted model with the noise by which it is judged."""

    regression: PoseRegression
    fit: Fit
    noise: BandNoise

    @cached_property
    def errors(self) -> Errors:
        """Errors of every pose, SI."""
        return errors_of(self.regression, self.regression.at(self.fit.hypothesis))

    @cached_property
    def spread(self) -> Spread:
        """Standard deviations and intervals of the unknowns."""
        return spread_of(self.regression, self.fit, self.noise, self.regression.blocks)


def errors_of(regression: PoseRegression, residuals: Mapping[str, Array]) -> Errors:
    """Errors by output."""
    if regression.dataset.hangs:
        return _errors_of_hanging(regression, residuals)
    at_pose, to_place = _maps(regression)
    known = _measured_coordinates(residuals)
    residuals = _in_base(regression, residuals)
    moved = np.where(known, np.concatenate([residuals["position"], residuals["rotation"]], 1), 0.0)
    by = _slope(regression)
    closure = residuals["closure"] - (by @ moved[..., None])[..., 0]
    rows = np.where(np.isfinite(closure), closure, 0.0)
    length = (at_pose @ rows[..., None])[..., 0]
    out = {"cable_length": np.where(np.isfinite(closure), -length, np.nan)}
    if regression.dataset.restrained:
        whole = np.isfinite(residuals["closure"]).all(axis=1, keepdims=True)
        known_closure = np.where(whole, np.nan_to_num(residuals["closure"]), np.nan)
        found = residuals["position"] - (to_place @ known_closure[..., None])[..., 0]
        if np.isfinite(found).any():
            out["platform_position"] = np.where(_held(regression), 0.0, found)
    if "tension" in residuals:
        out["tension"] = -residuals["tension"]
    return out


def column_names(dataset: RobotDataset, errors: Errors) -> dict[str, tuple[str, ...]]:
    """Names of the columns of every output's errors: axes, lines, or components of the wrench."""
    known = {"platform_position": ("x", "y", "z"), "cable_length": tuple(dataset.names)}
    return {
        output: known.get(output, tuple(str(k + 1) for k in range(error.shape[1])))
        for output, error in errors.items()
    }


def _errors_of_hanging(regression: PoseRegression, residuals: Mapping[str, Array]) -> Errors:
    """Errors at the poses that everything but the drums determines, to first order."""
    at_pose, to_length = _hanging_maps(regression)
    others = _stacked(regression, residuals)
    closure = residuals["closure"] - (to_length @ others[..., None])[..., 0]
    rows = np.where(np.isfinite(closure), closure, 0.0)
    length = (at_pose @ rows[..., None])[..., 0]
    return {
        "cable_length": np.where(np.isfinite(closure), -length, np.nan),
        "tension": -residuals["tension"],
    }


def _stacked(regression: PoseRegression, values: Mapping[str, Array]) -> Array:
    """All rows of a pose but those of the drums in standard deviations; zero where missing."""
    sigma, kinds = regression.point.sigma, [k for k in regression.posed if k != "closure"]
    return np.concatenate([np.nan_to_num(values[k]) / sigma[k] for k in kinds], axis=1)


def _hanging_maps(regression: PoseRegression) -> tuple[Array, Array]:
    """Projection of closures beside coordinates that nothing else determines (p, n, n), and the map
    from the other rows to closures, (p, n, r)."""
    by, here = regression.slope, regression.residuals(())
    sigma, kinds = regression.point.sigma, [k for k in regression.posed if k != "closure"]
    known = np.concatenate([np.isfinite(here[k]) for k in kinds], axis=1)
    slope = np.concatenate([by[k] / sigma[k] for k in kinds], axis=1)
    slope = np.where(known[..., None] & np.isfinite(slope), slope, 0.0)
    left, size, right = np.linalg.svd(slope, full_matrices=False)
    seen = size > _LEAST_SINGULAR_VALUE * np.maximum(size[:, :1], 1e-300)
    inverse = np.where(seen, 1 / np.where(seen, size, 1.0), 0.0)
    pose_of = (np.swapaxes(right, 1, 2) * inverse[:, None]) @ np.swapaxes(left, 1, 2)
    closure = np.nan_to_num(by["closure"])
    free = closure @ (np.swapaxes(right, 1, 2) * ~seen[:, None])
    undone = free @ np.linalg.pinv(free, rcond=1e-9)
    return np.eye(closure.shape[1]) - undone, np.asarray(closure @ pose_of)


def noise_rms(regression: PoseRegression, noise: PoseNoise) -> dict[str, float]:
    """Rms of the errors by the noise of the instruments alone, by output, SI."""
    if regression.dataset.hangs:
        at_pose, to_length = _hanging_maps(regression)
        variance = noise.sigma["closure"] ** 2 + np.sum(to_length**2, axis=2)
        length = float(np.sqrt(np.mean(variance * np.diagonal(at_pose, axis1=1, axis2=2))))
        return {"cable_length": length, "tension": noise.sigma["tension"]}
    at_pose, to_place = _maps(regression)
    sigma, by = noise.sigma, _slope(regression)
    here = regression.residuals(())
    pose = np.repeat([sigma["position"] ** 2, sigma["rotation"] ** 2], 3) * _measured_coordinates(
        here
    )
    spread = by * np.sqrt(pose)[:, None, :]
    whole = spread @ np.swapaxes(spread, 1, 2) + sigma["closure"] ** 2 * np.eye(by.shape[1])
    length = np.trace(at_pose @ whole @ np.swapaxes(at_pose, 1, 2), axis1=1, axis2=2)
    out = {"cable_length": float(np.sqrt(np.mean(length) / by.shape[1]))}
    seen = ~_held(regression)
    place = np.sum(to_place[:, seen] ** 2, axis=(1, 2)) * sigma["closure"] ** 2
    place += np.count_nonzero(seen) * sigma["position"] ** 2
    out["platform_position"] = float(np.sqrt(np.mean(place)))
    out["tension"] = sigma["tension"]
    return out


def output_fits_of(
    begin: FittedModel, final: FittedModel, noise: PoseNoise
) -> dict[str, OutputFit]:
    """Error statistics of every output before and after; of positions those of the distance."""
    before, after = begin.errors, final.errors
    held_before, held_after = held_out_rms(begin), held_out_rms(final)
    least = noise_rms(final.regression, replace(noise, sigma=noise.least))
    signal = signal_rms(final.regression)
    source = "repeats" if noise.from_repeats else "saturated fit"
    return {
        name: OutputFit(
            unit=UNITS[name],
            band=None,
            signal_rms=signal[name],
            rms_before=rms(name, before[name]),
            rms_after=rms(name, after[name]),
            heldout_rms_before=held_before[name],
            heldout_rms_after=held_after[name],
            noise_rms=least[name],
            noise_source=source,
            noise_upper=None if noise.from_repeats else max(rms(name, after[name]), least[name]),
            heldout_on="poses",
        )
        for name in after
        if name in before
    }


def errors_in_noise(model: FittedModel) -> dict[str, float]:
    """Held-out rms of the whitened equations by output, in standard deviations of white noise: in
    an error in metres the least accurate angle hides what a tracker sees."""
    return held_out_rows(model.regression, model.fit, model.noise, model.regression.groups)


def least_noise(model: FittedModel, noise: PoseNoise) -> dict[str, float]:
    """Noise by output that decides on a model, in the unit of :func:`errors_in_noise`: two standard
    errors above that of the repeats, which a few poses determine to some 10 %. Without repeats what
    is beyond the noise of usual instruments may be an effect, and does not count."""
    regression, beyond = model.regression, model.noise.uncertainty(model.regression)
    here, out = regression.residuals(()), {}
    for output, size in model.noise.rms.items():
        kinds = ["tension"] if output == "tension" else regression.posed
        shares = [(noise.least[kind] / noise.sigma[kind]) ** 2 for kind in kinds]
        share = np.average(shares, weights=[here[kind].shape[1] for kind in kinds])
        out[output] = size * float(np.sqrt(share * (1 + beyond[output])))
    return out


def output_fits_in_noise(
    begin: FittedModel, final: FittedModel, noise: PoseNoise
) -> dict[str, OutputFit]:
    """Errors of every kind of equation before and after, in standard deviations of their noise."""
    before, after, least = errors_in_noise(begin), errors_in_noise(final), least_noise(final, noise)
    return {
        output: OutputFit(
            unit="1",
            band=None,
            signal_rms=float("nan"),
            rms_before=before[output],
            rms_after=after[output],
            heldout_rms_before=before[output],
            heldout_rms_after=after[output],
            noise_rms=least[output],
        )
        for output in after
    }


def refuted_outputs(model: FittedModel) -> set[str]:
    """Outputs that their mean over the poses predicts better, beyond the standard error."""
    signals, out = _signals(model.regression), set()
    for name, error in _held_out(model).items():
        signal = signals[name]
        deviation = signal - np.nanmean(signal, axis=0) if np.isfinite(signal).any() else signal
        loss = np.nansum(error**2, axis=1) - np.nansum(deviation**2, axis=1)
        if np.sum(loss) > np.sqrt(len(loss)) * np.std(loss):
            out.add(name)
    return out


def rms(name: str, error: Array) -> float:
    """Root mean square of all values; of a position that of its distance."""
    known = error[np.isfinite(error).all(axis=1)] if name == "platform_position" else error
    squares = np.nansum(known**2, axis=1) if name == "platform_position" else known**2
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(np.mean(squares))) if squares.size else float("nan")


def signal_rms(regression: PoseRegression) -> dict[str, float]:
    """Rms of each output about its mean, SI."""
    out = {}
    for name, array in _signals(regression).items():
        known = np.isfinite(array).all(axis=1)
        centred = array[known] - array[known].mean(axis=0) if known.any() else array[known]
        out[name] = rms(name, centred) if known.any() else float("nan")
    return out


def _signals(regression: PoseRegression) -> Errors:
    """Measured values of every output, (p, k), SI; lengths by the drums."""
    measured = regression.dataset.measured
    robot, equations = regression.robot, regression.equations
    force = equations.forces(regression.point.state.values, robot)
    by_drum = robot.lengths_at(measured.motor_angle, force, equations.temperature)
    length = regression.residuals(())["closure"] + by_drum
    return {
        "cable_length": length,
        "platform_position": np.where(_held(regression), 0.0, measured.position),
        "tension": measured.tension,
    }


def _held(regression: PoseRegression) -> NDArray[np.bool_]:
    """Coordinates that guides hold and nothing measured, (3,)."""
    return held_unmeasured(regression.dataset.measured, regression.dataset.robot)


def held_out_rms(model: FittedModel) -> dict[str, float]:
    """Held-out error of every output, rms, SI."""
    return {name: rms(name, error) for name, error in _held_out(model).items()}


def _held_out(model: FittedModel) -> Errors:
    """Errors of every pose with the parameters fitted without its fold (linearised), SI."""
    regression, found = model.regression, model.fit
    here = regression.at(found.hypothesis)
    steps = left_out_steps(regression, found, model.noise, regression.groups)
    of_pose = regression.fold_of_pose(regression.groups)
    out = {kind: values.copy() for kind, values in here.items()}
    for index in range(len(found.vector)):
        step = 1e-3 * max(1.0, abs(found.vector[index]))
        vector = found.vector.copy()
        vector[index] += step
        there = regression.at(regression.hypothesis(vector, found.hypothesis))
        by = steps[of_pose, index][:, None] / step
        for kind, values in there.items():
            out[kind] += (values - here[kind]) * by
    return errors_of(regression, out)


def _slope(regression: PoseRegression) -> Array:
    """Derivatives of the lengths by the observed point u = c + R o and the rotation, (p, n, 6)."""
    by, tracker = regression.slope["closure"], regression.tracker
    if tracker is None or not np.any(tracker.offset):
        return by
    lever = regression.point.pose.rotation @ tracker.offset
    out = by.copy()
    out[..., 3:] += by[..., :3] @ skew(lever)
    return out


def _in_base(regression: PoseRegression, residuals: Mapping[str, Array]) -> Mapping[str, Array]:
    """Residuals of positions and rotations turned from the tracker's into the base frame."""
    tracker = regression.tracker
    if tracker is None:
        return residuals
    back = rotation_by(tracker.turn).T
    out = {**residuals, "position": residuals["position"] @ back.T / (1 + tracker.scale)}
    if tracker.turns_rotation:
        out["rotation"] = np.where(
            np.isfinite(residuals["rotation"]).all(axis=1, keepdims=True),
            residuals["rotation"] @ back.T,
            residuals["rotation"],
        )
    return out


def _measured_coordinates(residuals: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Which of the six coordinates of each pose were measured, (p, 6)."""
    both = np.concatenate([residuals["position"], residuals["rotation"]], axis=1)
    return np.asarray(np.isfinite(both))


def _maps(regression: PoseRegression) -> tuple[Array, Array]:
    """Per pose the projection of closures beside the unmeasured coordinates (p, n, n), and the map
    from closures to positions (p, 3, n)."""
    by = _slope(regression)
    by = np.where(np.isfinite(by), by, 0.0)
    free = by * ~_measured_coordinates(regression.residuals(()))[:, None, :]
    undone = free @ np.linalg.pinv(free, rcond=1e-9)
    back = np.asarray(np.linalg.pinv(by, rcond=1e-9), dtype=float)
    return np.eye(by.shape[1]) - undone, back[:, :3]
