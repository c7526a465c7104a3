"""Diagnosis of a robot: first with the geometry of its file, then with the geometry free.

A geometry that was calibrated on these runs is fitted again beside every candidate, as are the
profile's own effects. Any other geometry is taken from the file within the uncertainty of its
calibration; only where no few effects explain the runs is it fitted as a whole, and it is then the
first missing part of the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from scipy.special import fdtri

from winchkit.diagnosis.design.detectability import DetectionThreshold, detectable
from winchkit.diagnosis.diagnose import (
    Answer,
    ProgressCallback,
    no_progress,
)
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.residuals.attribution import MOST_PLACES, Attribution
from winchkit.diagnosis.residuals.traces import PoseTrace, pose_traces
from winchkit.diagnosis.results import (
    Estimate,
    OutputFit,
    RobotDiagnosis,
    Step,
    Verdict,
    plain_step,
)
from winchkit.diagnosis.robot.attribution import pose_attributions
from winchkit.diagnosis.robot.candidates import GEOMETRY
from winchkit.diagnosis.robot.engine import PoseSelection
from winchkit.diagnosis.robot.errors import (
    UNITS,
    Errors,
    FittedModel,
    column_names,
    errors_of,
    output_fits_of,
    rms,
)
from winchkit.diagnosis.robot.excitation import missing_pose_excitation
from winchkit.diagnosis.robot.pose_design import next_pose_runs
from winchkit.diagnosis.robot.preparation import Preparation, calibrated_on, prepare_selection
from winchkit.diagnosis.robot.prior import GeometryPrior
from winchkit.diagnosis.robot.regression import PoseRegression
from winchkit.diagnosis.robot.trajectory_regression import regression_at
from winchkit.diagnosis.selection.stepwise import SelectionResult, stepwise_selection
from winchkit.diagnosis.steps import candidates_of, standing_of, steps_of, with_standing
from winchkit.diagnosis.verdict.decision import remaining_share, verdict_of
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet, equivalence_set, pairs_of
from winchkit.diagnosis.verdict.fit_statistics import fit_statistics
from winchkit.diagnosis.verdict.laws import simplified
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.term import Term
from winchkit.model.stages import Stage
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

__all__ = [
    "RobotAnswer",
    "RobotSelection",
    "answer_of",
    "diagnose_robot",
]

_LEAST_FALL, _LARGEST_RATIO = 0.7, 1.1
"""Residuals beside a free geometry are shown where some error falls below the first ratio and none
rises above the second one."""


class RobotAnswer(Answer):
    """A diagnosis of a robot's poses with everything that it was derived from.

    Parameters
    ----------
    selection
        Selection and judgement.
    sets
        Equivalence set of every addition.
    diagnosis
        What is printed.
    """

    engine: PoseSelection

    def __init__(
        self, selection: RobotSelection, sets: Sequence[EquivalenceSet], diagnosis: RobotDiagnosis
    ) -> None:
        super().__init__(selection.engine, selection.result, diagnosis, sets)
        self.selection = selection

    @property
    def file_engine(self) -> PoseSelection:
        """Engine with the geometry at its file values."""
        return self.selection.file_engine


@dataclass(frozen=True)
class RobotSelection:
    """A selection on poses and its verdict.

    Attributes
    ----------
    preparation : Preparation
        Data, candidates and noise.
    engine : PoseSelection
        Engine of the selection.
    file_engine : PoseSelection
        Engine with the geometry of the file; the same object where the geometry was not free.
    result : SelectionResult
        Result of the selection, with the simplest laws.
    """

    preparation: Preparation
    engine: PoseSelection
    file_engine: PoseSelection
    result: SelectionResult

    @classmethod
    def of(
        cls, preparation: Preparation, engine: PoseSelection, file_engine: PoseSelection
    ) -> RobotSelection:
        """Search with an engine."""
        result = stepwise_selection(engine)
        final, noise = simplified(engine, result.final, result.noise)
        return cls(preparation, engine, file_engine, replace(result, final=final, noise=noise))

    @cached_property
    def outputs(self) -> dict[str, OutputFit]:
        """Errors of every output before and after."""
        return output_fits_of(self.initial_model, self.final, self.preparation.noise)

    @property
    def n_added(self) -> int:
        """Number of effects that the selection added."""
        return len(self.result.final.hypothesis.terms) - self.engine.n_initial_terms

    @property
    def verdict(self) -> Verdict:
        """Verdict on the errors; the noise is that of repeats or of the instruments."""
        refitted = self.geometry_is_free or bool(self.preparation.found)
        return verdict_of(
            self.outputs,
            steps=self.n_added + refitted,
            noise_known=True,
            deciding=self.outputs,
            refuted=(),
            predictable=lambda: True,
        )

    @property
    def geometry_is_free(self) -> bool:
        """Whether the geometry was fitted instead of taken from the file."""
        return self.engine is not self.file_engine

    @cached_property
    def initial_model(self) -> FittedModel:
        """The profile's own effects fitted, with the geometry of the file."""
        start = self.file_engine.initial_model
        for index in reversed(self.preparation.found):
            start = start.without(index)
        first, noise = self.file_engine.fit_with_noise(start)
        return FittedModel(
            self.file_engine.regression, first, noise, self.file_engine.regression.groups
        )

    @cached_property
    def final(self) -> FittedModel:
        """The model with all named effects."""
        result, engine = self.result, self.engine
        return FittedModel(engine.regression, result.final, result.noise, engine.regression.groups)

    @cached_property
    def errors(self) -> tuple[Errors, Errors]:
        """Errors of both models at every pose, SI."""
        initial_model, final = (
            errors_of(s.regression, s.regression.at(s.fit.hypothesis))
            for s in (self.initial_model, self.final)
        )
        return initial_model, final

    @property
    def rest(self) -> tuple[PoseRegression, Errors]:
        """Model and errors in which to look for a pattern of the unexplained residual.

        With the geometry of the file, unless that is far off: a free geometry that explains little
        has been fitted to the missing effect.
        """
        before, after = self.errors
        ratios = [rms(name, after[name]) / rms(name, before[name]) for name in after]
        if self.geometry_is_free and (min(ratios) > _LEAST_FALL or max(ratios) > _LARGEST_RATIO):
            return self.initial_model.regression, before
        return self.final.regression, after


def answer_of(selection: RobotSelection, geometry: str) -> RobotAnswer:
    """Diagnosis of a selection.

    Parameters
    ----------
    selection
        Selection and judgement.
    geometry
        How the geometry was taken: ``file`` or ``refitted``.
    """
    engine, preparation = selection.engine, selection.preparation
    result, outputs = selection.result, selection.outputs
    added = range(engine.n_initial_terms, len(result.final.hypothesis.terms))
    sets = [equivalence_set(engine, result.final, result.noise, index) for index in added]
    steps = tuple(_steps(selection, sets)) if sets else ()
    if selection.geometry_is_free and selection.verdict in ("adequate", "explained"):
        steps = (_geometry_step(engine, result, outputs["cable_length"]), *steps)
    if preparation.found:
        steps = (*_registered_steps(selection, outputs), *steps)
    diagnosis = RobotDiagnosis(
        verdict=selection.verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, result),
        detectable=detectable(
            result.scores, DetectionThreshold(engine.penalty_per_parameter, result.threshold)
        ),
        unexplained_share=remaining_share(outputs),
        where=_places(selection) if result.lack_of_fit else (),
        next_runs=next_pose_runs(engine.regression, result.final.hypothesis, pairs_of(sets)),
        notes=(
            *preparation.dataset.notes,
            *missing_pose_excitation(preparation),
            *_datum_notes(steps),
        ),
        geometry=geometry,
        fit=fit_statistics(
            engine.regression,
            result.initial_model,
            result.final,
            result.noise,
            spread_of(engine.regression, result.final, result.noise, engine.regression.blocks),
        ),
        traces=_traces(selection, named=bool(steps)),
    )
    return RobotAnswer(selection, sets, diagnosis)


def _steps(selection: RobotSelection, sets: Sequence[EquivalenceSet]) -> Iterator[Step]:
    """Every addition with its share and doubts; no free curve is compared with its law."""
    engine, result = selection.engine, selection.result
    final, noise, folds = result.final, result.noise, engine.regression.groups
    for place, step in enumerate(map(plain_step, steps_of(engine, result, sets))):
        index = engine.n_initial_terms + place
        without = engine.refit(final.hypothesis.without(index), noise)
        errors = engine.held_out_errors(without, noise, folds)
        standing = standing_of(
            errors, selection.outputs, final.hypothesis.terms[index].effect.outputs
        )
        yield with_standing(engine, result, step, index=index, standing=standing)


def _traces(selection: RobotSelection, *, named: bool) -> tuple[PoseTrace, ...]:
    """Errors of every pose; by the profile too where effects were named."""
    before, after = selection.errors
    names = column_names(selection.preparation.dataset, before)
    return pose_traces(names, UNITS, *((after, before) if named else (before,)))


_SAME_AS = {
    "tracker-frame": "all exit points and the home pose moved together the other way",
    "reflector-offset": "all anchor points and the home pose moved together the other way",
}


def _datum_notes(steps: Sequence[Step]) -> list[str]:
    """The datum by which a named frame or offset is no effect of the robot, in words."""
    named = {effect for step in steps for effect in step.effects}
    return [
        f"{effect}: datum is the robot's home pose with its points; {same} are the same to all "
        "measurements. Fixed points of the frame or the platform, measured with the tracker, "
        "distinguish the two"
        for effect, same in _SAME_AS.items()
        if effect in named
    ]


def _registered_steps(
    selection: RobotSelection, outputs: Mapping[str, OutputFit]
) -> tuple[Step, ...]:
    """Effects of the tracker that were registered before the selection, as additions."""
    engine, reported = selection.engine, selection.result
    spread = spread_of(engine.regression, reported.final, reported.noise, engine.regression.blocks)
    own = estimates(engine.regression, reported.final, spread)
    output = outputs.get("platform_position", outputs["cable_length"])
    before, after = output.heldout_rms_before, output.heldout_rms_after
    gain = 1 - (after / before) ** 2 if before else 0.0
    return tuple(
        Step((term.effect.id,), {term.effect.id: values}, gain)
        for term, values in (own[index] for index in selection.preparation.found)
    )


def _places(selection: RobotSelection) -> tuple[Attribution, ...]:
    """Variables that explain the unexplained residual, the largest share first."""
    places = pose_attributions(*selection.rest)
    return tuple(sorted(places, key=lambda w: -w.share)[:MOST_PLACES])


def _geometry_step(engine: PoseSelection, reported: SelectionResult, output: OutputFit) -> Step:
    """The whole geometry as one addition."""
    regression = engine.regression
    geometry = regression.point.geometry
    std = spread_of(regression, reported.final, reported.noise, engine.regression.blocks).std
    first = regression.nuisance_columns.shape[1] - len(geometry)
    values: dict[str, dict[str, Estimate]] = {}
    for index, item in enumerate(geometry):
        by = reported.final.vector[first + index]
        unit = item.term.effect.parameter(item.parameter).unit
        values.setdefault(item.term.effect.id, {})[item.parameter] = Estimate(
            item.value + float(by) * item.std, float(std[first + index]) * item.std, unit
        )
    before, after = output.heldout_rms_before, output.heldout_rms_after
    gain = 1 - (after / before) ** 2 if before else 0.0
    present = {name.partition("/")[0] for name in values}
    return Step(tuple(name for name in GEOMETRY if name in present), values, gain, whole=True)


_GEOMETRY_LEVEL = 1e-3
_SINGLE_EFFECT_SHARE = 0.4
_FEW_EFFECTS = 4


def diagnose_robot(
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
    progress: ProgressCallback = no_progress,
) -> RobotAnswer:
    """Find the effects that a robot's model lacks on its poses.

    Parameters
    ----------
    runs
        Poses.
    profile
        The robot.
    catalogue
        Effects; by default all that are installed.
    progress
        Called with the present step and the share of the work done, 0 to 1.

    Returns
    -------
    RobotAnswer
        The diagnosis with everything that it was derived from.

    Raises
    ------
    RunError
        With every fault of every run.
    FileError
        For effects that do not bind.
    """
    progress("estimating the noise", 0.0)
    preparation = prepare_selection(runs, profile, catalogue or load_catalogue())
    progress("searching", 0.4)
    if calibrated_on(profile, runs):
        engine = preparation.free_geometry()
        return _concluded(preparation, engine, engine)
    file_engine = preparation.file_geometry()
    if _geometry_explains_far_more(preparation, file_engine):
        return _concluded(preparation, preparation.free_geometry(), file_engine)
    found = RobotSelection.of(preparation, file_engine, file_engine)
    if found.n_added:
        # Poses estimated from inconsistent cable lengths are tilted, which unbalances tensions.
        added = found.result.final.hypothesis.terms[file_engine.n_initial_terms :]
        file_engine = preparation.file_geometry(_inconsistent(added))
        found = RobotSelection.of(preparation, file_engine, file_engine)
    if found.verdict in ("adequate", "explained") and not _geometry_is_off(
        preparation, file_engine, found.result
    ):
        return answer_of(found, "file")
    return _concluded(preparation, preparation.free_geometry(), file_engine)


def _inconsistent(added: Sequence[Term]) -> tuple[Term, ...]:
    """Effects of the tracker and the first other effect, beside which poses are estimated again."""
    tracker = [term for term in added if term.effect.stage is Stage.TRACKER]
    others = [term for term in added if term.effect.stage is not Stage.TRACKER]
    return (*tracker, *others[:1])


def _geometry_explains_far_more(preparation: Preparation, file_engine: PoseSelection) -> bool:
    """Whether the whole geometry explains far more χ² than any single effect, or a significant part
    of it beside the few that explain most in turn."""
    present, noise = file_engine.fit_with_noise(file_engine.initial_model)
    for _ in range(_FEW_EFFECTS):
        gain = _gain_of_geometry(preparation, file_engine, present.hypothesis, noise)
        if not _is_significant(preparation, gain):
            return False
        scores = file_engine.scores(present, noise)
        best = max(scores, key=lambda s: s.explained_ss, default=None)
        if best is None or best.explained_ss < _SINGLE_EFFECT_SHARE * gain:
            return True
        present = file_engine.trial(present, best, noise).fit
    return _is_significant(
        preparation, _gain_of_geometry(preparation, file_engine, present.hypothesis, noise)
    )


def _gain_of_geometry(
    preparation: Preparation, file_engine: PoseSelection, model: Hypothesis, noise: Noise
) -> float:
    """Decrease of χ² by a free geometry, beyond its calibration's uncertainty."""
    point = file_engine.regression.point
    free = regression_at(replace(point, geometry=_from(preparation.prior, point.geometry)))
    hypothesis = replace(model, nuisances=())
    chi_square = [
        fit(regression, hypothesis, noise.inverse_sigma(regression)).chi_square
        for regression in (file_engine.regression, free)
    ]
    return chi_square[0] - chi_square[1]


def _concluded(
    preparation: Preparation, engine: PoseSelection, file_engine: PoseSelection
) -> RobotAnswer:
    """Answer with the geometry free."""
    return answer_of(RobotSelection.of(preparation, engine, file_engine), "refitted")


def _geometry_is_off(
    preparation: Preparation, file_engine: PoseSelection, result: SelectionResult
) -> bool:
    """Whether the whole geometry explains a significant part of the remaining residual."""
    return _is_significant(
        preparation,
        _gain_of_geometry(preparation, file_engine, result.final.hypothesis, result.noise),
    )


def _is_significant(preparation: Preparation, gain: float) -> bool:
    """F test of the decrease of χ² by the geometry.

    F = (Δχ²/k)/1 with k numbers of the geometry and the degrees of freedom of the noise; level 0.1
    %.
    """
    count = len(preparation.prior)
    dof = preparation.noise.dof.get("cable_length", 1.0)
    level = float(fdtri(count, max(dof, 1.0), 1 - _GEOMETRY_LEVEL))
    return gain / count > level


def _from(
    prior: Sequence[GeometryPrior], now: Sequence[GeometryPrior]
) -> tuple[GeometryPrior, ...]:
    """Priors with their mean at the present values."""
    there = {(b.term.effect.id, b.parameter): b.value for b in now}
    out = []
    for item in prior:
        value = there.get((item.term.effect.id, item.parameter), 0.0)
        out.append(replace(item.moved(value / item.std), at=value))
    return tuple(out)
