"""Calibration of a cable robot: geometry and winches from poses with any kind of measurement.

The estimate is the maximum of the posterior over all poses and parameters at once: the cost is
½ Σ (r/σ)² + ½ Σ ((x − x₀)/σ_prior)² over all equations and parameters. The CABTIVE paper
(Lessanibahri et al., Eq. 5 and 6) solves the forward kinematics of every pose inside each
evaluation of its cost; here the pose is an unknown beside the parameters, so that all cable
equations count.

Fit and standard deviations σ (variance components) alternate until σ changes by less than 3 %, at
most eight times. Poses with gross errors are left out, and all is fitted again without them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from time import perf_counter

import numpy as np

from winchkit.arguments import ProgressCallback, no_progress, require_type
from winchkit.arrays import Array
from winchkit.errors import RunError, UsageError
from winchkit.fit_statistics import FitStatistics
from winchkit.model.drum import drum_of
from winchkit.rendering import Plotted
from winchkit.robot.calibration.candidate_effects import CandidateEffect, candidates
from winchkit.robot.calibration.identifiability import (
    Observability,
    observability,
    refuse_unfit,
    undetermined_move,
)
from winchkit.robot.calibration.notes import (
    home_notes,
    instrument_notes,
    moved_points,
    stretched_axis,
    warnings_of,
    worse_rotation,
)
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.outliers import far_off, gross_errors, left_out_poses, unexplained
from winchkit.robot.calibration.prediction import PoseErrors, cable_errors, errors_at, rms
from winchkit.robot.calibration.ratios import Ratios, ratios_of
from winchkit.robot.calibration.selection import first_model, fitted_with_instruments
from winchkit.robot.calibration.statistics import calibration_statistics
from winchkit.robot.calibration.swivel_axes import axes_text, reversed_axes
from winchkit.robot.files.poses import MeasuredPoses, copies, of_poses
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import BundleState, Solution, Weights
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.instruments import declared_instruments
from winchkit.robot.identification.parameters import (
    Estimated,
    Parameters,
    own_effects,
    parameters_of,
)
from winchkit.robot.identification.variance_components import START
from winchkit.robot.mistakes.search import refuse_mistakes, refuse_slips
from winchkit.schema.profiles.winch import LAYERED
from winchkit.tabular import Columns, Tabular

_HELD_OUT_EVERY = 10
"""Every tenth pose: the fit loses 5 % of its accuracy, and 100 poses leave ten for the held-out
error."""
_CLEANINGS = 4
"""Fits without the poses that were found wrong before (rule of thumb: one settles it; a second
where the tracker's numbers change with them)."""
_LARGEST_ERROR = 0.05
"""Held-out position error as a share of the largest distance of two exit points, above which a
robot is not called calibrated (rule of thumb: far above any camera, far below a wrong pose)."""


@dataclass(frozen=True, repr=False)
class Calibrated(Plotted, Tabular):
    """Result of a calibration."""

    equations: RobotEquations
    solution: Solution
    weights: Weights
    estimates: Mapping[str, Estimated]
    fit_before: PoseErrors
    fit_after: PoseErrors
    validation_before: PoseErrors
    validation_after: PoseErrors
    observed: Observability
    candidates: tuple[CandidateEffect, ...]
    """Effects that would explain a large part of the remaining cost."""
    seconds: float
    warnings: tuple[str, ...]
    validation_lengths: tuple[float, float] = (float("nan"), float("nan"))
    """Rms of cable lengths by drums against geometry at held-out poses, before and after, m."""
    ratios: Ratios = field(default_factory=lambda: Ratios(()))
    """Cable per motor turn of each line."""
    found_instruments: frozenset[str] = frozenset()
    """Numbers of instruments that the poses require and that the file does not declare unknown."""
    unexplained: tuple[str, ...] = ()
    """Instruments at the lines whose readings do not follow the geometry, in words."""
    gross_errors: tuple[str, ...] = ()
    """Run and row of the poses that were left out of the fit and of the held-out error."""
    reversed_axes: tuple[str, ...] = ()
    """Lines whose swivel axes point the other way than the profile has them."""
    undetermined: float = 0.0
    """Distance of the robot from the file's in combinations that the poses do not determine, in
    standard deviations of the priors, where it is the larger part of the whole distance."""
    instrument_noise: Mapping[str, float] = field(default_factory=lambda: dict(START))
    """Standard deviations of the instruments by kind: known, else usual ones, SI."""

    @property
    def refusal(self) -> str:
        """Reason why the robot is not calibrated, in words; empty where it is."""
        return next(self._reasons(), "")

    def _reasons(self) -> Iterator[str]:
        """Reasons why the robot is not calibrated, in words."""
        if self.unexplained:
            yield f"not calibrated: {'; '.join(self.unexplained)}; nothing was written"
        if self.reversed_axes:
            yield f"not calibrated: {axes_text(self.reversed_axes)}"
        if lost := self._without_value:
            yield (
                f"not calibrated: {lost} of {self.equations.count} equations have no value at the "
                "end of the fit; nothing was written. Check the lines' order, gearbox.direction "
                "and the units of the motor angles"
            )
        if self.undetermined:
            yield (
                f"not calibrated: points and radii end {self.undetermined:.0f} standard deviations "
                "of their priors from the file's in combinations that the poses do not determine; "
                "nothing was written. Check signs, units and the order of the motor angles; "
                "measure more at each pose, such as positions, or record more poses"
            )
        before, after = rms(self.validation_before.distance), rms(self.validation_after.distance)
        if after >= before:
            yield _no_better("position error", before, after)
        first, last = self.validation_lengths
        if not isfinite(after) and last >= first:
            yield _no_better("error of the cable lengths", first, last)
        if not isfinite(after) and not isfinite(last) and not self.validation_after.unfound:
            yield (
                "not calibrated: the held-out error is not known, since no pose is held out; "
                f"nothing was written. Record {_HELD_OUT_EVERY} poses or more, or give others "
                "with --validate"
            )
        size = self.equations.robot.geometry.size
        if after > _LARGEST_ERROR * size:
            yield (
                f"not calibrated: the held-out position error is {after * 1e3:.4g} mm rms, in a "
                f"robot of {size:.3g} m (limit: {_LARGEST_ERROR:.0%} of it); nothing was written. "
                "Check units and signs of the positions, the lines' order and gearbox.direction"
            )
        count = len(self.validation_after.distance)
        if self.validation_after.unfound > count / 2:
            yield (
                f"not calibrated: {self.validation_after.unfound} of {count} held-out poses were "
                "not found from their motor angles; nothing was written. Check the lines' order, "
                "gearbox.direction, [home] and the motor angles there"
            )

    @property
    def _without_value(self) -> int:
        """Number of measurements that the equations do not predict at the end of the fit."""
        known = int(np.count_nonzero(self.solution.linear.stack.known))
        return max(0, self.equations.count - known)

    @property
    def noise_ratio(self) -> float:
        """Held-out error over the noise of the instruments, known or usual: of positions, else of
        lengths. A real robot, with cables, pulleys and a frame that no model has, is at 5 to 20.
        NaN without held-out poses."""
        place = rms(self.validation_after.distance)
        if isfinite(place):
            return place / (3**0.5 * self.instrument_noise["position"])
        return self.validation_lengths[1] / self.instrument_noise["closure"]

    @property
    def values(self) -> Array:
        """Parameters in fitted units, (q,)."""
        return self.solution.state.values

    @property
    def statistics(self) -> FitStatistics:
        """χ² with its degrees of freedom, values and correlations."""
        return calibration_statistics(self.equations, self.solution, self.estimates)

    def fit_report(self) -> str:
        """Return the report of the fit, in the layout of lmfit's.

        Returns
        -------
        str
            Data, degrees of freedom, χ², AIC and BIC; per parameter its standard deviation,
            nominal value, 95 % interval and bounds; correlations above 0.5.
        """
        return self.statistics.text()

    def _columns(self) -> Columns:
        return self.statistics._columns()


def _no_better(what: str, before: float, after: float) -> str:
    """Refusal of a fit whose held-out error did not fall, m."""
    return (
        f"not calibrated: the held-out {what} is {after * 1e3:.4g} mm rms after the fit, not "
        f"smaller than {before * 1e3:.4g} mm with the starting profile; nothing was written. Check "
        "that the poses are of this robot, record more of them, or fit a missing effect beside the "
        "geometry (--effect)"
    )


def split(measured: MeasuredPoses) -> tuple[MeasuredPoses, MeasuredPoses]:
    """Split poses into those to fit and every tenth to hold out (none of fewer than ten)."""
    held = np.arange(len(measured)) % _HELD_OUT_EVERY == _HELD_OUT_EVERY - 1
    return measured[~held], measured[held]


def _unlike(validation: MeasuredPoses, fit: MeasuredPoses) -> tuple[MeasuredPoses, tuple[str, ...]]:
    """Poses for the held-out error that are not among those to fit, and a note of the others;
    raises RunError where all are."""
    again = copies(validation, fit)
    if len(validation) and again.all():
        raise RunError(
            "every pose for the held-out error is among those to fit, equal in every number; give "
            "other ones, or none: then every tenth is held out"
        )
    note = f"{of_poses(again)} among those to fit, equal in every number; not held out"
    return validation[~again], (note,) if again.any() else ()


def calibrate(
    robot: Robot,
    fit: MeasuredPoses,
    validation: MeasuredPoses | None = None,
    options: Options | None = None,
    progress: ProgressCallback = no_progress,
) -> Calibrated:
    """Fit a robot's geometry, winches and named effects to poses.

    Parameters
    ----------
    robot : Robot
        With the nominal values, which are the means of the priors.
    fit : MeasuredPoses
        Poses to fit, p of n lines.
    validation : MeasuredPoses, optional
        Poses for the held-out error; by default every tenth of ``fit``, which is then not fitted.
    options : Options, optional
        Effects and known standard deviations.
    progress : callable, optional
        Called with the present step and the share that is done; None, since it is not known.

    Returns
    -------
    Calibrated
        Estimates, prediction errors before and after, identifiability and warnings.

    Raises
    ------
    UsageError
        Where the poses have no redundancy, or a measurement is missing that an effect needs.
    RunError
        With the mistakes in the tables of poses (:mod:`winchkit.robot.mistakes`).
    """
    require_type(robot, Robot, "robot")
    require_type(fit, MeasuredPoses, "fit")
    if validation is not None:
        require_type(validation, MeasuredPoses, "validation")
    options = options or Options()
    equations = equations_of(robot, fit, options)
    # Before poses are held out, since rows that are shifted have neighbours.
    for poses in (fit,) if validation is None else (fit, validation):
        refuse_mistakes(robot, poses)
    unheld: tuple[str, ...] = ()
    if validation is not None:
        validation, unheld = _unlike(validation, fit)
    else:
        fit, validation = split(fit)
        equations = equations_of(robot, fit, options)
    effects = tuple(dict.fromkeys((*options.effects, *own_effects(robot.profile))))
    begin = perf_counter()
    refuse_unfit(equations)
    first, weights = first_model(equations, options)
    wrong = gross_errors(first, first.parameters.nominal, weights)
    given = equations
    for _ in range(_CLEANINGS):
        declared, chosen = fitted_with_instruments(equations.of(~wrong), options, progress)
        own = replace(chosen.equations, measured=fit)
        own_values = chosen.solution.state.values
        before, wrong = wrong, gross_errors(own, own_values, chosen.weights)
        if np.array_equal(before, wrong):
            break
    refuse_slips(own, BundleState(own_values, own.start(own_values)), chosen.weights)
    # Small rotations in another convention are hidden by the errors of the nominal geometry.
    refuse_mistakes(chosen.equations.robot_at(own_values), fit[~wrong])
    equations, solution, weights = chosen.equations, chosen.solution, chosen.weights
    observed = observability(equations, solution, weights)
    ratios = ratios_of(equations, solution)
    seconds = perf_counter() - begin

    start = declared
    nominal, values = start.parameters.nominal, solution.state.values
    missed = far_off(errors_at(replace(equations, measured=validation), values).distance)
    judged = validation[~missed]

    errors_before = errors_at(replace(start, measured=judged), nominal)
    after = errors_at(replace(equations, measured=judged), values)
    lengths = (float("nan"), float("nan"))
    if "position" not in equations.kinds and len(judged):
        there, initial = replace(equations, measured=judged), equations.parameters.nominal
        lengths = (
            rms(cable_errors(there, initial, weights)),
            rms(cable_errors(there, values, weights)),
        )
    return Calibrated(
        equations=equations,
        solution=solution,
        weights=weights,
        estimates=_estimates(equations.parameters, solution, observed),
        fit_before=errors_at(start, nominal),
        fit_after=errors_at(equations, values),
        validation_before=errors_before,
        validation_after=after,
        observed=observed,
        candidates=candidates(
            equations, solution, weights, tuple(dict.fromkeys((*effects, *equations.effects)))
        ),
        seconds=seconds,
        warnings=(
            *left_out_poses(fit.place[wrong], "the fit"),
            *left_out_poses(validation.place[missed], "the held-out error"),
            *instrument_notes(declared, chosen),
            *home_notes(given, equations, values),
            *moved_points(given, equations, values),
            *warnings_of(equations, solution, weights, observed, after.unfound),
            *stretched_axis(equations, solution, weights),
            *worse_rotation(errors_before, after),
            *unheld,
            *ratios.words,
        ),
        validation_lengths=lengths,
        ratios=ratios,
        unexplained=tuple(unexplained(equations, solution)),
        undetermined=undetermined_move(given, equations, solution),
        reversed_axes=reversed_axes(chosen, options, progress),
        gross_errors=(*fit.place[wrong].tolist(), *validation.place[missed].tolist()),
        instrument_noise={**START, **(options.sigma or {})},
        found_instruments=chosen.free
        - (declared.instruments.free if declared.instruments else frozenset()),
    )


def equations_of(robot: Robot, measured: MeasuredPoses, options: Options) -> RobotEquations:
    """Constraint equations of measured poses with the parameters of an option's effects; raises
    UsageError where a measurement is missing that an effect needs."""
    instruments = declared_instruments(robot, measured)
    parameters = parameters_of(robot, measured, options.effects, instruments)
    tension = bool(np.any(np.isfinite(measured.tension)))
    needing = [e for e in options.effects if e.startswith(("cable-elongation", "payload"))]
    if needing and not tension and options.middle_force is None:
        raise UsageError(
            f"{needing[0]} needs cable forces: record 'LINE.tension [N]', or give the forces that "
            "the robot keeps near, e.g. --middle-force '60 N'"
        )
    if options.middle_force is not None and not options.middle_force > 0:
        raise UsageError(
            f"--middle-force is {options.middle_force:g} N; cables only pull, so that it is above 0"
        )
    payload = [e for e in options.effects if e.startswith("payload")]
    if payload and robot.hangs:
        raise UsageError(
            f"{payload[0]} needs cables that hold all {robot.geometry.degrees} degrees of freedom; "
            f"the robot has {len(robot.names)} lines"
        )
    if payload and not tension and parameters.law is None:
        raise UsageError(
            f"{payload[0]} shows in tensions, or in elongation by computed forces: record "
            "'LINE.tension [N]', or add an elongation effect"
        )
    growths = {
        getattr(drum_of(winch), "growth", 0.0)
        for winch in robot.winches
        if winch.drum.kind in LAYERED
    }
    if len(growths) > 1:
        listed = ", ".join(f"{growth * 1e3:g} mm" for growth in sorted(growths))
        raise UsageError(
            f"the winches of '{robot.profile.name}' have the layer growths {listed}; the lines of "
            "one robot are calibrated with one, so give them the same cable"
        )
    return RobotEquations(
        robot,
        parameters,
        measured,
        None if instruments.is_trivial else instruments,
        tuple(options.effects),
        middle_force=options.middle_force,
    )


def _estimates(
    parameters: Parameters, solution: Solution, observed: Observability
) -> dict[str, Estimated]:
    out = {}
    values = solution.state.values
    for i, parameter in enumerate(parameters):
        if parameter.std > 0:
            nominal, _ = parameter.shown(parameter.nominal, 0.0)
            value, std = parameter.shown(float(values[i]), float(observed.std[i]))
            bound = {-1: "low", 0: "", 1: "high"}[int(solution.held[i])]
            out[parameter.name] = Estimated(parameter, nominal, value, std, bound)
    return out
