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
from itertools import pairwise
from typing import ClassVar

import numpy as np

from winchkit.arguments import ProgressCallback, no_progress
from winchkit.diagnosis.design.detectability import DetectionThreshold, detectable
from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.regression.cross_validation import AT_NOISE, excess
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import held
from winchkit.diagnosis.regression.intervals import estimates
from winchkit.diagnosis.residuals.attribution import MOST_PLACES, Attribution
from winchkit.diagnosis.residuals.traces import PoseTrace, pose_traces
from winchkit.diagnosis.results import (
    Doubt,
    Estimate,
    NextRun,
    OutputFit,
    Place,
    RobotDiagnosis,
    Step,
    Verdict,
    plain_step,
)
from winchkit.diagnosis.selection.stepwise import (
    SelectionResult,
    initial_result,
    stepwise_selection,
)
from winchkit.diagnosis.steps import Standing, candidates_of, standing_of, steps_of, with_standing
from winchkit.diagnosis.verdict.decision import remaining_share, verdict_of
from winchkit.diagnosis.verdict.equivalence import (
    EquivalenceSet,
    equivalence_set,
    pairs_of,
    with_first_members,
)
from winchkit.diagnosis.verdict.fit_statistics import fit_statistics
from winchkit.diagnosis.verdict.laws import simplified
from winchkit.diagnosis.verdict.profile_values import refitted_steps
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.term import Term
from winchkit.model.stages import Stage
from winchkit.robot.diagnosis.adjustment import GEOMETRY
from winchkit.robot.diagnosis.attribution import pose_attributions
from winchkit.robot.diagnosis.engine import PoseSelection
from winchkit.robot.diagnosis.errors import (
    UNITS,
    Errors,
    FittedModel,
    column_names,
    errors_in_noise,
    output_fits_in_noise,
    output_fits_of,
    refuted_outputs,
    rms,
)
from winchkit.robot.diagnosis.home import with_home_doubt
from winchkit.robot.diagnosis.pose_design import next_pose_runs
from winchkit.robot.diagnosis.preparation import (
    Preparation,
    calibrated_on,
    missing_pose_excitation,
    own_effects,
    prepare_selection,
)
from winchkit.robot.diagnosis.registration import datum_notes
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile

_REPEAT = "drive to some ten of these poses twice: the noise of the instruments is not known"
_WHOLE = "numbers of the geometry together may fit another cause that depends on the pose"
_LEAST_FALL, _LARGEST_RATIO = 0.7, 1.1
"""Residuals beside a free geometry are shown where some error falls below the first ratio and none
rises above the second one."""


class RobotAnswer(Answer):
    """A diagnosis of a robot's poses with everything that it was derived from."""

    wing: ClassVar[str] = "robot"

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
    """A selection on poses and its verdict."""

    preparation: Preparation
    """Data, candidates and noise."""
    engine: PoseSelection
    """Engine of the selection."""
    file_engine: PoseSelection
    """Engine with the geometry of the file; the same object where the geometry was not free."""
    result: SelectionResult
    """Result of the selection, with the simplest laws."""

    @classmethod
    def of_geometry(cls, preparation: Preparation, file_engine: PoseSelection) -> RobotSelection:
        """The geometry free, and no search: beside a wrong one an effect may imitate it."""
        engine = preparation.free_geometry()
        return cls(preparation, engine, file_engine, initial_result(engine))

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

    @cached_property
    def in_noise(self) -> dict[str, OutputFit]:
        """Errors of every kind of equation before and after, in units of the noise."""
        return output_fits_in_noise(self.initial_model, self.final, self.preparation.noise)

    @property
    def remaining(self) -> float:
        """Share of the excess over the noise that the final model leaves."""
        return remaining_share(self.in_noise)

    @cached_property
    def refuted(self) -> set[str]:
        """Outputs that their mean over the poses predicts better than the final model."""
        return refuted_outputs(self.final)

    @cached_property
    def deciding(self) -> set[str]:
        """Kinds of equations of which the measured output varies by more than its noise."""
        return {
            name
            for name in self.in_noise
            if not self.outputs[name].signal_rms <= AT_NOISE * (self.outputs[name].noise_rms or 0.0)
        }

    @cached_property
    def verdict(self) -> Verdict:
        """Verdict on the errors in units of the noise."""
        return verdict_of(
            self.in_noise,
            steps=self.n_added
            + len(self.refitted)
            + len(self.preparation.found)
            + self.geometry_is_free,
            noise_known=self.preparation.noise.from_repeats,
            deciding=self.deciding,
            refuted=self.refuted,
            predictable=lambda: any(w.share >= _TENTH for w in _places(self)),
        )

    @cached_property
    def refitted(self) -> tuple[Step, ...]:
        """Effects of the profile whose file values predict worse than fitted ones."""
        file = own_effects(self.preparation.of_file)
        steps = refitted_steps(self.engine, self.result, file, self.in_noise, self.final.spread)
        return tuple(map(plain_step, steps)) if file.terms else ()

    @property
    def geometry_is_free(self) -> bool:
        """Whether the geometry was fitted instead of taken from the file."""
        return self.engine is not self.file_engine

    @cached_property
    def initial_model(self) -> FittedModel:
        """The profile's own effects at their file values, with the geometry of the file."""
        start = self.file_engine.initial_model
        for index in reversed(self.preparation.found):
            start = start.without(index)
        for index, term in enumerate(self.preparation.of_file):
            start = start.with_term_at(index, held(term))
        first, noise = self.file_engine.fit_with_noise(start)
        return FittedModel(self.file_engine.regression, first, noise)

    @cached_property
    def final(self) -> FittedModel:
        """The model with all named effects."""
        return FittedModel(self.engine.regression, self.result.final, self.result.noise)

    def explained(self, steps: Sequence[int]) -> list[float]:
        """Share of the excess that each of these terms explains beside those before it and what is
        always fitted: where a frame and a reflector far off explain the same, neither explains much
        beside the other."""
        noise = {name: output.noise_rms for name, output in self.in_noise.items()}
        before = {name: output.heldout_rms_before for name, output in self.in_noise.items()}
        part, whole = self.final.fit.hypothesis, excess(before, noise)
        if not whole > 0.0:
            return [float("nan")] * len(steps)
        models = [self.final]
        for index in reversed(steps):
            part = part.without(index)
            models.append(replace(self.final, fit=self.engine.refit(part, self.result.noise)))
        left = [excess(errors_in_noise(model), noise) for model in reversed(models)]
        return [float(np.clip((b - a) / whole, 0.0, 1.0)) for b, a in pairwise(left)]

    @property
    def errors(self) -> tuple[Errors, Errors]:
        """Errors of both models at every pose, SI."""
        return self.initial_model.errors, self.final.errors

    @property
    def rest(self) -> tuple[PoseRegression, Errors]:
        """Model and errors in which to look for a pattern of the unexplained residual: with the
        geometry of the file, unless that is far off, since a free geometry that explains little has
        been fitted to the missing effect."""
        before, after = self.errors
        ratios = [rms(name, after[name]) / rms(name, before[name]) for name in after]
        if self.geometry_is_free and (min(ratios) > _LEAST_FALL or max(ratios) > _LARGEST_RATIO):
            return self.initial_model.regression, before
        return self.final.regression, after


def answer_of(selection: RobotSelection, geometry: str) -> RobotAnswer:
    """Diagnosis of a selection."""
    engine, preparation = selection.engine, selection.preparation
    added = range(engine.n_initial_terms, len(selection.result.final.hypothesis.terms))
    final, noise = selection.result.final, selection.result.noise
    sets = [equivalence_set(engine, final, noise, index) for index in added]
    final, sets = with_first_members(engine, final, noise, sets)
    selection = replace(selection, result=replace(selection.result, final=final))
    result, outputs, verdict = selection.result, selection.outputs, selection.verdict
    in_turn = (*preparation.found, *added)
    explained = dict(zip(in_turn, selection.explained(in_turn), strict=True))
    steps = (
        *selection.refitted,
        *_registered_steps(selection, explained),
        *_geometry_steps(selection),
        *_steps(selection, sets, explained),
    )
    repeat = [NextRun((), _REPEAT)] if verdict == "undecided" else []
    diagnosis = RobotDiagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, result),
        detectable=detectable(
            result.scores, DetectionThreshold(engine.penalty_per_parameter, result.threshold)
        ),
        unexplained_share=selection.remaining,
        where=_places(selection) if verdict != "adequate" else (),
        next_runs=(*repeat, *next_pose_runs(engine.regression, final.hypothesis, pairs_of(sets))),
        notes=(
            *preparation.dataset.notes,
            *missing_pose_excitation(preparation),
            *datum_notes({effect for step in steps for effect in step.effects}),
        ),
        geometry=geometry,
        fit=fit_statistics(
            engine.regression,
            result.initial_model,
            result.final,
            result.noise,
            selection.final.spread,
        ),
        traces=_traces(selection, named=bool(steps)),
    )
    return RobotAnswer(selection, sets, diagnosis)


def _steps(
    selection: RobotSelection, sets: Sequence[EquivalenceSet], explained: Mapping[int, float]
) -> Iterator[Step]:
    """Every addition with its share and doubts."""
    engine, result = selection.engine, selection.result
    steps = steps_of(engine, result, sets) if sets else ()
    for index, step in enumerate(map(plain_step, steps), start=engine.n_initial_terms):
        yield _with_standing(selection, replace(step, explains=explained[index]), index)


def _with_standing(selection: RobotSelection, step: Step, index: int) -> Step:
    """A step with its share and doubts; no free curve is compared with its law."""
    engine, result = selection.engine, selection.result
    final, noise = result.final, result.noise
    without = replace(selection.final, fit=engine.refit(final.hypothesis.without(index), noise))
    standing = _standing(selection, without, final.hypothesis.terms[index].effect.outputs)
    step = with_standing(engine, result, step, index=index, standing=standing)
    return with_home_doubt(engine, selection.final, without, step, index)


def _standing(selection: RobotSelection, without: FittedModel, acts: Sequence[str]) -> Standing:
    """What the model without a step says of it; ``acts`` are the outputs of the step."""
    # The tensions of a hanging platform are among the equations of its lengths.
    own = [name for name in acts if name in selection.in_noise] or list(selection.in_noise)
    trusted = bool(selection.deciding.intersection(own)) and not selection.refuted
    return standing_of(errors_in_noise(without), selection.in_noise, own, trusted=trusted)


def _traces(selection: RobotSelection, *, named: bool) -> tuple[PoseTrace, ...]:
    """Errors of every pose; by the profile too where effects were named."""
    before, after = selection.errors
    names = column_names(selection.preparation.dataset, before)
    return pose_traces(names, UNITS, *((after, before) if named else (before,)))


def _registered_steps(selection: RobotSelection, explained: Mapping[int, float]) -> Iterator[Step]:
    """Effects of the tracker that were registered before the selection, as additions."""
    final, found = selection.final, selection.preparation.found
    own = estimates(final.regression, final.fit, final.spread)
    gain = _gain(selection.outputs)
    for index in found:
        term, values = own[index]
        place = tuple(Place(*at) for at in term.effect.place)
        step = Step(
            (term.effect.id,),
            {term.effect.id: values},
            gain,
            place=place,
            explains=explained[index],
        )
        yield _with_standing(selection, step, index)


def _gain(outputs: Mapping[str, OutputFit]) -> float:
    """Relative decrease of the held-out mean square of positions, or else of lengths."""
    output = outputs.get("platform_position", outputs["cable_length"])
    before, after = output.heldout_rms_before, output.heldout_rms_after
    return 1 - (after / before) ** 2 if before else 0.0


def _places(selection: RobotSelection) -> tuple[Attribution, ...]:
    """Variables that explain the unexplained residual, the largest share first."""
    places = pose_attributions(*selection.rest)
    return tuple(sorted(places, key=lambda w: -w.share)[:MOST_PLACES])


def _geometry_steps(selection: RobotSelection) -> Iterator[Step]:
    """The whole geometry as one addition, where it was fitted: its law is always open."""
    if not selection.geometry_is_free:
        return
    final, regression = selection.final, selection.engine.regression
    geometry, parameters = regression.point.geometry, regression.equations.parameters
    first = regression.nuisance_columns.shape[1] - len(geometry)
    values: dict[str, dict[str, Estimate]] = {}
    for column, number in enumerate(geometry, start=first):
        prior = float(parameters.std[number.index])
        change = (regression.point.state.values - parameters.nominal)[number.index]
        value = float(change) + float(final.fit.vector[column]) * prior
        own = values.setdefault(number.effect, {})
        own[number.parameter] = Estimate(value, float(final.spread.std[column]) * prior, "m")
    present = {name.partition("/")[0] for name in values}
    effects = tuple(name for name in GEOMETRY if name in present)
    of_file = selection.file_engine.regression
    beside = replace(final.fit.hypothesis, nuisances=())
    refitted = fit(of_file, beside, final.noise.inverse_sigma(of_file))
    without = replace(final, regression=of_file, fit=refitted)
    standing = _standing(selection, without, tuple(selection.in_noise))
    yield Step(
        effects,
        values,
        _gain(selection.outputs),
        whole=True,
        place=tuple(Place("frame", output, None) for output in selection.in_noise),
        law="open",
        share=standing.share,
        doubts=(Doubt("whole", f"{len(geometry)} {_WHOLE}"),),
    )


_SINGLE_EFFECT_SHARE = 0.4
"""Share of the geometry's explained χ² below which no single effect replaces it; rule of thumb."""
_FEW_EFFECTS = 4
"""Effects in turn beside which the whole geometry is tested before the search; rule of thumb: more
than a search names beside a right geometry."""
_EXPLAINING = ("adequate", "explained", "partly")
"""Verdicts with which a free geometry is reported: its many numbers lower any error a little."""
_TENTH = 0.1
"""Share of the excess that a free geometry must explain beyond the effects found without it, and
share of a residual that a variable must explain for it to be no noise: the tenth of the verdict."""


def diagnose(
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
    progress: ProgressCallback = no_progress,
) -> RobotAnswer:
    """Find the effects that a robot's model lacks on its poses."""
    progress("estimating the noise", 0.0)
    preparation = prepare_selection(runs, profile, catalogue or load_catalogue())
    progress("searching", 0.4)
    if calibrated_on(profile, runs):
        engine = preparation.free_geometry()
        return answer_of(RobotSelection.of(preparation, engine, engine), "refitted")
    file_engine = preparation.file_geometry()
    free: RobotSelection | None = None
    if _geometry_explains_far_more(preparation, file_engine):
        free = RobotSelection.of_geometry(preparation, file_engine)
        if free.verdict in _EXPLAINING:
            return answer_of(free, "refitted")
    found = RobotSelection.of(preparation, file_engine, file_engine)
    if found.n_added:
        # Poses estimated from inconsistent cable lengths are tilted, which unbalances tensions.
        added = found.result.final.hypothesis.terms[file_engine.n_initial_terms :]
        file_engine = preparation.file_geometry(_inconsistent(added))
        found = RobotSelection.of(preparation, file_engine, file_engine)
    if found.verdict in ("adequate", "explained") and not preparation.geometry_is_significant(
        preparation.gain_of_geometry(file_engine, found.result.final.hypothesis, found.result.noise)
    ):
        return answer_of(found, "file")
    free = free or RobotSelection.of_geometry(preparation, file_engine)
    if free.verdict in _EXPLAINING and found.remaining - free.remaining > _TENTH:
        return answer_of(free, "refitted")
    return answer_of(found, "file")


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
        gain = preparation.gain_of_geometry(file_engine, present.hypothesis, noise)
        if not preparation.geometry_is_significant(gain):
            return False
        scores = file_engine.scores(present, noise)
        best = max(scores, key=lambda s: s.explained_ss, default=None)
        if best is None or best.explained_ss < _SINGLE_EFFECT_SHARE * gain:
            return True
        present = file_engine.trial(present, best, noise).fit
    return preparation.geometry_is_significant(
        preparation.gain_of_geometry(file_engine, present.hypothesis, noise)
    )
