"""The diagnosis of a robot: first with the numbers of its file, then with its geometry let go.

The geometry that was fitted to these very runs is fitted again beside whatever is sought, as are
the values of all effects that a profile has. A geometry that was not is taken as it stands, within
the uncertainty of its calibration; only where no few effects explain the runs with it is all of it
let go, and then it is the first thing that the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.stats import f as f_distribution

from winchkit.diagnosis.confusion import confusion_of, pairs_of
from winchkit.diagnosis.diagnose import Answer, candidates_of, steps_of
from winchkit.diagnosis.fit import fit
from winchkit.diagnosis.power import detectable
from winchkit.diagnosis.problem import Hypothesis
from winchkit.diagnosis.result import Estimate, NextRun, Step, Where
from winchkit.diagnosis.robot.believed import Believed
from winchkit.diagnosis.robot.dataset import RobotDataset, prepare_poses
from winchkit.diagnosis.robot.figures import Shown, errors_of, figures
from winchkit.diagnosis.robot.inquiry import RobotInquiry
from winchkit.diagnosis.robot.limits import what_poses_cannot_show
from winchkit.diagnosis.robot.noise import PoseNoise
from winchkit.diagnosis.robot.places import GEOMETRY, candidates_at, geometry_believed
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.diagnosis.robot.result import RobotDiagnosis, plain_step
from winchkit.diagnosis.robot.settle import balanced, begun, judged_noise, settled
from winchkit.diagnosis.robot.where import follows_of
from winchkit.diagnosis.search import Found, search
from winchkit.diagnosis.uncertainty import spread_of
from winchkit.diagnosis.verdict import Judgement, judge
from winchkit.effects.bind import Term
from winchkit.effects.bind_robot import robot_terms
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.runs.run import Run
from winchkit.schema.robot import RobotProfile

__all__ = ["Study", "diagnose_robot", "fitted_to", "study_of"]

_GEOMETRY_LEVEL = 1e-3
_WHERE = 6
_SHORT_LIST = 3
_ONE_OF_FEW = 0.4


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


def diagnose_robot(
    runs: Sequence[Run], profile: RobotProfile, catalogue: Catalogue | None = None
) -> Answer:
    """Find which effect of the catalogue a robot's model lacks on these poses.

    Raises RunError with every fault of every run, FileError for effects that do not bind.
    """
    study = study_of(runs, profile, catalogue or load_catalogue())
    if fitted_to(profile, runs):
        inquiry = study.let_go()
        return _concluded(study, inquiry, inquiry, "refitted")
    filed = study.as_filed()
    if _beyond_few(study, filed):
        return _concluded(study, study.let_go(), filed, "refitted")
    found = search(filed)
    if added := found.final.hypothesis.terms[filed.given :]:
        # Poses placed by ropes that contradict each other turn, and tensions there look unbalanced.
        filed = study.as_filed(added[:1])
        found = search(filed)
    judgement = judge(filed, found)
    if judgement.verdict in ("adequate", "explained") and not _geometry_is_off(study, filed, found):
        return _answer(study, filed, filed, (found, judgement), "file")
    return _concluded(study, study.let_go(), filed, "refitted")


def _beyond_few(study: Study, filed: RobotInquiry) -> bool:
    """Whether the whole geometry explains far more than any single effect does."""
    gain = _gain_of_geometry(study, filed, filed.begin)
    if not _is_real(study, gain):
        return False
    present, noise = filed.settle(filed.begin)
    best = max((s.gain for s in filed.scores(present, noise)), default=0.0)
    return best < _ONE_OF_FEW * gain


def _gain_of_geometry(study: Study, filed: RobotInquiry, model: Hypothesis) -> float:
    """Whitened squares that the geometry takes, beyond what its uncertainty allows it."""
    standing = filed.robot_problem.standing
    wide = RobotProblem(replace(standing, believed=_from(study.prior, standing.believed)))
    hypothesis = replace(model, nuisances=())
    before = filed.problem
    cost = fit(before, hypothesis, np.ones(before.rows)).cost
    return cost - fit(wide, hypothesis, np.ones(wide.rows)).cost


def _concluded(study: Study, inquiry: RobotInquiry, filed: RobotInquiry, geometry: str) -> Answer:
    found = search(inquiry)
    return _answer(study, inquiry, filed, (found, judge(inquiry, found)), geometry)


def _geometry_is_off(study: Study, filed: RobotInquiry, found: Found) -> bool:
    """Whether the geometry as a whole would explain more of what is left than chance does."""
    return _is_real(study, _gain_of_geometry(study, filed, found.final.hypothesis))


def _is_real(study: Study, gain: float) -> bool:
    """F test of the whitened squares that the geometry takes."""
    count = len(study.prior)
    freedom = study.noise.freedom.get("cable_length", 1.0)
    level = float(f_distribution.isf(_GEOMETRY_LEVEL, count, max(freedom, 1.0)))
    return gain / count > level


def _from(prior: Sequence[Believed], now: Sequence[Believed]) -> tuple[Believed, ...]:
    """Priors from where the numbers are now."""
    there = {(b.term.effect.id, b.parameter): b.value for b in now}
    out = []
    for belief in prior:
        value = there.get((belief.term.effect.id, belief.parameter), 0.0)
        out.append(replace(belief.moved(value / belief.std), at=value))
    return tuple(out)


def _answer(
    study: Study,
    inquiry: RobotInquiry,
    filed: RobotInquiry,
    searched: tuple[Found, Judgement],
    geometry: str,
) -> Answer:
    """What was found, in words, figures and places."""
    found, judgement = searched
    shown, verdict, problem = judgement.shown, judgement.verdict, inquiry.robot_problem
    added = range(inquiry.given, len(shown.final.hypothesis.terms))
    sets = [confusion_of(inquiry, shown.final, shown.noise, index) for index in added]
    steps = tuple(map(plain_step, steps_of(inquiry, shown, sets))) if sets else ()
    first, noise = filed.settle(filed.begin)
    begin = Shown(filed.robot_problem, first, noise, filed.groups)
    final = Shown(problem, shown.final, shown.noise, inquiry.groups)
    outputs = figures(begin, final, study.noise)
    if inquiry is not filed and verdict in ("adequate", "explained"):
        verdict = "explained"
        steps = (_geometry_step(inquiry, shown, outputs["cable_length"]), *steps)
    errors = errors_of(problem, problem.at(shown.final.hypothesis))
    places = [Where(f.output, f.variable, f.share) for f in follows_of(problem, errors)]
    diagnosis = RobotDiagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(inquiry, found),
        detectable=detectable(found.scores, inquiry.price, found.threshold),
        unexplained_share=judgement.share,
        where=tuple(places[:_WHERE]) if found.still else (),
        next_runs=tuple(
            NextRun((a.effect.id, b.effect.id), a.effect.told_apart, float("nan"))
            for a, b in pairs_of(sets)
        ),
        notes=(*study.dataset.notes, *what_poses_cannot_show(study), *judgement.notes),
        geometry=geometry,
    )
    return Answer(inquiry, shown, diagnosis, sets)


def _geometry_step(inquiry: RobotInquiry, shown: Found, output: object) -> Step:
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
    before, after = (getattr(output, f"heldout_rms_{when}") for when in ("before", "after"))
    gain = 1 - (after / before) ** 2 if before else 0.0
    present = {name.partition("/")[0] for name in values}
    return Step(tuple(name for name in GEOMETRY if name in present), values, gain)
