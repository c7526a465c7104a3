"""Candidate kinds of further poses, simulated on a robot's model, and their power.

Each kind differs from the poses so far in one respect (farther out, turned more, other forces,
other temperatures). Of each, the poses are chosen greedily for the noncentrality that they add
(:mod:`winchkit.robot.identification.pose_design`) to every question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.design.discrimination import LEAST_POWER, SEPARATED_AT, power_of
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.results import NextRun
from winchkit.effects.effect import told_apart
from winchkit.effects.term import Term
from winchkit.model.rotation import angles_of
from winchkit.robot.diagnosis.adjustment import equations_of
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.files.poses import MeasuredPoses, joined
from winchkit.robot.forces.force_distribution import approximate_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import BundleState
from winchkit.robot.identification.pose_design import (
    chosen_in_turn,
    in_box,
    is_held,
    middle_and_half,
    noncentrality,
    pose_information,
    random_poses,
    simulated,
)

_CANDIDATES = 60
"""Random poses per kind; theory: the best of 59 is among the best 5 % with a probability of 95 %, 1
− 0.95⁵⁹."""
_SEED = 20
"""Seed of the random poses; arbitrary."""
_WIDTH_RATIO, _SHARE_OF_FRAME = 2.0, 0.85
"""_WIDTH_RATIO: Width of "farther out" over the poses so far; rule of thumb. _SHARE_OF_FRAME: Share
of the frame that poses stay inside of; rule of thumb."""
_LEAST_ROTATION, _ROTATION_RATIO = np.radians(12.0), 2.0
"""_LEAST_ROTATION: Least rotation of "turned more", rad; rule of thumb. _ROTATION_RATIO: Rotation
of "turned more" over the poses so far; rule of thumb."""
_LEAST_HALF_WIDTH = 0.02
"""Least half width of "farther out", m; rule of thumb."""
_FORCE_RATIO, _TEMPERATURE_STEP = 2.0, 15.0
"""_FORCE_RATIO: Ratio of tensions to those so far, and its inverse; rule of thumb.
_TEMPERATURE_STEP: Temperature difference of "warmth", K; rule of thumb."""


@dataclass(frozen=True)
class PoseCandidates:
    """Kind of poses: its difference from the poses so far."""

    name: str
    words: str
    out: bool = False
    """Farther out, within the frame and where cables hold the platform."""
    turned: bool = False
    stronger: bool = False
    """Cable forces from half to twice those so far."""
    warmer: bool = False


POSE_CANDIDATES = (
    PoseCandidates("more", "as widely as so far"),
    PoseCandidates("turned", "turned more", turned=True),
    PoseCandidates("farther", "farther out", out=True),
    PoseCandidates("farther-turned", "farther out and turned more", out=True, turned=True),
    PoseCandidates("tensions", "under cable forces from half to twice those so far", stronger=True),
    PoseCandidates("warmth", "with the cables 15 K colder and warmer", warmer=True),
)
"""In ascending order of effort for the user."""


def usable(kind: PoseCandidates, dataset: RobotDataset) -> bool:
    """Whether the difference of a kind is measured on this robot."""
    if kind.stronger and not dataset.has_tension:
        return False
    return bool(np.isfinite(dataset.measured.temperature).all()) or not kind.warmer


def simulated_poses(
    regression: PoseRegression, robot: Robot, kind: PoseCandidates
) -> tuple[MeasuredPoses, Pose]:
    """Simulate measurements at random poses of a kind, without noise."""
    rng = np.random.default_rng(_SEED)
    pose = _placed(regression, robot, kind, rng)
    force = _forces(regression, robot, kind, pose, rng)
    good = is_held(robot.geometry, robot.platform, pose)
    if regression.dataset.has_tension:
        good &= np.isfinite(force).all(axis=1) & (force > 0).all(axis=1)
    pose, force = pose[good], force[good]
    so_far = regression.dataset.measured
    warm = np.nanmean(np.where(np.isfinite(so_far.temperature), so_far.temperature, 20.0))
    warmth = np.full(force.shape, warm)
    if kind.warmer:
        colder = np.arange(len(force)) % 2 == 0
        warmth += np.where(colder, -_TEMPERATURE_STEP, _TEMPERATURE_STEP)[:, None]
    return simulated(so_far, robot, pose, force, warmth), pose


def _placed(
    regression: PoseRegression, robot: Robot, kind: PoseCandidates, rng: np.random.Generator
) -> Pose:
    """Random poses of a kind."""
    so_far = regression.point.pose
    corners = robot.geometry.exit_point
    middle, half = middle_and_half(so_far.position)
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    allowed = _SHARE_OF_FRAME * np.ptp(corners, axis=0) / 2
    half_width = np.maximum(_WIDTH_RATIO * half, _LEAST_HALF_WIDTH) if kind.out else half
    place = in_box((middle, half_width), _CANDIDATES, rng)
    if np.all(allowed > 0):
        place = centre + np.clip(place - centre, -allowed, allowed)
    level, tilt = middle_and_half(angles_of(so_far.rotation))
    more = np.maximum(_ROTATION_RATIO * tilt, _LEAST_ROTATION) if kind.turned else tilt
    return random_poses(robot.geometry, place, in_box((level, more), _CANDIDATES, rng))


def _forces(
    regression: PoseRegression,
    robot: Robot,
    kind: PoseCandidates,
    pose: Pose,
    rng: np.random.Generator,
) -> Array:
    """Cable forces that balance the weight, spread as those measured so far; zero without cells."""
    measured, many = regression.dataset.measured.tension, len(pose.position)
    if not regression.dataset.has_tension:
        return np.zeros((many, measured.shape[1]))
    known = measured[np.isfinite(measured).all(axis=1)]
    start = known[rng.integers(len(known), size=many)]
    if kind.stronger:
        start = start * np.exp(rng.uniform(-1, 1, (many, 1)) * np.log(_FORCE_RATIO))
    return approximate_forces(robot.structure(pose), robot.weight(pose), start)


Question = tuple[Term, Term | None]
"""An effect and the rival from which it is to be separated; None asks for its detection."""
POSES = 12
"""Poses per offer."""
_HIGH_POWER = 0.9
"""Power from which one kind of poses is enough; convention."""
_OFFERED = 2
"""Kinds of poses that are offered per pair; rule of thumb."""
_SUFFICIENT_MARGIN = 3.04
"""Standard deviations above the threshold beyond which more information is not counted: a power of
99.9 %."""


@dataclass(frozen=True)
class PoseOffer:
    """Poses of one kind, the most informative first."""

    kind: PoseCandidates
    pose: Pose
    motor_angle: Array
    """At these poses, (k, n), rad."""
    tension: Array
    """Cable forces at these poses, (k, n), N; NaN where none is measured."""
    powers: tuple[float, ...]
    """Power of these poses and all so far, by question."""
    powers_so_far: tuple[float, ...]
    """Power of the poses so far, by question."""


def next_pose_runs(
    regression: PoseRegression, final: Hypothesis, pairs: Sequence[tuple[Term, Term]]
) -> tuple[NextRun, ...]:
    """Per pair of effects the first kind of poses that separates it with a power of 90 %, else the
    two best above 20 %; else the advice of the effects' cards, with a power of NaN."""
    out: list[NextRun] = []
    for first, second in pairs:
        offers = pose_offers(regression, final, [(first, second)], [SEPARATED_AT])
        names = (first.effect.id, second.effect.id)
        certain = [o for o in offers if o.powers[0] >= _HIGH_POWER][:1]
        ranked = sorted(offers, key=lambda o: -o.powers[0])
        offered = certain or [o for o in ranked if o.powers[0] >= LEAST_POWER][:_OFFERED]
        out += [NextRun(names, _words(o), o.powers[0]) for o in offered]
        if not offered:
            advice = told_apart(first.effect, second.effect)
            out.append(NextRun(names, advice, float("nan")))
    return tuple(out)


def pose_offers(
    regression: PoseRegression,
    final: Hypothesis,
    questions: Sequence[Question],
    required: Sequence[float],
    count: int = POSES,
) -> list[PoseOffer]:
    """Choose poses of every kind for a set of questions, each answered at its ``required`` χ², in
    ascending order of effort."""
    robot = regression.point.robot(final.terms)
    kinds = [kind for kind in POSE_CANDIDATES if usable(kind, regression.dataset)]
    simulated = [(kind, *simulated_poses(regression, robot, kind)) for kind in kinds]
    simulated = [(kind, measured, pose) for kind, measured, pose in simulated if len(measured)]
    extended = _with_all(regression, simulated)
    parts = [_information(extended, final, question) for question in questions]
    begin = len(regression.dataset.measured)
    base = [part[-1] + part[:begin].sum(axis=0) for part in parts]
    powers_so_far = _powers([float(noncentrality(own)) for own in base], required)
    out = []
    for kind, measured, pose in simulated:
        own = slice(begin, begin + len(measured))
        begin = own.stop
        chosen, noncentralities = _chosen([part[own] for part in parts], base, required, count)
        at = pose[chosen]
        powers = _powers(noncentralities, required)
        out.append(
            PoseOffer(
                kind,
                at,
                measured.motor_angle[chosen],
                measured.tension[chosen],
                powers,
                powers_so_far,
            )
        )
    return out


def _powers(noncentralities: Sequence[float], required: Sequence[float]) -> tuple[float, ...]:
    """Power for each question."""
    return tuple(power_of(*both) for both in zip(noncentralities, required, strict=True))


def reach(offer: PoseOffer) -> tuple[float, float]:
    """Largest distance of an offer's poses from their middle, m, and largest angle, rad."""
    place, turned = offer.pose.position, angles_of(offer.pose.rotation)
    distance = np.linalg.norm(place - (place.min(axis=0) + place.max(axis=0)) / 2, axis=1)
    return float(distance.max()), float(np.abs(turned).max())


def _words(offer: PoseOffer) -> str:
    distance, turned = reach(offer)
    return (
        f"{len(offer.pose.position)} poses more, {offer.kind.words} (up to {distance * 1e3:.0f} mm "
        f"from their middle, turned by up to {np.degrees(turned):.0f}°); "
        "'winchkit plan' lists them"
    )


def _with_all(
    regression: PoseRegression, simulated: Sequence[tuple[PoseCandidates, MeasuredPoses, Pose]]
) -> PoseRegression:
    """Regression of the poses so far and all simulated ones; samples of a trajectory count as poses
    at rest: what they show of inertia or a delay is no part of a question about poses."""
    point, dataset = regression.point, regression.dataset
    poses = [point.pose, *(pose for _, _, pose in simulated)]
    measured = joined([dataset.measured, *(own for _, own, _ in simulated)])
    pose = Pose(
        np.concatenate([p.position for p in poses]), np.concatenate([p.rotation for p in poses])
    )
    distinct = np.arange(len(measured), dtype=np.intp)
    extended = replace(dataset, measured=measured, pose=distinct, trajectory=None)
    equations = equations_of(extended, point.equations.parameters)
    state = BundleState(point.state.values, pose)
    return PoseRegression(replace(point, dataset=extended, equations=equations, state=state))


def _information(regression: PoseRegression, final: Hypothesis, question: Question) -> Array:
    """Information of an effect's column, which is the first, its rival's and the nuisances', (poses
    + 1, k, k); the last matrix is that of the prior."""
    first, second = question
    in_question = {term.effect.id for term in question if term is not None}
    others = Hypothesis()
    for term in final.terms:
        if term.effect.id not in in_question:
            others = others.with_term(term, regression.n_runs)
    here = regression.change(others)
    signature = regression.change(others.with_term(first, regression.n_runs)) - here
    rival = others if second is None else others.with_term(second, regression.n_runs)
    rival_columns = regression.jacobian(regression.vector(rival), rival)
    columns = np.column_stack([signature, rival_columns, regression.change(rival) - here])
    columns = np.where(np.isfinite(columns), columns, 0.0)
    size = np.sqrt(np.sum(columns[:, 1:] ** 2, axis=0))
    kept = np.concatenate([[True], size > 0])
    columns = columns[:, kept] / np.concatenate([[1.0], size[size > 0]])
    row = np.maximum(regression.pose_of_row, -1)
    return pose_information(columns, row, len(regression.dataset.measured) + 1)


def _chosen(
    parts: Sequence[Array], base: Sequence[Array], required: Sequence[float], count: int
) -> tuple[list[int], list[float]]:
    """Poses chosen in turn for the noncentrality λ of all questions, and λ with them."""
    sums = list(base)
    sufficient = (np.sqrt(required) + _SUFFICIENT_MARGIN) ** 2
    chosen: list[int] = []

    def gains() -> Array:
        each = (
            np.minimum(noncentrality(total + part), most)
            for total, part, most in zip(sums, parts, sufficient, strict=True)
        )
        return np.asarray(np.sum(list(each), axis=0))

    def add(index: int, gain: float) -> bool:
        chosen.append(index)
        sums[:] = [total + part[index] for total, part in zip(sums, parts, strict=True)]
        return True

    chosen_in_turn(len(parts[0]), count, gains, add)
    return chosen, [float(noncentrality(total)) for total in sums]
