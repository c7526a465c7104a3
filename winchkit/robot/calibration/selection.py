"""Fit of a robot's calibration, with the numbers of the tracker that the poses require.

The model with the numbers that the file declares unknown is fitted first. Where a tracker whose
frame, reflector or scale are free predicts the poses much better, it is fitted in its place:
otherwise exit points and home lengths would absorb a tracker that was set up anew. Models are
compared by the Bayesian information criterion

    χ² + 2 Σ n_k ln σ_k + q ln N

with n_k equations of the kind k and its standard deviation σ_k, q numbers of instruments and gear
ratios and N equations in all. Gains of cells, scales of length counters and the axes of an IMU of a
robot without a tracker are then freed one after another, as long as a score test and the criterion
ask for them, and the gear ratios of lines whose winding radius left its prior. The prior's part of
χ² takes part between models of equally many parts alone: a common shift of all anchor points is the
same as a reflector's offset, and with the prior it would be cheaper as an offset whether or not
there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, combinations
from math import log

import numpy as np

from winchkit.arguments import ProgressCallback
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.prediction import (
    PoseErrors,
    errors_at,
    in_other_zeros,
    predicted_poses,
    rms,
)
from winchkit.robot.calibration.ratios import ratios_of
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.tracker import Tracker
from winchkit.robot.identification.bundle_adjustment import (
    BundleState,
    Solution,
    Weights,
    linearise,
    solve,
)
from winchkit.robot.identification.equations import RobotEquations, started
from winchkit.robot.identification.instruments import (
    LARGEST_SCALE,
    OF_LINES,
    InstrumentValues,
    declared_instruments,
    registered_instruments,
)
from winchkit.robot.identification.parameters import HOME_LENGTH, parameters_of
from winchkit.robot.identification.variance_components import NOISE, re_estimated_weights
from winchkit.robot.mistakes.adjustment import lengths_at_home

_NOISE_ROUNDS = 8
"""Rule of thumb: the components converge linearly; where two of them exchange variance they do not
settle in any number of rounds."""
_SETTLED_CHANGE = 0.03
"""Relative change of a standard deviation at which variance components have settled."""
_LEAST_FALL = 0.7
"""Ratio of the prediction errors with and without free numbers of the tracker above which they are
not fitted (rule of thumb: half of the variance, so that a tracker is not blamed for cables)."""
_CLEARLY_WORSE = 5.0
"""Ratio of two registrations' errors above which the worse one is not fitted (rule of thumb)."""
_COUNTED = (
    "tracker_frame",
    "reflector",
    "tracker_scale",
    "mounting",
    "gear_ratio",
    *OF_LINES,
)
_COUNTED_AS = {"reflector": 6}
"""Numbers of a reflector's offset in the criterion: as many as of a frame. With a platform that
hardly turns the two are the same shift, which is then said to be the frame's."""
DELTA_CHI_SQUARE = 9.0
"""Difference of criteria below which two explanations count as equal: the true one is worse by this
much with probability at most 1/740."""
BEYOND_PRIOR = 3.0
"""Standard deviations of its prior beyond which a parameter has left it, and a winding radius
imitates another gear ratio."""
_ODD = 5.0
"""Ratio of a standard deviation to that of a usual encoder or tracker from which the lengths at
home are tried (rule of thumb: robots have up to this by their cables and pulleys)."""
POINTS = ("exit_point", "anchor_point")
"""Points of the robot."""
_AT_HOME = ("home_length",)
_ROUNDS_OF_PRIORS = 5
"""Each reduces the error of lengths at home that are 100 mm off by a factor of ten or more."""
_LEVEL = 1e-6
"""Level of the score test for free numbers of the tracker (rule of thumb)."""
_PLAINLY = 3.0
"""Ratio of two errors of rotations above which the worse assumption is not fitted (rule of thumb).
"""
_LEAST_MISFIT = 10e-3
"""Error of a registration below which it is always fitted, m: two standard deviations of the exit
points' prior."""


@dataclass(frozen=True)
class FitEnd:
    """End of a fit."""

    equations: RobotEquations
    solution: Solution
    weights: Weights

    @property
    def free(self) -> frozenset[str]:
        """Numbers of the tracker that were fitted."""
        return self.equations.instruments.free if self.equations.instruments else frozenset()

    @property
    def criterion(self) -> float:
        """Bayesian information criterion, up to a constant."""
        known = self.solution.linear.stack.known
        kinds = self.solution.linear.stack.kinds
        linear = self.solution.linear
        likelihood = (
            2 * linear.cost
            - float(linear.prior @ linear.prior)
            + sum(
                2 * np.count_nonzero(known[:, part]) * log(self.weights.sigma[kind])
                for kind, part in kinds.items()
            )
        )
        block = self.equations.parameters.block
        std = self.equations.parameters.std
        numbers = sum(
            _COUNTED_AS.get(name, int(np.count_nonzero(std[block[name]])))
            for name in _COUNTED
            if name in block
        )
        return likelihood + numbers * log(max(int(np.count_nonzero(known)), 2))

    @property
    def with_prior(self) -> float:
        """The criterion with the prior's part of χ²."""
        prior = self.solution.linear.prior
        return self.criterion + float(prior @ prior)

    @property
    def at_bound(self) -> bool:
        """Whether a number of an instrument stopped at a bound."""
        held, block = self.solution.held, self.equations.parameters.block
        return any(bool(np.any(held[block[name]])) for name in _COUNTED if name in block)

    @property
    def is_plausible(self) -> bool:
        """Whether cables and geometry agree to within the prior of the exit points, with a
        plausible scale."""
        own = self.equations.instruments_at(self.solution.state.values)
        scale = own.trackers[0].scale if own is not None else 0.0
        closure = self.weights.sigma.get("closure", 0.0)
        return abs(scale) < LARGEST_SCALE and closure < float(self.equations.parameters.std[0])

    @cached_property
    def errors(self) -> PoseErrors:
        """Prediction errors of the fitted poses."""
        return errors_at(self.equations, self.solution.state.values)

    @property
    def error(self) -> float:
        """Rms prediction error of the fitted positions, m."""
        return rms(self.errors.distance)


def fitted_with_instruments(
    equations: RobotEquations, options: Options, progress: ProgressCallback
) -> tuple[RobotEquations, FitEnd]:
    """Fit the declared model, or the one with the instruments and ratios that the poses require;
    also gives the declared one at the values from which its fit starts."""
    declared, best = _fitted_with_tracker(equations, options, progress)
    # Points that may move would imitate another home where a tracker is blamed.
    blamed = best.free - _instruments(equations).free
    best = _recentred(best, options, progress, _AT_HOME if blamed else (*_AT_HOME, *POINTS))
    if (at_home := _with_home(equations, best, options, progress)) is not None:
        declared, best = at_home
    best = _with_more(_recentred(best, options, progress), options, progress)
    return declared, _with_ratios(best, options, progress)


def first_model(equations: RobotEquations, options: Options) -> tuple[RobotEquations, Weights]:
    """The declared model at the values from which its fit starts, and its standard deviations."""
    predicted = predicted_poses(equations, equations.parameters.nominal, equations.robot.home)
    declared = _declared(equations, predicted)
    sigma = _sigma(equations, options)
    return started(declared, sigma)[0], Weights(sigma)


def _declared(equations: RobotEquations, predicted: Pose) -> RobotEquations:
    """The model that the file declares, its tracker registered."""
    own = _instruments(equations)
    return _registered(equations, own, own.free, predicted) if own.free else equations


def _with_home(
    equations: RobotEquations, best: FitEnd, options: Options, progress: ProgressCallback
) -> tuple[RobotEquations, FitEnd] | None:
    """The fit with the cable lengths at home free, where it explains the poses clearly better.
    Lengths some millimetres off look like another frame: it is tried before a tracker is blamed
    that the file does not declare unknown, and where cables and geometry disagree."""
    blamed = best.free - _instruments(equations).free
    # The cables of a hanging platform close at any lengths: what is wrong is left in its poses.
    kinds = ("closure", "position", "rotation") if equations.robot.hangs else ("closure",)
    odd = any(best.weights.sigma.get(kind, 0.0) > _ODD * NOISE[kind].start for kind in kinds)
    if "home_length" in equations.parameters.block or not (blamed or odd):
        return None
    trial = replace(equations, effects=(*equations.effects, HOME_LENGTH))
    trial = with_instruments(trial, _instruments(equations))
    declared, found = _fitted_with_tracker(trial, options, progress)
    found = _recentred(found, options, progress, _AT_HOME)
    count = int(np.count_nonzero(np.isfinite(found.equations.measured.motor_angle)))
    price = len(equations.robot.names) * log(count) + DELTA_CHI_SQUARE
    if not found.criterion + price < best.criterion:
        return None
    return declared, found


def _fitted_with_tracker(
    equations: RobotEquations, options: Options, progress: ProgressCallback
) -> tuple[RobotEquations, FitEnd]:
    """Fit the declared model, or the one with the tracker that the poses require."""
    own = _instruments(equations)
    predicted = predicted_poses(equations, equations.parameters.nominal, equations.robot.home)
    declared = _declared(equations, predicted)
    if "position" not in equations.kinds:
        return declared, fitted(declared, options, progress)
    wider = [
        [
            trial
            for more in combinations(_left(own.free), count + 1)
            for trial in _variants(equations, own, own.free | set(more), predicted)
            # Drums of another size than the file's look like another scale.
            if abs(_first_tracker(trial).scale) < LARGEST_SCALE
        ]
        for count in range(len(_left(own.free)))
    ]
    errors = [_nominal_error(trial, predicted) for trial in (declared, *chain(*wider))]
    least = np.nanmin(errors) if np.any(np.isfinite(errors)) else 0.0
    limit = max(_CLEARLY_WORSE * float(least), _LEAST_MISFIT)

    def is_near(trial: RobotEquations) -> bool:
        return not _nominal_error(trial, predicted) > limit

    first = None
    if "home_length" in equations.parameters.block:
        # They may be far off at the start, which no registration says.
        started_there, error = _starting_at_home(declared)
        if not error > limit:
            first = fitted(started_there, options, progress)
    elif is_near(declared):
        first = fitted(declared, options, progress)
    best = first
    for trials in wider:
        if best is not None and not any(_shows_more(best, trial) for trial in trials):
            break
        fits = [fitted(trial, options, progress) for trial in trials if is_near(trial)]
        fits = [fit for fit in fits if fit.is_plausible and not fit.at_bound]
        if first is not None:
            fits = [fit for fit in fits if fit.error < _LEAST_FALL * first.error]
        chosen = None
        for fit in fits:
            # Of equal explanations the one that stands first is kept: a frame before a reflector.
            if chosen is None or fit.with_prior < chosen.with_prior - DELTA_CHI_SQUARE:
                chosen = fit
        if chosen is None and best is None:
            continue
        if chosen is None or (best is not None and not chosen.criterion < best.criterion):
            break
        best = chosen
    if best is None:
        best = fitted(declared, options, progress)
    return declared, _mounted(best, predicted, options, progress)


def _starting_at_home(equations: RobotEquations) -> tuple[RobotEquations, float]:
    """The equations with lengths at home and tracker by an adjustment, where the lengths are beyond
    their prior, and its misfit, m."""
    index = equations.parameters.block["home_length"]
    found, instruments, left = lengths_at_home(equations, _LEAST_MISFIT)
    if np.all(np.abs(found) <= BEYOND_PRIOR * equations.parameters.std[index]):
        return equations, left
    there = with_instruments(equations, instruments) if equations.instruments else equations
    return replace(there, parameters=there.parameters.starting("home_length", found)), left


def _recentred(
    best: FitEnd,
    options: Options,
    progress: ProgressCallback,
    blocks: Sequence[str] = (*_AT_HOME, *POINTS),
) -> FitEnd:
    """The fit with the priors of lengths at home and points about their estimates, where these left
    them: a prior for a platform in its fixture says nothing of one that stood elsewhere."""
    for _ in range(_ROUNDS_OF_PRIORS):
        parameters, prior = best.equations.parameters, best.solution.linear.prior
        own = {name: parameters.block[name] for name in blocks if name in parameters.block}
        left = [name for name, i in own.items() if np.any(np.abs(prior[i]) > BEYOND_PRIOR)]
        if not left:
            break
        for name in left:
            parameters = parameters.starting(name, best.solution.state.values[own[name]])
        best = fitted(replace(best.equations, parameters=parameters), options, progress)
    return best


def with_own_priors(best: FitEnd, options: Options, progress: ProgressCallback) -> FitEnd:
    """The fit with the priors of points about the robot's own, where they were moved."""
    parameters, geometry = best.equations.parameters, best.equations.robot.geometry
    for name in POINTS:
        parameters = parameters.starting(name, getattr(geometry, name))
    if np.array_equal(parameters.nominal, best.equations.parameters.nominal):
        return best
    return fitted(replace(best.equations, parameters=parameters), options, progress)


def _with_more(best: FitEnd, options: Options, progress: ProgressCallback) -> FitEnd:
    """The fit with more numbers of instruments free, while the poses require one of them."""
    while True:
        own = _instruments(best.equations)
        trials = [
            with_instruments(best.equations, replace(own, free=own.free | {name}))
            for name in _undeclared(best.equations, own)
        ]
        fits = [fitted(t, options, progress, best) for t in trials if _shows_more(best, t)]
        fits = [fit for fit in fits if fit.criterion < best.criterion and not fit.at_bound]
        if not fits:
            return best
        best = min(fits, key=lambda fit: fit.criterion)


def _undeclared(equations: RobotEquations, own: InstrumentValues) -> list[str]:
    """Numbers of instruments other than a tracker that may be free beside those that are."""
    kinds = equations.kinds
    possible = {
        "mounting": "rotation" in kinds and "position" not in kinds,
        "cell_gain": equations.hangs,
        "length_scale": "cable_length" in kinds,
    }
    return [name for name, may in possible.items() if may and name not in own.free]


def _with_ratios(best: FitEnd, options: Options, progress: ProgressCallback) -> FitEnd:
    """The fit with the gear ratios of the lines whose winding radius left its prior. A drum with
    layers distinguishes the two; on others the wider prior of the ratio takes the change."""
    radius = best.equations.parameters.block["winding_radius"]
    prior, held = best.solution.linear.prior[radius], best.solution.held[radius]
    beyond = (np.abs(prior) > BEYOND_PRIOR) | (held != 0)
    if not np.any(beyond):
        return best
    odd = ratios_of(best.equations, best.solution).named
    if not odd or "gear-ratio" in best.equations.effects:
        return best
    effects = (*best.equations.effects, *(f"gear-ratio/{line}" for line in odd))
    trial = with_instruments(replace(best.equations, effects=effects), _instruments(best.equations))
    found = fitted(trial, options, progress, best)
    return found if found.with_prior < best.with_prior else best


def _instruments(equations: RobotEquations) -> InstrumentValues:
    if equations.instruments is not None:
        return equations.instruments
    return declared_instruments(equations.robot, equations.measured)


def _left(free: frozenset[str]) -> list[str]:
    """Parts of a tracker that may be free beside those that are."""
    return [name for name in ("frame", "reflector", "scale") if name not in free]


def _variants(
    equations: RobotEquations, own: InstrumentValues, free: frozenset[str], predicted: Pose
) -> list[RobotEquations]:
    """Rotations in the tracker's frame, and in that of an IMU, unless it is plain which."""
    found = _registered(equations, own, free, predicted)
    used = found.instruments
    if "frame" not in free or "rotation" not in equations.kinds or used is None:
        return [found]
    if equations.robot.profile.instrument.imu is not None:
        return [found]
    other = [replace(t, turns_rotation=not t.turns_rotation) for t in used.trackers]
    both = [found, with_instruments(equations, replace(used, trackers=tuple(other)))]
    both.sort(key=lambda trial: not _first_tracker(trial).turns_rotation)
    plain = [rms(errors_at(trial, trial.parameters.nominal, predicted).angle) for trial in both]
    least = min(plain)
    return [trial for trial, error in zip(both, plain, strict=True) if error <= _PLAINLY * least]


def _first_tracker(equations: RobotEquations) -> Tracker:
    assert equations.instruments is not None
    return equations.instruments.trackers[0]


def _registered(
    equations: RobotEquations, own: InstrumentValues, free: frozenset[str], predicted: Pose
) -> RobotEquations:
    """Equations with these numbers free, at the values of the registration."""
    imu = equations.robot.profile.instrument.imu is not None
    instruments = registered_instruments(own, free, predicted, equations.measured, imu=imu)
    return with_instruments(equations, instruments)


def with_instruments(equations: RobotEquations, instruments: InstrumentValues) -> RobotEquations:
    """The equations with other instruments; the other parameters start as they do."""
    wider = parameters_of(equations.robot, equations.measured, equations.effects, instruments)
    return replace(equations, parameters=wider, instruments=instruments)


def _nominal_error(equations: RobotEquations, predicted: Pose) -> float:
    return rms(errors_at(equations, equations.parameters.nominal, predicted).distance)


def _shows_more(first: FitEnd, wider: RobotEquations) -> bool:
    """Score test: whether one more free part of the tracker explains a significant part of χ². The
    step −(H + 1)⁻¹ g at the end of the fit changes 2 cost by −gᵀ (H + 1)⁻¹ g; the prior's part of
    that is left out."""
    from scipy.special import chdtri

    own = _instruments(first.equations)
    assert wider.instruments is not None
    free = wider.instruments.free
    if not (own.free < free and len(free) == len(own.free) + 1):
        return False
    trial = with_instruments(first.equations, replace(own, free=free))
    before, wide, state = first.equations.parameters, trial.parameters, first.solution.state
    values = before.carried(state.values, wide, wide.nominal)
    left = before.carried(first.solution.held, wide, np.zeros(len(values))) == 0
    linear = linearise(trial, BundleState(values, state.pose), first.weights)
    gradient, prior = linear.gradient[left], linear.prior[left]
    matrix = linear.information[np.ix_(left, left)] + np.eye(len(gradient))
    step = -np.linalg.solve(matrix, gradient)
    fall = -float(gradient @ step) + float(np.sum((prior + step) ** 2 - prior**2))
    return not fall < chdtri(len(wide) - len(before), _LEVEL)


def _mounted(best: FitEnd, predicted: Pose, options: Options, progress: ProgressCallback) -> FitEnd:
    """The fit with the target's axes free, where the measured rotations require it."""
    own = _instruments(best.equations)
    if "rotation" not in best.equations.kinds or "mounting" in own.free:
        return best
    trial = _registered(best.equations, own, own.free | {"mounting"}, predicted)
    if not _shows_more(best, trial):
        return best
    found = fitted(trial, options, progress)
    turned = (rms(fit.errors.angle) for fit in (found, best))
    after, before = turned
    return found if found.criterion < best.criterion and after < _LEAST_FALL * before else best


def fitted(
    equations: RobotEquations,
    options: Options,
    progress: ProgressCallback,
    from_fit: FitEnd | None = None,
) -> FitEnd:
    """Fit and variance components in turn until both have settled, from the end of a fit of fewer
    parameters where there is one, so that it fits at least as well."""
    given = options.sigma or {}
    if from_fit is None:
        equations, state = started(equations, _sigma(equations, options))
        weights = Weights(_sigma(equations, options))
    else:
        equations, state = _continued(equations, from_fit)
        weights = Weights({**_sigma(equations, options), **from_fit.weights.sigma})
    solution = solve(equations, state, weights, _reporter(progress, "fit"))
    state, changed = in_other_zeros(equations, solution.state, weights)
    if changed:
        solution = solve(equations, state, weights, _reporter(progress, "refit"))
    for _ in range(_NOISE_ROUNDS):
        found = re_estimated_weights(solution, weights, given)
        if _settled(found.sigma, weights.sigma):
            break
        weights = found
        solution = solve(equations, solution.state, weights, _reporter(progress, "refit"))
    return FitEnd(equations, solution, weights)


def _continued(equations: RobotEquations, fitted: FitEnd) -> tuple[RobotEquations, BundleState]:
    """Equations with the priors of a fit of fewer parameters, and its end as their state."""
    wider, own, end = equations.parameters, fitted.equations.parameters, fitted.solution.state
    wider = wider.about(own.carried(own.nominal, wider, wider.nominal))
    values = own.carried(end.values, wider, wider.nominal)
    return replace(equations, parameters=wider), BundleState(values, end.pose)


def _sigma(equations: RobotEquations, options: Options) -> dict[str, float]:
    given = options.sigma or {}
    return {kind: given.get(kind, NOISE[kind].start) for kind in equations.kinds}


def _reporter(progress: ProgressCallback, word: str) -> Callable[[int, float], None]:
    return lambda step, cost: progress(f"{word}: step {step}, cost {cost:.6g}", None)


def _settled(new: Mapping[str, float], old: Mapping[str, float]) -> bool:
    return all(abs(new[kind] - old[kind]) <= _SETTLED_CHANGE * old[kind] for kind in new)
