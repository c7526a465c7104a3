"""Which poses to take next: those at which effects differ that the poses so far confuse.

Equations of a pose add up, whatever the pose: so do the squares and products of what an effect
does there, of what its rival can imitate, and of the nuisances. What no size of the rival takes up
is the noncentrality λ (Hunter and Reiner, 1965), with all poses so far and the new ones together;
poses are chosen one after another for the greatest gain of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.next_run import APART, power_of
from winchkit.diagnosis.result import NextRun
from winchkit.diagnosis.robot.next_kinds import KINDS, PoseKind, imagined, usable
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.effects.bind import Term
from winchkit.effects.effect import told_apart
from winchkit.effects.robot_poses import Measured, joined
from winchkit.model.robot import Pose, angles_of

__all__ = ["POSES", "WORTHWHILE", "PoseOffer", "Question", "next_pose_runs", "pose_offers", "reach"]

Array = NDArray[np.float64]
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
    problem: RobotProblem, final: Hypothesis, pairs: Sequence[tuple[Term, Term]]
) -> tuple[NextRun, ...]:
    """Per pair the kinds of poses that tell it apart, with the power that they would have.

    The first that is sure to, else the best; where no poses do, what the effect's card says.
    """
    out: list[NextRun] = []
    for first, second in pairs:
        offers = pose_offers(problem, final, [(first, second)], [APART])
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
    problem: RobotProblem,
    final: Hypothesis,
    questions: Sequence[Question],
    needed: Sequence[float],
    count: int = POSES,
) -> list[PoseOffer]:
    """Every kind of poses with the ``count`` that answer the questions best, least effort first.

    ``needed`` are the whitened squares that answer each question.
    """
    robot = problem.standing.robot(final.terms)
    kinds = [kind for kind in KINDS if usable(kind, problem.dataset)]
    tried = [(kind, *imagined(problem, robot, kind)) for kind in kinds]
    tried = [(kind, seen, pose) for kind, seen, pose in tried if len(seen)]
    wide = _with_all(problem, tried)
    parts = [_information(wide, final, question) for question in questions]
    begin = len(problem.dataset.measured)
    base = [part[-1] + part[:begin].sum(axis=0) for part in parts]
    so_far = _powers([float(_left_over(own)) for own in base], needed)
    out = []
    for kind, seen, pose in tried:
        own = slice(begin, begin + len(seen))
        begin = own.stop
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
    problem: RobotProblem, tried: Sequence[tuple[PoseKind, Measured, Pose]]
) -> RobotProblem:
    """The poses so far and all imagined ones as one regression."""
    standing, dataset = problem.standing, problem.dataset
    poses = [standing.pose, *(pose for _, _, pose in tried)]
    measured = joined([dataset.measured, *(seen for _, seen, _ in tried)])
    pose = Pose(
        np.concatenate([p.position for p in poses]), np.concatenate([p.rotation for p in poses])
    )
    distinct = np.arange(len(measured), dtype=np.intp)
    wide = replace(dataset, measured=measured, pose=distinct)
    return RobotProblem(replace(standing, dataset=wide, pose=pose))


def _information(problem: RobotProblem, final: Hypothesis, question: Question) -> Array:
    """Squares and products of an effect, its rival and nuisances, pose by pose; the prior's last.

    (poses + 1, k, k); the effect comes first.
    """
    first, second = question
    asked = {term.effect.id for term in question if term is not None}
    others = Hypothesis()
    for term in final.terms:
        if term.effect.id not in asked:
            others = others.with_term(term, problem.runs)
    here = problem.change(others)
    shown = problem.change(others.with_term(first, problem.runs)) - here
    rival = others if second is None else others.with_term(second, problem.runs)
    imitation = problem.jacobian(problem.vector(rival), rival)
    columns = np.column_stack([shown, imitation, problem.change(rival) - here])
    columns = np.where(np.isfinite(columns), columns, 0.0)
    size = np.sqrt(np.sum(columns[:, 1:] ** 2, axis=0))
    kept = np.concatenate([[True], size > 0])
    columns = columns[:, kept] / np.concatenate([[1.0], size[size > 0]])
    row = problem.pose_of_row
    out = np.zeros((len(problem.dataset.measured) + 1, columns.shape[1], columns.shape[1]))
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
