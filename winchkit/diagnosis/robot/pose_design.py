"""Kinds of poses that a robot may take next, imagined on its model: farther out, turned more, …"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.design.discrimination import APART, power_of
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.results import NextRun
from winchkit.diagnosis.robot.dataset import RobotDataset
from winchkit.diagnosis.robot.regression import PoseRegression
from winchkit.effects.effect import told_apart
from winchkit.effects.term import Term
from winchkit.model.robot import (
    ForceLimits,
    Pose,
    Robot,
    angles_of,
    approximate_forces,
    lengths,
    rotation_of,
    swivel_angle,
    wrench_feasibility,
)
from winchkit.runs.poses import Measured, joined

__all__ = [
    "KINDS",
    "POSES",
    "WORTHWHILE",
    "PoseKind",
    "PoseOffer",
    "Question",
    "imagined",
    "next_pose_runs",
    "pose_offers",
    "reach",
    "usable",
]

_CANDIDATES = 60
_SEED = 20
_WIDER, _INSIDE = 2.0, 0.85
_TURNED, _MORE = np.radians(12.0), 2.0
_LEAST_BOX = 0.02
_STRONGER, _WARMER = 2.0, 15.0
_PULLING = ForceLimits(0.0, float("inf"))
_FREEDOMS = 6


@dataclass(frozen=True)
class PoseKind:
    """A kind of poses, and in what it differs from those so far."""

    name: str
    words: str
    out: bool = False
    """Farther out, as far as ropes hold inside the frame."""
    turned: bool = False
    stronger: bool = False
    """Rope forces from half to twice those so far."""
    warmer: bool = False


KINDS = (
    PoseKind("more", "as widely as so far"),
    PoseKind("turned", "turned more", turned=True),
    PoseKind("farther", "farther out", out=True),
    PoseKind("farther-turned", "farther out and turned more", out=True, turned=True),
    PoseKind("tensions", "under rope forces from half to twice those so far", stronger=True),
    PoseKind("warmth", "with the ropes 15 K colder and warmer", warmer=True),
)
"""Those that ask least of the user first."""


def usable(kind: PoseKind, dataset: RobotDataset) -> bool:
    """Whether a kind differs in something that is measured on this robot."""
    if kind.stronger and not dataset.has_tension:
        return False
    return bool(np.isfinite(dataset.measured.temperature).all()) or not kind.warmer


def imagined(regression: PoseRegression, robot: Robot, kind: PoseKind) -> tuple[Measured, Pose]:
    """What would be measured at poses of a kind, without noise, and those poses.

    Only where pulling ropes hold the platform; NaN where nothing was measured so far.
    """
    rng = np.random.default_rng(_SEED)
    pose = _placed(regression, robot, kind, rng)
    force = _forces(regression, robot, kind, pose, rng)
    good = _held(robot, pose) & np.isfinite(force).all(axis=1) & (force > 0).all(axis=1)
    if not regression.dataset.has_tension:
        good = _held(robot, pose)
    pose, force = Pose(pose.position[good], pose.rotation[good]), force[good]
    return _measured(regression.dataset, robot, kind, pose, force), pose


def _placed(
    regression: PoseRegression, robot: Robot, kind: PoseKind, rng: np.random.Generator
) -> Pose:
    """Random poses of a kind that the geometry can take."""
    seen = regression.point.pose
    corners = robot.geometry.exit_point
    middle, half = _middle(seen.position)
    centre = (corners.min(axis=0) + corners.max(axis=0)) / 2
    room = _INSIDE * np.ptp(corners, axis=0) / 2
    wide = np.maximum(_WIDER * half, _LEAST_BOX) if kind.out else half
    place = middle + wide * rng.uniform(-1, 1, (_CANDIDATES, 3))
    if np.all(room > 0):
        place = centre + np.clip(place - centre, -room, room)
    level, tilt = _middle(angles_of(seen.rotation))
    more = np.maximum(_MORE * tilt, _TURNED) if kind.turned else tilt
    angles = level + more * rng.uniform(-1, 1, (_CANDIDATES, 3))
    pose = Pose(place, rotation_of(*angles.T))
    sound = np.isfinite(lengths(robot.geometry, pose.position, pose.rotation)).all(axis=1)
    return Pose(pose.position[sound], pose.rotation[sound])


def _middle(values: Array) -> tuple[Array, Array]:
    """Middle and half width, column by column."""
    low, high = values.min(axis=0), values.max(axis=0)
    return (low + high) / 2, (high - low) / 2


def _held(robot: Robot, pose: Pose) -> NDArray[np.bool_]:
    """Whether ropes that only pull balance the platform's weight there."""
    if len(robot.names) < _FREEDOMS:
        return np.ones(len(pose.position), dtype=bool)
    pairs = zip(robot.structure(pose), robot.weight(pose), strict=True)
    return np.array([wrench_feasibility(a, w, _PULLING).margin > 0 for a, w in pairs], dtype=bool)


def _forces(
    regression: PoseRegression, robot: Robot, kind: PoseKind, pose: Pose, rng: np.random.Generator
) -> Array:
    """Rope forces that balance the weight, spread as those measured so far; zero without cells."""
    measured, many = regression.dataset.measured.tension, len(pose.position)
    if not regression.dataset.has_tension:
        return np.zeros((many, measured.shape[1]))
    known = measured[np.isfinite(measured).all(axis=1)]
    start = known[rng.integers(len(known), size=many)]
    if kind.stronger:
        start = start * np.exp(rng.uniform(-1, 1, (many, 1)) * np.log(_STRONGER))
    return approximate_forces(robot.structure(pose), robot.weight(pose), start)


def _measured(
    dataset: RobotDataset, robot: Robot, kind: PoseKind, pose: Pose, force: Array
) -> Measured:
    so_far, many = dataset.measured, len(pose.position)

    def where_known(values: Array, there: Array) -> Array:
        return np.where(np.isfinite(values).any(axis=0), there, np.nan)

    warm = np.nanmean(np.where(np.isfinite(so_far.temperature), so_far.temperature, 20.0))
    warmth = np.full((many, len(dataset.names)), warm)
    if kind.warmer:
        warmth += np.where(np.arange(many) % 2, _WARMER, -_WARMER)[:, None]
    length = lengths(robot.geometry, pose.position, pose.rotation)
    return replace(
        so_far,
        motor_angle=robot.motor_angles(pose, tension=force),
        position=where_known(so_far.position, pose.position),
        angles=where_known(so_far.angles, angles_of(pose.rotation)),
        swivel=where_known(
            so_far.swivel, swivel_angle(robot.geometry, pose.position, pose.rotation)
        ),
        cable_length=where_known(so_far.cable_length, length),
        tension=where_known(so_far.tension, force),
        temperature=where_known(so_far.temperature, warmth),
        run=np.zeros(many, dtype=np.intp),
        place=np.full(many, "proposed"),
    )


Question = tuple[Term, Term | None]
"""An effect, and the rival that it is to be told from; without one, from nothing at all."""
POSES = 12
"""Of an offer."""
_SURE, WORTHWHILE = 0.9, 0.2
_OFFERED = 2
_ENOUGH = 3.04
"""Deviations beyond what is needed where more is of no use: a power of 99.9 %."""
_RIDGE = 1e-9


@dataclass(frozen=True)
class PoseOffer:
    """Poses of one kind, the most telling ones first."""

    kind: PoseKind
    pose: Pose
    motor_angle: Array
    """That goes with them, (k, n), rad."""
    tension: Array
    """Of the ropes there, (k, n), N; NaN where none is measured."""
    powers: tuple[float, ...]
    """Per question the chance that these poses and all so far answer it."""
    so_far: tuple[float, ...]
    """The same without them."""


def next_pose_runs(
    regression: PoseRegression, final: Hypothesis, pairs: Sequence[tuple[Term, Term]]
) -> tuple[NextRun, ...]:
    """Per pair the kinds of poses that tell it apart, with the power that they would have.

    The first that is sure to, else the best; where no poses do, what the effect's card says.
    """
    out: list[NextRun] = []
    for first, second in pairs:
        offers = pose_offers(regression, final, [(first, second)], [APART])
        names = (first.effect.id, second.effect.id)
        sure = [o for o in offers if o.powers[0] >= _SURE][:1]
        fair = sorted(offers, key=lambda o: -o.powers[0])
        useful = sure or [o for o in fair if o.powers[0] >= WORTHWHILE][:_OFFERED]
        out += [NextRun(names, _words(o), o.powers[0]) for o in useful]
        if not useful:
            apart = told_apart(first.effect, second.effect)
            out.append(NextRun(names, apart, float("nan")))
    return tuple(out)


def pose_offers(
    regression: PoseRegression,
    final: Hypothesis,
    questions: Sequence[Question],
    needed: Sequence[float],
    count: int = POSES,
) -> list[PoseOffer]:
    """Every kind of poses with the ``count`` that answer the questions best, least effort first.

    ``needed`` are the whitened squares that answer each question.
    """
    robot = regression.point.robot(final.terms)
    kinds = [kind for kind in KINDS if usable(kind, regression.dataset)]
    tried = [(kind, *imagined(regression, robot, kind)) for kind in kinds]
    tried = [(kind, seen, pose) for kind, seen, pose in tried if len(seen)]
    wide = _with_all(regression, tried)
    parts = [_information(wide, final, question) for question in questions]
    initial_model = len(regression.dataset.measured)
    base = [part[-1] + part[:initial_model].sum(axis=0) for part in parts]
    so_far = _powers([float(_left_over(own)) for own in base], needed)
    out = []
    for kind, seen, pose in tried:
        own = slice(initial_model, initial_model + len(seen))
        initial_model = own.stop
        chosen, strength = _chosen([part[own] for part in parts], base, needed, count)
        at = Pose(pose.position[chosen], pose.rotation[chosen])
        powers = _powers(strength, needed)
        out.append(
            PoseOffer(kind, at, seen.motor_angle[chosen], seen.tension[chosen], powers, so_far)
        )
    return out


def _powers(strength: Sequence[float], needed: Sequence[float]) -> tuple[float, ...]:
    """Chance of an answer to each question."""
    return tuple(power_of(*both) for both in zip(strength, needed, strict=True))


def reach(offer: PoseOffer) -> tuple[float, float]:
    """How far its poses are from their middle, m, and how much they turn, rad, at most."""
    place, turned = offer.pose.position, angles_of(offer.pose.rotation)
    away = np.linalg.norm(place - (place.min(axis=0) + place.max(axis=0)) / 2, axis=1)
    return float(away.max()), float(np.abs(turned).max())


def _words(offer: PoseOffer) -> str:
    away, turned = reach(offer)
    return (
        f"{len(offer.pose.position)} poses more, {offer.kind.words} (up to {away * 1e3:.0f} mm "
        f"from their middle, turned by up to {np.degrees(turned):.0f}°); "
        "'winchkit plan' lists them"
    )


def _with_all(
    regression: PoseRegression, tried: Sequence[tuple[PoseKind, Measured, Pose]]
) -> PoseRegression:
    """The poses so far and all imagined ones as one regression."""
    point, dataset = regression.point, regression.dataset
    poses = [point.pose, *(pose for _, _, pose in tried)]
    measured = joined([dataset.measured, *(seen for _, seen, _ in tried)])
    pose = Pose(
        np.concatenate([p.position for p in poses]), np.concatenate([p.rotation for p in poses])
    )
    distinct = np.arange(len(measured), dtype=np.intp)
    wide = replace(dataset, measured=measured, pose=distinct)
    return PoseRegression(replace(point, dataset=wide, pose=pose))


def _information(regression: PoseRegression, final: Hypothesis, question: Question) -> Array:
    """Squares and products of an effect, its rival and nuisances, pose by pose; the prior's last.

    (poses + 1, k, k); the effect comes first.
    """
    first, second = question
    asked = {term.effect.id for term in question if term is not None}
    others = Hypothesis()
    for term in final.terms:
        if term.effect.id not in asked:
            others = others.with_term(term, regression.n_runs)
    here = regression.change(others)
    shown = regression.change(others.with_term(first, regression.n_runs)) - here
    rival = others if second is None else others.with_term(second, regression.n_runs)
    imitation = regression.jacobian(regression.vector(rival), rival)
    columns = np.column_stack([shown, imitation, regression.change(rival) - here])
    columns = np.where(np.isfinite(columns), columns, 0.0)
    size = np.sqrt(np.sum(columns[:, 1:] ** 2, axis=0))
    kept = np.concatenate([[True], size > 0])
    columns = columns[:, kept] / np.concatenate([[1.0], size[size > 0]])
    row = regression.pose_of_row
    out = np.zeros((len(regression.dataset.measured) + 1, columns.shape[1], columns.shape[1]))
    for pose in np.unique(row):
        own = columns[row == pose]
        out[max(pose, -1)] += own.T @ own
    return out


def _left_over(information: Array) -> Array:
    """λ of the first column where all the others may take any size; (…)."""
    rest = information[..., 1:, 1:] + _RIDGE * np.eye(information.shape[-1] - 1)
    across = information[..., 1:, :1]
    taken = np.swapaxes(across, -1, -2) @ np.linalg.solve(rest, across)
    return np.asarray(np.maximum(information[..., 0, 0] - taken[..., 0, 0], 0.0))


def _chosen(
    parts: Sequence[Array], base: Sequence[Array], needed: Sequence[float], count: int
) -> tuple[list[int], list[float]]:
    """Poses chosen one after another for what they add to λ of all questions, and λ with them."""
    sums, left = list(base), np.ones(len(parts[0]), dtype=bool)
    enough = (np.sqrt(needed) + _ENOUGH) ** 2
    chosen: list[int] = []
    while len(chosen) < count and np.any(left):
        gains = sum(
            np.minimum(_left_over(total + part), most)
            for total, part, most in zip(sums, parts, enough, strict=True)
        )
        best = int(np.argmax(np.where(left, gains, -np.inf)))
        left[best] = False
        chosen.append(best)
        sums = [total + part[best] for total, part in zip(sums, parts, strict=True)]
    return chosen, [float(_left_over(total)) for total in sums]
