"""Everything that is said of what a search in a robot's poses found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from winchkit.diagnosis.confusion import Confusion, confusion_of, pairs_of
from winchkit.diagnosis.diagnose import Answer, candidates_of, steps_of
from winchkit.diagnosis.power import Bar, detectable
from winchkit.diagnosis.result import Estimate, OutputFit, Step, Where
from winchkit.diagnosis.robot.figures import Errors, Shown, errors_of, figures, rms
from winchkit.diagnosis.robot.inquiry import RobotInquiry
from winchkit.diagnosis.robot.limits import what_poses_cannot_show
from winchkit.diagnosis.robot.next_poses import next_pose_runs
from winchkit.diagnosis.robot.places import GEOMETRY
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.diagnosis.robot.result import RobotDiagnosis, plain_step
from winchkit.diagnosis.robot.study import Study
from winchkit.diagnosis.robot.where import follows_of
from winchkit.diagnosis.search import Found
from winchkit.diagnosis.uncertainty import spread_of
from winchkit.diagnosis.verdict import Judgement

__all__ = ["RobotAnswer", "Seen", "answer_of"]

_WHERE = 6
_FAR_OFF, _NO_WORSE = 0.7, 1.1
"""A geometry that was let go is worth a look where some error falls below this share of what it
was, and none rises above that one."""


class RobotAnswer(Answer):
    """A diagnosis of poses with everything behind it."""

    def __init__(self, seen: Seen, sets: Sequence[Confusion], diagnosis: RobotDiagnosis) -> None:
        super().__init__(seen.inquiry, seen.judgement.shown, diagnosis, sets)
        self.seen = seen

    @property
    def robot_problem(self) -> RobotProblem:
        """The problem of the inquiry that the answer came from."""
        return self.seen.inquiry.robot_problem

    @property
    def filed(self) -> RobotInquiry:
        """The inquiry that took the geometry as it was filed."""
        return self.seen.filed


@dataclass(frozen=True)
class Seen:
    """Where a search in poses began and ended."""

    study: Study
    inquiry: RobotInquiry
    filed: RobotInquiry
    """Takes the geometry as the profile has it; the same where that was not let go."""
    found: Found
    judgement: Judgement

    @property
    def refitted(self) -> bool:
        """Whether the geometry as filed had to be let go."""
        return self.inquiry is not self.filed

    @cached_property
    def begin(self) -> Shown:
        """The profile's own effects fitted, the geometry as filed."""
        first, noise = self.filed.settle(self.filed.begin)
        return Shown(self.filed.robot_problem, first, noise, self.filed.groups)

    @cached_property
    def final(self) -> Shown:
        """With all that was named."""
        shown, inquiry = self.judgement.shown, self.inquiry
        return Shown(inquiry.robot_problem, shown.final, shown.noise, inquiry.groups)

    @cached_property
    def errors(self) -> tuple[Errors, Errors]:
        """Of both, at every pose."""
        begin, final = (
            errors_of(s.problem, s.problem.at(s.fit.hypothesis)) for s in (self.begin, self.final)
        )
        return begin, final

    @property
    def rest(self) -> tuple[RobotProblem, Errors]:
        """Where to look for what is left: beside the geometry as filed, unless that is far off.

        A geometry that was let go for nothing has moved to imitate what is missing.
        """
        before, after = self.errors
        falls = [rms(name, after[name]) / rms(name, before[name]) for name in after]
        if self.refitted and (min(falls) > _FAR_OFF or max(falls) > _NO_WORSE):
            return self.begin.problem, before
        return self.final.problem, after


def answer_of(seen: Seen, geometry: str) -> RobotAnswer:
    """What was found, in words, figures and places; ``geometry`` is how that was taken."""
    inquiry, judgement, study = seen.inquiry, seen.judgement, seen.study
    shown, verdict = judgement.shown, judgement.verdict
    added = range(inquiry.given, len(shown.final.hypothesis.terms))
    sets = [confusion_of(inquiry, shown.final, shown.noise, index) for index in added]
    steps = tuple(map(plain_step, steps_of(inquiry, shown, sets))) if sets else ()
    outputs = figures(seen.begin, seen.final, study.noise)
    if seen.refitted and verdict in ("adequate", "explained"):
        verdict = "explained"
        steps = (_geometry_step(inquiry, shown, outputs["cable_length"]), *steps)
    diagnosis = RobotDiagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(inquiry, seen.found),
        detectable=detectable(seen.found.scores, Bar(inquiry.price, seen.found.threshold)),
        unexplained_share=judgement.share,
        where=_places(seen) if seen.found.still else (),
        next_runs=next_pose_runs(inquiry.robot_problem, shown.final.hypothesis, pairs_of(sets)),
        notes=(*study.dataset.notes, *what_poses_cannot_show(study), *judgement.notes),
        geometry=geometry,
    )
    return RobotAnswer(seen, sets, diagnosis)


def _places(seen: Seen) -> tuple[Where, ...]:
    """Where the rest lives, the largest share first."""
    found = follows_of(*seen.rest)
    places = [Where(f.output, f.variable, f.share, line=f.line) for f in found]
    return tuple(sorted(places, key=lambda w: -w.share)[:_WHERE])


def _geometry_step(inquiry: RobotInquiry, shown: Found, output: OutputFit) -> Step:
    """All of the geometry, as one addition that no few numbers can replace."""
    problem = inquiry.robot_problem
    believed = problem.standing.believed
    std = spread_of(problem, shown.final, shown.noise, inquiry.blocks).std
    first = problem.nuisance_columns.shape[1] - len(believed)
    values: dict[str, dict[str, Estimate]] = {}
    for index, belief in enumerate(believed):
        by = shown.final.vector[first + index]
        unit = belief.term.effect.parameter(belief.parameter).unit
        values.setdefault(belief.term.effect.id, {})[belief.parameter] = Estimate(
            belief.value + float(by) * belief.std, float(std[first + index]) * belief.std, unit
        )
    before, after = output.heldout_rms_before, output.heldout_rms_after
    gain = 1 - (after / before) ** 2 if before else 0.0
    present = {name.partition("/")[0] for name in values}
    return Step(tuple(name for name in GEOMETRY if name in present), values, gain, whole=True)
