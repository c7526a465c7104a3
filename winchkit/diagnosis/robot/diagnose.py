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

import numpy as np
from scipy.stats import f as f_distribution

from winchkit.diagnosis.design.detectability import Bar, detectable
from winchkit.diagnosis.diagnose import (
    Answer,
    ProgressCallback,
    candidates_of,
    no_progress,
    steps_of,
)
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import spread_of
from winchkit.diagnosis.results import Estimate, OutputFit, RobotDiagnosis, Step, Where, plain_step
from winchkit.diagnosis.robot.attribution import follows_of
from winchkit.diagnosis.robot.candidates import GEOMETRY
from winchkit.diagnosis.robot.engine import PoseSelection
from winchkit.diagnosis.robot.errors import Errors, Shown, errors_of, figures, rms
from winchkit.diagnosis.robot.excitation import what_poses_cannot_show
from winchkit.diagnosis.robot.pose_design import next_pose_runs
from winchkit.diagnosis.robot.preparation import Study, fitted_to, study_of
from winchkit.diagnosis.robot.prior import Believed
from winchkit.diagnosis.robot.regression import PoseRegression
from winchkit.diagnosis.selection.stepwise import SelectionResult, stepwise_selection
from winchkit.diagnosis.verdict.decision import Judgement, judge
from winchkit.diagnosis.verdict.equivalence import Confusion, confusion_of, pairs_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

__all__ = [
    "RobotAnswer",
    "Seen",
    "answer_of",
    "diagnose_robot",
]

_WHERE = 6
_FAR_OFF, _NO_WORSE = 0.7, 1.1
"""A geometry that was let go is worth a look where some error falls below this share of what it
was, and none rises above that one."""


class RobotAnswer(Answer):
    """A diagnosis of poses with everything behind it."""

    engine: PoseSelection

    def __init__(self, seen: Seen, sets: Sequence[Confusion], diagnosis: RobotDiagnosis) -> None:
        super().__init__(seen.engine, seen.judgement.shown, diagnosis, sets)
        self.seen = seen

    @property
    def filed(self) -> PoseSelection:
        """Engine with the geometry at its file values."""
        return self.seen.filed


@dataclass(frozen=True)
class Seen:
    """Where a search in poses began and ended."""

    study: Study
    engine: PoseSelection
    filed: PoseSelection
    """Takes the geometry as the profile has it; the same where that was not let go."""
    result: SelectionResult
    judgement: Judgement

    @property
    def refitted(self) -> bool:
        """Whether the geometry as filed had to be let go."""
        return self.engine is not self.filed

    @cached_property
    def initial_model(self) -> Shown:
        """The profile's own effects fitted, the geometry as filed."""
        first, noise = self.filed.fit_with_noise(self.filed.initial_model)
        return Shown(self.filed.regression, first, noise, self.filed.regression.groups)

    @cached_property
    def final(self) -> Shown:
        """With all that was named."""
        shown, engine = self.judgement.shown, self.engine
        return Shown(engine.regression, shown.final, shown.noise, engine.regression.groups)

    @cached_property
    def errors(self) -> tuple[Errors, Errors]:
        """Of both, at every pose."""
        initial_model, final = (
            errors_of(s.regression, s.regression.at(s.fit.hypothesis))
            for s in (self.initial_model, self.final)
        )
        return initial_model, final

    @property
    def rest(self) -> tuple[PoseRegression, Errors]:
        """Where to look for what is left: beside the geometry as filed, unless that is far off.

        A geometry that was let go for nothing has moved to imitate what is missing.
        """
        before, after = self.errors
        falls = [rms(name, after[name]) / rms(name, before[name]) for name in after]
        if self.refitted and (min(falls) > _FAR_OFF or max(falls) > _NO_WORSE):
            return self.initial_model.regression, before
        return self.final.regression, after


def answer_of(seen: Seen, geometry: str) -> RobotAnswer:
    """What was found, in words, figures and places; ``geometry`` is how that was taken."""
    engine, judgement, study = seen.engine, seen.judgement, seen.study
    shown, verdict = judgement.shown, judgement.verdict
    added = range(engine.n_initial_terms, len(shown.final.hypothesis.terms))
    sets = [confusion_of(engine, shown.final, shown.noise, index) for index in added]
    steps = tuple(map(plain_step, steps_of(engine, shown, sets))) if sets else ()
    outputs = figures(seen.initial_model, seen.final, study.noise)
    if seen.refitted and verdict in ("adequate", "explained"):
        verdict = "explained"
        steps = (_geometry_step(engine, shown, outputs["cable_length"]), *steps)
    diagnosis = RobotDiagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, seen.result),
        detectable=detectable(
            seen.result.scores, Bar(engine.penalty_per_parameter, seen.result.threshold)
        ),
        unexplained_share=judgement.share,
        where=_places(seen) if seen.result.lack_of_fit else (),
        next_runs=next_pose_runs(engine.regression, shown.final.hypothesis, pairs_of(sets)),
        notes=(*study.dataset.notes, *what_poses_cannot_show(study), *judgement.notes),
        geometry=geometry,
    )
    return RobotAnswer(seen, sets, diagnosis)


def _places(seen: Seen) -> tuple[Where, ...]:
    """Where the rest lives, the largest share first."""
    result = follows_of(*seen.rest)
    places = [Where(f.output, f.variable, f.share, line=f.line) for f in result]
    return tuple(sorted(places, key=lambda w: -w.share)[:_WHERE])


def _geometry_step(engine: PoseSelection, shown: SelectionResult, output: OutputFit) -> Step:
    """All of the geometry, as one addition that no few numbers can replace."""
    regression = engine.regression
    believed = regression.standing.believed
    std = spread_of(regression, shown.final, shown.noise, engine.regression.blocks).std
    first = regression.nuisance_columns.shape[1] - len(believed)
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


_GEOMETRY_LEVEL = 1e-3
_ONE_OF_FEW = 0.4


def diagnose_robot(
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
    progress: ProgressCallback = no_progress,
) -> RobotAnswer:
    """Find which effect of the catalogue a robot's model lacks on these poses.

    ``told`` hears what is begun and which share (0 to 1) of the work is about done. Raises RunError
    with every fault of every run, FileError for effects that do not bind.
    """
    progress("judging the noise", 0.0)
    study = study_of(runs, profile, catalogue or load_catalogue())
    progress("searching", 0.4)
    if fitted_to(profile, runs):
        engine = study.let_go()
        return _concluded(study, engine, engine)
    filed = study.as_filed()
    if _beyond_few(study, filed):
        return _concluded(study, study.let_go(), filed)
    result = stepwise_selection(filed)
    if added := result.final.hypothesis.terms[filed.n_initial_terms :]:
        # Poses placed by ropes that contradict each other turn, and tensions there look unbalanced.
        filed = study.as_filed(added[:1])
        result = stepwise_selection(filed)
    judgement = judge(filed, result)
    if judgement.verdict in ("adequate", "explained") and not _geometry_is_off(
        study, filed, result
    ):
        return answer_of(Seen(study, filed, filed, result, judgement), "file")
    return _concluded(study, study.let_go(), filed)


def _beyond_few(study: Study, filed: PoseSelection) -> bool:
    """Whether the whole geometry explains far more than any single effect does."""
    gain = _gain_of_geometry(study, filed, filed.initial_model)
    if not _is_real(study, gain):
        return False
    present, noise = filed.fit_with_noise(filed.initial_model)
    best = max((s.explained_ss for s in filed.scores(present, noise)), default=0.0)
    return best < _ONE_OF_FEW * gain


def _gain_of_geometry(study: Study, filed: PoseSelection, model: Hypothesis) -> float:
    """Whitened squares that the geometry takes, beyond what its uncertainty allows it."""
    standing = filed.regression.standing
    wide = PoseRegression(replace(standing, believed=_from(study.prior, standing.believed)))
    hypothesis = replace(model, nuisances=())
    before = filed.regression
    chi_square = fit(before, hypothesis, np.ones(before.n_rows)).chi_square
    return chi_square - fit(wide, hypothesis, np.ones(wide.n_rows)).chi_square


def _concluded(study: Study, engine: PoseSelection, filed: PoseSelection) -> RobotAnswer:
    """With the geometry let go."""
    result = stepwise_selection(engine)
    return answer_of(Seen(study, engine, filed, result, judge(engine, result)), "refitted")


def _geometry_is_off(study: Study, filed: PoseSelection, result: SelectionResult) -> bool:
    """Whether the geometry as a whole would explain more of what is left than chance does."""
    return _is_real(study, _gain_of_geometry(study, filed, result.final.hypothesis))


def _is_real(study: Study, gain: float) -> bool:
    """F test of the whitened squares that the geometry takes."""
    count = len(study.prior)
    dof = study.noise.dof.get("cable_length", 1.0)
    level = float(f_distribution.isf(_GEOMETRY_LEVEL, count, max(dof, 1.0)))
    return gain / count > level


def _from(prior: Sequence[Believed], now: Sequence[Believed]) -> tuple[Believed, ...]:
    """Priors from where the numbers are now."""
    there = {(b.term.effect.id, b.parameter): b.value for b in now}
    out = []
    for belief in prior:
        value = there.get((belief.term.effect.id, belief.parameter), 0.0)
        out.append(replace(belief.moved(value / belief.std), at=value))
    return tuple(out)
