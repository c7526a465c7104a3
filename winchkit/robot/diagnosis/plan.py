"""Plan of further poses: pairs of effects that they separate, effects that become detectable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.diagnosis.design.discrimination import LEAST_POWER, SEPARATED_AT
from winchkit.diagnosis.plan import Plan
from winchkit.diagnosis.verdict.equivalence import pairs_of
from winchkit.effects.card import usual_values
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.placement import base_of
from winchkit.effects.term import Term
from winchkit.model.rotation import angles_of
from winchkit.robot.diagnosis.diagnose import RobotAnswer
from winchkit.robot.diagnosis.pose_design import POSES, PoseOffer, Question, pose_offers
from winchkit.runs.run import Channel, Run

_HIGH_POWER = 0.9
"""Power from which on a question counts as answered."""
_MOST = 6
"""Most effects whose detectability is asked for."""


@dataclass(frozen=True)
class PosePlan(Plan):
    """Kinds of poses, the most informative first, and the questions that they answer."""

    hidden: tuple[Term, ...]
    """Effects that are not detectable in their usual size with the poses so far."""
    offers: tuple[PoseOffer, ...]
    lines: tuple[str, ...]

    def shows(self, offer: PoseOffer) -> list[str]:
        """Effects that become detectable with an offer."""
        powers = offer.powers[len(self.pairs) :]
        detectable = zip(self.hidden, powers, strict=True)
        return [term.effect.id for term, power in detectable if power >= _HIGH_POWER]

    @property
    def best(self) -> PoseOffer | None:
        """First offer; None where it separates no pair and makes no effect detectable."""
        for offer in self.offers[:1]:
            if self.shows(offer) or max(self.of_pairs(offer), default=0.0) >= LEAST_POWER:
                return offer
        return None

    def of_pairs(self, offer: PoseOffer) -> tuple[float, ...]:
        """Power of separating each pair."""
        return offer.powers[: len(self.pairs)]

    def to_json(self) -> dict[str, Any]:
        """As ``winchkit plan --json`` prints it for a robot."""
        return {"schema": 1, "offers": [self._offer(offer) for offer in self.offers]}

    def _offer(self, offer: PoseOffer) -> Mapping[str, Any]:
        separated = zip(self.pairs, offer.powers, offer.powers_so_far, strict=False)
        angles = angles_of(offer.pose.rotation)
        return {
            "kind": offer.kind.name,
            "separates": [
                {"effects": [a.effect.id, b.effect.id], "power": power, "power_so_far": before}
                for (a, b), power, before in separated
            ],
            "shows": self.shows(offer),
            "poses": [
                {
                    "position": place.tolist(),
                    "angles": turned.tolist(),
                    "motor_angle": dict(zip(self.lines, motor.tolist(), strict=True)),
                }
                for place, turned, motor in zip(
                    offer.pose.position, angles, offer.motor_angle, strict=True
                )
            ],
        }

    def run(self, offer: PoseOffer) -> Run:
        """Poses of an offer as a run: targets to drive to, to be completed by measurements."""
        angles = angles_of(offer.pose.rotation)
        channels = {
            f"platform_{axis}": Channel(offer.pose.position[:, k], "m")
            for k, axis in enumerate("xyz")
        }
        channels |= {
            f"platform_{name}": Channel(angles[:, k], "rad")
            for k, name in enumerate(("roll", "pitch", "yaw"))
        }
        for k, line in enumerate(self.lines):
            channels[f"{line}.motor_angle"] = Channel(offer.motor_angle[:, k], "rad")
            if np.isfinite(offer.tension[:, k]).all():
                channels[f"{line}.tension"] = Channel(offer.tension[:, k], "N")
        time = np.arange(len(angles), dtype=float)
        metadata = {"programme": f"proposed: {offer.kind.words}"}
        return Run("proposed", time, channels, metadata)


def plan(answer: RobotAnswer, count: int = POSES) -> PosePlan:
    """Rank kinds of poses, ``count`` each, by simulation on the model of a diagnosis.

    Ranked by the number of pairs separated, then by their powers, then the same for detectable
    effects.
    """
    regression, final = answer.engine.regression, answer.result.final.hypothesis
    pairs = tuple(pairs_of(answer.sets))
    hidden = _hidden(answer)
    questions: list[Question] = [*pairs, *((term, None) for term in hidden)]
    n_pairs, threshold = len(pairs), answer.threshold
    required = [SEPARATED_AT] * n_pairs + [
        threshold.required_ss(Coordinates(t.effect).n_parameters) for t in hidden
    ]
    offers = pose_offers(regression, final, questions, required, count) if questions else []

    def worth(offer: PoseOffer) -> tuple[float, ...]:
        separated = sum(power >= _HIGH_POWER for power in offer.powers[:n_pairs])
        summed = round(sum(offer.powers[:n_pairs]), 1)
        detectable = sum(power >= _HIGH_POWER for power in offer.powers[n_pairs:])
        return separated, summed, detectable, round(sum(offer.powers[n_pairs:]), 1)

    return PosePlan(
        pairs, hidden, tuple(sorted(offers, key=worth, reverse=True)), regression.dataset.names
    )


def _hidden(answer: RobotAnswer) -> tuple[Term, ...]:
    """Effects not detectable in their usual size, the most nearly detectable first; of effects on
    one line each, the line with the least power."""
    undetectable: dict[str, tuple[float, Term]] = {}
    there = {term.effect.id for term in answer.result.final.hypothesis.terms}
    for score in answer.result.scores:
        effect = score.candidate.effect
        detected = (
            answer.threshold.power(score.noncentrality, score.candidate.n_parameters) >= _HIGH_POWER
        )
        if not score.noncentrality > 0 or detected or effect.id in there:
            continue
        known = undetectable.get(base_of(effect))
        if known is None or score.noncentrality < known[0]:
            values = {**usual_values(effect), **score.candidate.shape}
            undetectable[base_of(effect)] = score.noncentrality, Term(effect, values)
    ranked = sorted(undetectable.values(), key=lambda item: -item[0])[:_MOST]
    return tuple(term for _, term in ranked)
