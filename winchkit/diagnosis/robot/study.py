"""What is known of poses before anything is sought, and the inquiries that begin there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from winchkit.diagnosis.robot.believed import Believed
from winchkit.diagnosis.robot.dataset import RobotDataset, prepare_poses
from winchkit.diagnosis.robot.inquiry import RobotInquiry
from winchkit.diagnosis.robot.noise import PoseNoise
from winchkit.diagnosis.robot.places import candidates_at, geometry_believed
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.diagnosis.robot.settle import balanced, begun, judged_noise, settled
from winchkit.effects.bind import Term
from winchkit.effects.bind_robot import robot_terms
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect
from winchkit.runs.run import Run
from winchkit.schema.robot import RobotProfile

__all__ = ["Study", "fitted_to", "study_of"]

_SHORT_LIST = 3


@dataclass(frozen=True)
class Study:
    """What stays the same however the geometry is taken."""

    dataset: RobotDataset
    catalogue: Catalogue
    candidates: tuple[Effect, ...]
    noise: PoseNoise
    prior: tuple[Believed, ...]
    """The geometry with the priors of a calibration."""
    guess: tuple[Term, ...] = ()
    """What is missing most likely: where the geometry is let go, it settles beside it."""

    @cached_property
    def own(self) -> tuple[Term, ...]:
        """The profile's own effects at their file values."""
        return robot_terms(self.dataset.robot, self.catalogue)

    def inquiry(self, believed: Sequence[Believed], beside: tuple[Term, ...] = ()) -> RobotInquiry:
        """Beginning with the profile's own effects, the geometry believed as given."""
        terms = (*self.own, *beside)
        standing, terms = settled(self.dataset, terms, self.noise.sigma, believed)
        problem = RobotProblem(standing)
        begin = begun(terms[: len(self.own)])
        return RobotInquiry(problem, begin, self.candidates, self.noise)

    def as_filed(self, beside: tuple[Term, ...] = ()) -> RobotInquiry:
        """With the numbers of the file, as sure as its calibration left them."""
        believed = geometry_believed(self.dataset, self.catalogue, fitted=True)
        return self.inquiry(believed, beside)

    def let_go(self) -> RobotInquiry:
        """With the geometry fitted too."""
        return self.inquiry(self.prior, self.guess)

    def guessed(self) -> Study:
        """With the effect that explains most beside the geometry, and the noise beside it.

        A geometry that was fitted without what is missing lies millimetres off, too far to be
        linear in between.
        """
        inquiry = self.let_go()
        present, noise = inquiry.settle(inquiry.begin)
        listed = [s for s in inquiry.scores(present, noise) if s.value > 0][:_SHORT_LIST]
        trials = [inquiry.trial(present, item, noise) for item in listed]
        best = min(trials, key=lambda t: t.criterion, default=None)
        if best is None or best.criterion > inquiry.criterion(present):
            return self
        guess = best.fit.hypothesis.terms[-1:]
        absent = tuple(e for e in self.candidates if e.id != guess[0].effect.id)
        noise_beside = judged_noise(self.dataset, (*self.own, *guess), self.prior, absent)
        return replace(self, guess=guess, noise=noise_beside)


def study_of(runs: Sequence[Run], profile: RobotProfile, catalogue: Catalogue) -> Study:
    """Read poses and judge their noise. Raises RunError, and FileError for effects."""
    dataset = prepare_poses(runs, profile)
    own = robot_terms(profile, catalogue)
    prior = tuple(geometry_believed(dataset, catalogue, fitted=False))
    there = {term.effect.id for term in own}
    candidates = tuple(candidates_at(dataset, catalogue))
    absent = tuple(effect for effect in candidates if effect.id not in there)
    noise = judged_noise(dataset, own, prior, absent)
    if not balanced(dataset, noise):
        dataset = replace(dataset, balanced=False)
        candidates = tuple(candidates_at(dataset, catalogue))
    return Study(dataset, catalogue, candidates, noise, prior).guessed()


def fitted_to(profile: RobotProfile, runs: Sequence[Run]) -> bool:
    """Whether the geometry was calibrated on some of these very runs."""
    known = {Path(name).name for name in profile.fitted.runs} if profile.fitted else set()
    return any(Path(run.path or run.name).name in known for run in runs)
