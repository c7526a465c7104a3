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
from winchkit.diagnosis.robot.errors import Errors, FittedModel, errors_of, figures, rms
from winchkit.diagnosis.robot.excitation import what_poses_cannot_show
from winchkit.diagnosis.robot.pose_design import next_pose_runs
from winchkit.diagnosis.robot.preparation import Preparation, calibrated_on, prepare_selection
from winchkit.diagnosis.robot.prior import GeometryPrior
from winchkit.diagnosis.robot.regression import PoseRegression
from winchkit.diagnosis.selection.stepwise import SelectionResult, stepwise_selection
from winchkit.diagnosis.verdict.decision import Judgement, judge
from winchkit.diagnosis.verdict.equivalence import Confusion, confusion_of, pairs_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

__all__ = [
    "RobotAnswer",
    "RobotSelection",
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

    def __init__(
        self, selection: RobotSelection, sets: Sequence[Confusion], diagnosis: RobotDiagnosis
    ) -> None:
        super().__init__(selection.engine, selection.judgement.shown, diagnosis, sets)
        self.selection = selection

    @property
    def file_engine(self) -> PoseSelection:
        """Engine with the geometry at its file values."""
        return self.selection.file_engine


@dataclass(frozen=True)
class RobotSelection:
    """Where a search in poses began and ended."""

    preparation: Preparation
    engine: PoseSelection
    file_engine: PoseSelection
    """Takes the geometry as the profile has it; the same where that was not let go."""
    result: SelectionResult
    judgement: Judgement

    @property
    def geometry_is_free(self) -> bool:
        """Whether the geometry as filed had to be let go."""
        return self.engine is not self.file_engine

    @cached_property
    def initial_model(self) -> FittedModel:
        """The profile's own effects fitted, the geometry as filed."""
        first, noise = self.file_engine.fit_with_noise(self.file_engine.initial_model)
        return FittedModel(
            self.file_engine.regression, first, noise, self.file_engine.regression.groups
        )

    @cached_property
    def final(self) -> FittedModel:
        """With all that was named."""
        shown, engine = self.judgement.shown, self.engine
        return FittedModel(engine.regression, shown.final, shown.noise, engine.regression.groups)

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
        if self.geometry_is_free and (min(falls) > _FAR_OFF or max(falls) > _NO_WORSE):
            return self.initial_model.regression, before
        return self.final.regression, after


def answer_of(selection: RobotSelection, geometry: str) -> RobotAnswer:
    """What was found, in words, figures and places; ``geometry`` is how that was taken."""
    engine, judgement, preparation = selection.engine, selection.judgement, selection.preparation
    shown, verdict = judgement.shown, judgement.verdict
    added = range(engine.n_initial_terms, len(shown.final.hypothesis.terms))
    sets = [confusion_of(engine, shown.final, shown.noise, index) for index in added]
    steps = tuple(map(plain_step, steps_of(engine, shown, sets))) if sets else ()
    outputs = figures(selection.initial_model, selection.final, preparation.noise)
    if selection.geometry_is_free and verdict in ("adequate", "explained"):
        verdict = "explained"
        steps = (_geometry_step(engine, shown, outputs["cable_length"]), *steps)
    diagnosis = RobotDiagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, selection.result),
        detectable=detectable(
            selection.result.scores, Bar(engine.penalty_per_parameter, selection.result.threshold)
        ),
        unexplained_share=judgement.share,
        where=_places(selection) if selection.result.lack_of_fit else (),
        next_runs=next_pose_runs(engine.regression, shown.final.hypothesis, pairs_of(sets)),
        notes=(*preparation.dataset.notes, *what_poses_cannot_show(preparation), *judgement.notes),
        geometry=geometry,
    )
    return RobotAnswer(selection, sets, diagnosis)


def _places(selection: RobotSelection) -> tuple[Where, ...]:
    """Where the rest lives, the largest share first."""
    result = follows_of(*selection.rest)
    places = [Where(f.output, f.variable, f.share, line=f.line) for f in result]
    return tuple(sorted(places, key=lambda w: -w.share)[:_WHERE])


def _geometry_step(engine: PoseSelection, shown: SelectionResult, output: OutputFit) -> Step:
    """All of the geometry, as one addition that no few numbers can replace."""
    regression = engine.regression
    geometry = regression.point.geometry
    std = spread_of(regression, shown.final, shown.noise, engine.regression.blocks).std
    first = regression.nuisance_columns.shape[1] - len(geometry)
    values: dict[str, dict[str, Estimate]] = {}
    for index, item in enumerate(geometry):
        by = shown.final.vector[first + index]
        unit = item.term.effect.parameter(item.parameter).unit
        values.setdefault(item.term.effect.id, {})[item.parameter] = Estimate(
            item.value + float(by) * item.std, float(std[first + index]) * item.std, unit
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
    preparation = prepare_selection(runs, profile, catalogue or load_catalogue())
    progress("searching", 0.4)
    if calibrated_on(profile, runs):
        engine = preparation.free_geometry()
        return _concluded(preparation, engine, engine)
    file_engine = preparation.file_geometry()
    if _beyond_few(preparation, file_engine):
        return _concluded(preparation, preparation.free_geometry(), file_engine)
    result = stepwise_selection(file_engine)
    if added := result.final.hypothesis.terms[file_engine.n_initial_terms :]:
        # Poses placed by ropes that contradict each other turn, and tensions there look unbalanced.
        file_engine = preparation.file_geometry(added[:1])
        result = stepwise_selection(file_engine)
    judgement = judge(file_engine, result)
    if judgement.verdict in ("adequate", "explained") and not _geometry_is_off(
        preparation, file_engine, result
    ):
        return answer_of(
            RobotSelection(preparation, file_engine, file_engine, result, judgement), "file"
        )
    return _concluded(preparation, preparation.free_geometry(), file_engine)


def _beyond_few(preparation: Preparation, file_engine: PoseSelection) -> bool:
    """Whether the whole geometry explains far more than any single effect does."""
    gain = _gain_of_geometry(preparation, file_engine, file_engine.initial_model)
    if not _is_real(preparation, gain):
        return False
    present, noise = file_engine.fit_with_noise(file_engine.initial_model)
    best = max((s.explained_ss for s in file_engine.scores(present, noise)), default=0.0)
    return best < _ONE_OF_FEW * gain


def _gain_of_geometry(
    preparation: Preparation, file_engine: PoseSelection, model: Hypothesis
) -> float:
    """Whitened squares that the geometry takes, beyond what its uncertainty allows it."""
    point = file_engine.regression.point
    wide = PoseRegression(replace(point, geometry=_from(preparation.prior, point.geometry)))
    hypothesis = replace(model, nuisances=())
    before = file_engine.regression
    chi_square = fit(before, hypothesis, np.ones(before.n_rows)).chi_square
    return chi_square - fit(wide, hypothesis, np.ones(wide.n_rows)).chi_square


def _concluded(
    preparation: Preparation, engine: PoseSelection, file_engine: PoseSelection
) -> RobotAnswer:
    """With the geometry let go."""
    result = stepwise_selection(engine)
    return answer_of(
        RobotSelection(preparation, engine, file_engine, result, judge(engine, result)), "refitted"
    )


def _geometry_is_off(
    preparation: Preparation, file_engine: PoseSelection, result: SelectionResult
) -> bool:
    """Whether the geometry as a whole would explain more of what is left than chance does."""
    return _is_real(
        preparation, _gain_of_geometry(preparation, file_engine, result.final.hypothesis)
    )


def _is_real(preparation: Preparation, gain: float) -> bool:
    """F test of the whitened squares that the geometry takes."""
    count = len(preparation.prior)
    dof = preparation.noise.dof.get("cable_length", 1.0)
    level = float(f_distribution.isf(_GEOMETRY_LEVEL, count, max(dof, 1.0)))
    return gain / count > level


def _from(
    prior: Sequence[GeometryPrior], now: Sequence[GeometryPrior]
) -> tuple[GeometryPrior, ...]:
    """Priors from where the numbers are now."""
    there = {(b.term.effect.id, b.parameter): b.value for b in now}
    out = []
    for item in prior:
        value = there.get((item.term.effect.id, item.parameter), 0.0)
        out.append(replace(item.moved(value / item.std), at=value))
    return tuple(out)
