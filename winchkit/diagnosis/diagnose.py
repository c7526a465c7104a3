"""Diagnosis of a winch: data, stepwise selection, verdict and the next motion programmes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import overload

from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.sanity import caveats, unrelated
from winchkit.diagnosis.design.detectability import DetectionThreshold, detectable
from winchkit.diagnosis.design.discrimination import next_runs, weights_of
from winchkit.diagnosis.design.excitation import missing_excitation
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.profiles import Profile, of_wing, require_winch
from winchkit.diagnosis.regression.cross_validation import CERTAIN, excess
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import Spread, spread_of
from winchkit.diagnosis.regression.run_offsets import run_offsets
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import (
    MOST_PLACES,
    Attribution,
    attributions,
    harmonics,
)
from winchkit.diagnosis.residuals.findings import findings
from winchkit.diagnosis.residuals.traces import OutputTrace, trace_columns, traces_of
from winchkit.diagnosis.results import CandidateScore, Diagnosis, NextRun, OutputFit, Step
from winchkit.diagnosis.search import (
    ProgressCallback,
    no_progress,
    search,
    selection_engine,
)
from winchkit.diagnosis.selection.contribution import ordered_by_contribution
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import (
    SelectionResult,
    initial_result,
)
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.selection.transitions import (
    with_fitted_transitions,
    with_rounded_reversals,
)
from winchkit.diagnosis.selection.weighting import reweighted
from winchkit.diagnosis.steps import (
    Standing,
    candidates_of,
    is_small,
    standing_of,
    steps_of,
    with_dependences,
    with_standing,
)
from winchkit.diagnosis.verdict.compensation import with_compensations
from winchkit.diagnosis.verdict.decision import (
    MOSTLY,
    OutputEvidence,
    measured,
    output_fits,
    remaining_share,
    verdict_of,
)
from winchkit.diagnosis.verdict.equivalence import (
    EquivalenceSet,
    equivalence_set,
    pairs_of,
    with_first_members,
)
from winchkit.diagnosis.verdict.fit_statistics import fit_statistics
from winchkit.diagnosis.verdict.laws import with_simpler_law
from winchkit.diagnosis.verdict.open_law import (
    open_law,
    predictable_share,
)
from winchkit.diagnosis.verdict.profile_values import file_model, refitted_steps
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.linear_axis import catalogue_of
from winchkit.effects.term import Term
from winchkit.rendering import Plotted
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.tabular import Columns, Tabular

_PREDICTED = 0.1
"""Share of a residual that a curve or an order must predict for it to be a missing effect."""
_REPEAT = "record the same motion again: without repeats the noise is not known"
_VARY = "record a motion in which an output varies by more than its noise: in these runs none does"


class Answer(Plotted, Tabular):
    """A diagnosis with everything that it was derived from, for reports and plans.

    Parameters
    ----------
    engine
        Engine of the last selection.
    result
        Result of the selection, without withheld additions.
    diagnosis
        What is printed.
    sets
        Equivalence set of every addition.
    pairs
        Effects that a next run should distinguish.
    """

    engine: SelectionEngine

    def __init__(
        self,
        engine: SelectionEngine,
        result: SelectionResult,
        diagnosis: Diagnosis,
        sets: Sequence[EquivalenceSet] = (),
        pairs: Sequence[tuple[Term, Term]] = (),
    ) -> None:
        self.engine = engine
        self.result = result
        self.diagnosis = diagnosis
        self.sets = tuple(sets)
        self.pairs = tuple(pairs)

    def fit_report(self) -> str:
        """Return the report of the fit; see :meth:`Diagnosis.fit_report`."""
        return self.diagnosis.fit_report()

    def _columns(self) -> Columns:
        return trace_columns(self.diagnosis.traces)

    @property
    def threshold(self) -> DetectionThreshold:
        """Reduction of χ² that an effect needs to be named."""
        return DetectionThreshold(self.engine.penalty_per_parameter, self.result.threshold)

    @property
    def file_engine(self) -> SelectionEngine:
        """Engine with the profile at its file values; a robot's geometry may be free later."""
        return self.engine


class WinchAnswer(Answer):
    """A diagnosis of a winch's runs with everything that it was derived from."""

    engine: TimeSeriesSelection

    def __init__(
        self,
        engine: TimeSeriesSelection,
        result: SelectionResult,
        diagnosis: Diagnosis,
        sets: Sequence[EquivalenceSet] = (),
        pairs: Sequence[tuple[Term, Term]] = (),
    ) -> None:
        super().__init__(engine, result, diagnosis, sets, pairs)


@overload
def diagnose(
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    decimate: bool = True,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> WinchAnswer: ...


@overload
def diagnose(
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    decimate: bool = True,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> Answer: ...


def diagnose(
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    decimate: bool = True,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> Answer:
    """Find the effects that a profile lacks on its runs.

    Parameters
    ----------
    runs
        Recorded runs; of a robot with motor angles and measured poses.
    profile
        The winch, or the robot: the options below ``band`` are of winches, except ``progress``.
    catalogue
        Effects; by default all that are installed.
    band
        Cut-off frequency of the torque's low-pass filter, Hz; by default chosen from the sampling.
    decimate
        Decimate long runs as far as their signals allow.
    as_recorded
        Look for effects although a sign or unit looks wrong.
    progress
        Called with the present step and the share of the work done, 0 to 1. How many candidates
        will be fitted is not known: the share approaches that of the step as they are.
    interrupted
        Called when a KeyboardInterrupt ends the search, with the errors of the profile and the
        scores of the candidates, and before the exception goes on.

    Returns
    -------
    Answer
        The diagnosis with everything that it was derived from; a WinchAnswer of a winch.

    Raises
    ------
    RunError
        With every fault of every run.
    FileError
        For effects that do not bind.
    UsageError
        For a band with a robot.
    """
    if (by_wing := of_wing("diagnose", profile, band)) is not None:
        found: Answer = by_wing(runs, profile, catalogue, progress)
        return found
    profile = require_winch(profile)
    catalogue = catalogue or load_catalogue()
    progress("reading the signals", 0.0)
    dataset = prepare(runs, profile, band, decimate=decimate, fast=True, catalogue=catalogue)
    return diagnose_prepared(
        dataset, catalogue, as_recorded=as_recorded, progress=progress, interrupted=interrupted
    )


def diagnose_prepared(
    dataset: Dataset,
    catalogue: Catalogue,
    *,
    as_recorded: bool = False,
    progress: ProgressCallback = no_progress,
    interrupted: Callable[[WinchAnswer], None] | None = None,
) -> WinchAnswer:
    """The same as :func:`diagnose` on a prepared data set."""
    progress("testing which effects fit", 0.1)
    catalogue = catalogue_of(dataset.profile, catalogue)
    engine = selection_engine(dataset, catalogue)
    if caveats(dataset.sanity) and not as_recorded:
        return _unsearched(engine)
    file = engine.initial_model
    known: list[SelectionResult] = []
    try:
        engine, result = search(engine, catalogue, progress, known.append)
        return _answer(engine, _unless_at_noise(engine, result), file)
    except KeyboardInterrupt:
        if interrupted is not None and known:
            interrupted(_known_at_interrupt(engine, known[0]))
        raise


def _unless_at_noise(engine: TimeSeriesSelection, result: SelectionResult) -> SelectionResult:
    """The result; without additions where no output that they change is above repeats' noise."""
    if not result.noise.from_repeats:
        return result
    before = (result.initial_model, result.initial_noise)
    outputs = output_fits(engine, before, before)
    added = [term.effect for term in result.final.hypothesis.terms[engine.n_initial_terms :]]
    own = {str(name) for effect in added for name in effect.outputs} & set(outputs)
    noise = {name: outputs[name].noise_rms for name in own}
    if excess({name: outputs[name].heldout_rms_after for name in own}, noise) > 0.0:
        return result
    return replace(result, final=before[0], noise=before[1])


def _known_at_interrupt(engine: TimeSeriesSelection, start: SelectionResult) -> WinchAnswer:
    """Errors of the profile and scores of the candidates, without a verdict."""
    start = _by_file(engine, start)
    scores = candidates_of(engine, start)
    return _without_steps(engine, start, float("nan"), candidates=scores, interrupted=True)


def _unsearched(engine: TimeSeriesSelection) -> WinchAnswer:
    """Verdict ``unknown`` for runs with a wrong sign or unit: no effect must explain that."""
    return _without_steps(engine, _by_file(engine, initial_result(engine)), 1.0)


def _without_steps(
    engine: TimeSeriesSelection,
    result: SelectionResult,
    unexplained_share: float,
    *,
    candidates: tuple[CandidateScore, ...] = (),
    interrupted: bool = False,
) -> WinchAnswer:
    """Errors of the profile alone."""
    dataset, model = engine.regression.dataset, (result.initial_model, result.initial_noise)
    diagnosis = Diagnosis(
        verdict="unknown",
        outputs=output_fits(engine, model, model),
        steps=(),
        candidates=candidates,
        detectable=(),
        unexplained_share=unexplained_share,
        where=(),
        next_runs=(),
        notes=dataset.notes,
        sanity=dataset.sanity,
        used_share=dataset.used_share,
        removed=dataset.removed,
        caveats=dataset.caveats,
        interrupted=interrupted,
        traces=_traces(engine, result, named=False),
    )
    return WinchAnswer(engine, result, in_units_of(dataset.profile, diagnosis))


def _by_file(engine: TimeSeriesSelection, result: SelectionResult) -> SelectionResult:
    """A result with the errors of the file's values: refitted ones would imitate a wrong factor."""
    own = file_model(engine, engine.initial_model, result.initial_noise)
    return replace(result, initial_model=own)


def _answer(engine: TimeSeriesSelection, result: SelectionResult, file: Hypothesis) -> WinchAnswer:
    """Steps of the final model with their doubts, the verdict, and the next programmes; ``file``
    has the profile's effects at their file values.
    """
    regression, dataset = engine.regression, engine.regression.dataset
    best = reweighted(engine, result.final, result.noise)
    found = replace(result, final=best.fit, noise=best.noise)
    found = ordered_by_contribution(engine, found)
    final, noise = found.final, found.noise
    added = range(engine.n_initial_terms, len(final.hypothesis.terms))
    sets = [equivalence_set(engine, final, noise, index) for index in added]
    final, sets = with_first_members(engine, final, noise, sets)
    final = with_fitted_transitions(engine, final, noise)
    if not final.converged:
        final = engine.refit(final.hypothesis, noise)
    found = replace(found, initial_model=file_model(engine, file, noise), final=final)
    outputs = output_fits(engine, (found.initial_model, noise), (final, noise))
    size = {name: output.noise_rms for name, output in outputs.items()}
    spread = _spread(engine, found)
    known = measured(regression, found.initial_model, final, noise, outputs)
    steps = (
        *refitted_steps(engine, found, file, outputs, spread),
        *_steps(engine, found, sets, outputs, known=known, spread=spread),
    )
    steps = with_compensations(engine, found, file, with_dependences(engine, found, steps))
    where = _where(regression, found)
    verdict = verdict_of(
        outputs,
        steps=len(steps),
        noise_known=noise.from_repeats,
        deciding=known.deciding,
        refuted=known.refuted,
        predictable=lambda: (
            any(w.order is not None and w.share >= _PREDICTED for w in where)
            or predictable_share(engine, final, noise, size) >= _PREDICTED
        ),
    )
    pairs = pairs_of(sets)
    advice = NextRun((), _VARY if noise.from_repeats else _REPEAT)
    repeat = [advice] if verdict == "undecided" else []
    lost = sorted(known.refuted - known.deciding) if noise.from_repeats else []
    late = findings(regression, verdict, found.initial_model.residual, final.residual)
    diagnosis = Diagnosis(
        verdict=verdict,
        outputs=outputs,
        steps=steps,
        candidates=candidates_of(engine, found),
        detectable=detectable(
            result.scores, DetectionThreshold(engine.penalty_per_parameter, result.threshold)
        ),
        unexplained_share=0.0
        if verdict == "adequate"
        else remaining_share(
            {name: output for name, output in outputs.items() if name in known.deciding}
        ),
        where=where if verdict != "adequate" else (),
        next_runs=(*repeat, *next_runs(regression, pairs, weights_of(regression, noise))),
        notes=(*dataset.notes, *missing_excitation(regression), *best.notes),
        sanity=(*dataset.sanity, *unrelated(lost), *late),
        used_share=dataset.used_share,
        removed=dataset.removed,
        caveats=dataset.caveats,
        fit=fit_statistics(
            regression, found.initial_model, final, noise, spread, profile=dataset.profile
        ),
        traces=_traces(engine, found, named=bool(steps)),
        run_offsets=run_offsets(regression, final, spread),
    )
    return WinchAnswer(engine, found, in_units_of(dataset.profile, diagnosis), sets, pairs)


def _steps(
    engine: TimeSeriesSelection,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    outputs: Mapping[str, OutputFit],
    *,
    known: OutputEvidence,
    spread: Spread,
) -> Iterator[Step]:
    """Every addition with its share, law and doubts."""
    if not sets:
        return
    final, noise = result.final, result.noise
    folds, first = engine.folds(final, noise), engine.n_initial_terms
    known_to = noise.uncertainty(engine.regression) if noise.from_repeats else None
    standings: list[Standing] = []
    counted = {name: output for name, output in outputs.items() if name in known.deciding}
    mostly = remaining_share(counted) <= MOSTLY
    acts = [frozenset(term.effect.outputs) for term in final.hypothesis.terms[first:]]
    for place, own in enumerate(acts):
        without = engine.refit(final.hypothesis.without(first + place), noise)
        errors = engine.held_out_errors(without, noise, folds)
        # The torque has every error of the tension: what is left there may be the cause of both.
        upstream = {"tension"} if own == {"motor_torque"} else set[str]()
        trusted = mostly and bool(known.deciding & own) and not known.refuted & own
        standing = standing_of(
            errors, outputs, sorted(own | upstream), trusted=trusted, spread=known_to
        )
        rounded = _rounded_law(engine, result, first + place, outputs, standing)
        standings.append(replace(standing, rounded=rounded))
    steps = steps_of(
        engine, result, sets, dataset=engine.regression.dataset, spread=spread, outputs=outputs
    )
    for place, step in enumerate(steps):
        before = [steps[other] for other in range(place) if acts[other] & acts[place]]
        yield with_standing(
            engine,
            result,
            step,
            index=first + place,
            standing=standings[place],
            curve=open_law(engine, final, noise, first + place),
            small=is_small(step, before),
        )


def _rounded_law(
    engine: TimeSeriesSelection,
    result: SelectionResult,
    index: int,
    outputs: Mapping[str, OutputFit],
    standing: Standing,
) -> str:
    """Simpler law that explains all but a tenth, a friction's with a rounded reversal, or none. How
    a reversal looks is a nuisance: a drive's filter rounds it as well.
    """
    effect = result.final.hypothesis.terms[index].effect
    if not effect.reduces_to:
        return ""
    noise, folds = result.noise, engine.folds(result.final, result.noise)
    simpler = with_rounded_reversals(
        engine, with_simpler_law(engine, result.final, noise, index), noise
    )
    size = {name: output.noise_rms for name, output in outputs.items()}
    after = {name: output.heldout_rms_after for name, output in outputs.items()}
    lost = excess(engine.held_out_errors(simpler, noise, folds), size) - excess(after, size)
    if lost >= CERTAIN * standing.explained:
        return ""
    names = [term.effect.id for term in simpler.hypothesis.terms]
    return next((name for name in effect.reduces_to if name in names), "")


def _traces(
    engine: TimeSeriesSelection, result: SelectionResult, *, named: bool
) -> tuple[OutputTrace, ...]:
    """Measured and predicted outputs; by the profile too where effects were named."""
    before = result.initial_model.residual
    if not named:
        return traces_of(engine.regression, before)
    return traces_of(engine.regression, result.final.residual, before)


def _spread(engine: SelectionEngine, result: SelectionResult) -> Spread:
    """Uncertainty of the unknowns of the final model."""
    return spread_of(engine.regression, result.final, result.noise, engine.regression.blocks)


def _where(regression: TimeSeriesRegression, result: SelectionResult) -> tuple[Attribution, ...]:
    """Variables and orders with the largest shares of the final model's residual."""
    residual = result.final.residual
    out = [*harmonics(regression, residual), *attributions(regression, residual)]
    return tuple(sorted(out, key=lambda w: -w.share)[:MOST_PLACES])
