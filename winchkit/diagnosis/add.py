"""Add an effect to a winch's profile or remove one, refitted and compared by held-out error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from winchkit.arguments import require_type, require_types
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.sanity import ALARMING, require_drive
from winchkit.diagnosis.linear_axis import errors_in_units_of, in_units_of
from winchkit.diagnosis.profiles import Profile, of_wing, require_winch
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.exclusion import without_impacts
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import held
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import variables_of
from winchkit.diagnosis.results import Estimate, OutputFit
from winchkit.diagnosis.search import selection_engine, with_offsets_where_better
from winchkit.diagnosis.selection.orders import has_orders
from winchkit.diagnosis.selection.scores import Score, score
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.selection.transitions import scanned_transitions, with_fitted_transitions
from winchkit.diagnosis.selection.weighting import Reweighted, reweighted
from winchkit.diagnosis.verdict.decision import output_fits
from winchkit.diagnosis.verdict.profile_values import file_model
from winchkit.dynamics.refit import MotionFit, refit_to_motion
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.empirical import EMPIRICAL, placed, variable_of
from winchkit.effects.linear_axis import catalogue_of
from winchkit.effects.term import Term
from winchkit.effects.transition import with_transitions
from winchkit.errors import UsageError
from winchkit.quantity_text import quantity
from winchkit.rendering import Shown
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

_STARTS = 4
"""Grid points of the effect from which `add` begins a fit; computing cost, rule of thumb."""
_Fits = tuple[TimeSeriesSelection, tuple[Fit, BandNoise], tuple[Fit, BandNoise]]
"""Engine, and the fits before and after the addition, each with its noise."""


@dataclass(frozen=True, repr=False)
class Addition(Shown):
    """A profile's effects refitted with a new one, and the change of the errors.

    Attributes
    ----------
    outputs : mapping of str to OutputFit
        Errors per output before and after.
    terms : tuple
        Every effect with its estimates, the new one last.
    notes : tuple of str
        Notes on the data and the weights.
    motion : MotionFit, optional
        Errors of the simulated motion, to which the values were refitted.
    """

    outputs: Mapping[str, OutputFit]
    terms: tuple[tuple[Term, Mapping[str, Estimate]], ...]
    notes: tuple[str, ...] = ()
    motion: MotionFit | None = None

    @property
    def added(self) -> tuple[Term, Mapping[str, Estimate]]:
        """The new effect with its values."""
        return self.terms[-1]

    def to_json(self) -> dict[str, Any]:
        """JSON of ``winchkit add --json``."""
        found = fitted_json(self.added[0].effect.id, self.outputs, self.terms, self.notes)
        return found if self.motion is None else {**found, "motion": self.motion.to_json()}


def fitted_json(
    effect_id: str,
    outputs: Mapping[str, OutputFit],
    terms: Sequence[tuple[Term, Mapping[str, Estimate]]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """JSON of the change by one effect, for ``add`` and ``remove``."""
    kept = (
        "unit",
        "rms_before",
        "rms_after",
        "heldout_rms_before",
        "heldout_rms_after",
        "noise_rms",
        "noise_source",
    )
    return {
        "schema": 1,
        "effect": effect_id,
        "outputs": {o: {key: getattr(f, key) for key in kept} for o, f in outputs.items()},
        "parameters": {t.label: {n: vars(e) for n, e in v.items()} for t, v in terms},
        "notes": list(notes),
    }


@dataclass(frozen=True)
class FittedAddition:
    """An addition with the data and the model that it was derived from, for reports."""

    regression: Regression
    addition: Addition
    """What is printed."""


@dataclass(frozen=True)
class FittedWinchAddition(FittedAddition):
    """An addition to a winch's profile with its engine and fits; the noise is that of the final
    one.
    """

    regression: TimeSeriesRegression
    initial_model: Fit
    final: Fit
    engine: TimeSeriesSelection
    noise: BandNoise

    def refitted_to_motion(
        self, runs: Sequence[Run], progress: Callable[[int], None]
    ) -> FittedWinchAddition:
        """The same effects at the values that make the measured motion, with the errors of these
        values. Raises as :func:`~winchkit.dynamics.refit.refit_to_motion`.
        """
        old = self.addition.terms
        profile = self.regression.dataset.profile
        moved = refit_to_motion(runs, profile, [term for term, _ in old], progress)
        if moved.rms_after > moved.rms_before:
            was, now = (quantity(x, moved.unit) for x in (moved.rms_before, moved.rms_after))
            raise UsageError(
                f"the motion simulated from the measured torque is off by {now} rms with values "
                f"refitted to it, and by {was} with those of the prediction, which are the "
                "better ones: leave the refit out; errors of the torque are integrated twice, and "
                "outweigh those of the model here"
            )
        terms = [
            (
                term,
                {
                    name: Estimate(term.values[name], std[name], own.unit) if name in std else own
                    for name, own in known.items()
                },
            )
            for term, std, (_, known) in zip(moved.terms, moved.std, old, strict=True)
        ]
        values = {term.label: term for term in moved.terms}
        hypothesis = self.final.hypothesis
        at = replace(
            hypothesis,
            terms=tuple(
                held(values[term.label]) if term.label in values else term
                for term in hypothesis.terms
            ),
        )
        fitted = self.engine.fixed(at, self.noise)
        after = output_fits(self.engine, (fitted, self.noise), (fitted, self.noise))
        outputs = {
            name: replace(
                output,
                rms_after=after[name].rms_after,
                heldout_rms_after=after[name].heldout_rms_after,
            )
            for name, output in self.addition.outputs.items()
        }
        new = replace(self.addition, outputs=outputs, terms=tuple(terms), motion=moved)
        return replace(self, addition=new, final=fitted)


def add(
    effect_id: str,
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    refit: Literal["motion"] | None = None,
) -> Addition:
    """Fit an effect beside those of a profile, all of them refitted; one that is there too.

    Parameters
    ----------
    effect_id
        Name of the effect.
    runs
        Recorded runs.
    profile
        The winch, or the robot, whose effect on one line is ``EFFECT/LINE``.
    catalogue
        Effects; by default all that are installed.
    band
        Cut-off frequency of the torque's low-pass filter, Hz; of a winch only.
    refit
        ``motion``: refit the values so that the measured torque makes the measured motion, as a
        simulator needs them; of a winch or an axis.

    Returns
    -------
    Addition
        Every effect with its estimates, and the errors before and after.

    Raises
    ------
    UsageError
        For an effect that is unknown, or that the runs cannot show; for a motion that cannot be
        simulated.
    RunError
        With every fault of every run; where a motion is simulated, for a wrong sign or unit.
    """
    return fitted_addition(effect_id, runs, profile, catalogue, band, refit=refit).addition


def fitted_addition(
    effect_id: str,
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
    *,
    refit: str | None = None,
    progress: Callable[[int], None] = lambda step: None,
) -> FittedAddition:
    """The same as :func:`add`, with the fits; ``progress`` gets the number of each refit step."""
    require_type(effect_id, str, "effect_id")
    require_types(runs, Run, "runs")
    if refit not in (None, "motion"):
        raise UsageError(f"refit '{refit}' is unknown; give motion, or leave it out")
    if refit and not isinstance(profile, WinchProfile):
        raise UsageError("a refit to the motion simulates one winch or axis, of a robot --winch")
    if (by_wing := of_wing("add", profile, band)) is not None:
        found: FittedAddition = by_wing(effect_id, runs, profile, catalogue)
        return found
    profile, catalogue = require_winch(profile), catalogue or load_catalogue()
    dataset = prepare(runs, profile, band, decimate=True, fast=True, catalogue=catalogue)
    if not refit:
        return fitted_addition_to(effect_id, dataset, catalogue)
    with errors_in_units_of(profile):
        require_drive(dataset.sanity)
    return fitted_addition_to(effect_id, dataset, catalogue).refitted_to_motion(runs, progress)


def fitted_addition_to(
    effect_id: str, dataset: Dataset, catalogue: Catalogue
) -> FittedWinchAddition:
    """The same as :func:`fitted_addition` on a prepared data set, as that of a diagnosis."""
    catalogue = catalogue_of(dataset.profile, catalogue)
    effect = catalogue[effect_id]
    if not effect.repeatable and any(t.id == effect.id for t in dataset.profile.effect):
        return _refitted(effect_id, dataset, catalogue)
    candidates = Catalogue([*catalogue.of_winches(), _placed(effect, dataset)])
    engine = _engine(dataset, candidates, effect)
    lacking = engine.regression.missing_needs(effect)
    if lacking:
        raise UsageError(
            f"effect '{effect_id}' cannot be seen in these runs: without {', '.join(lacking)}"
        )

    def fitted_on(runs: Dataset) -> _Fits:
        other = _engine(runs, candidates, effect)
        return other, *_fitted(other, effect_id)

    dataset, (engine, before, after) = with_offsets_where_better(
        dataset,
        (engine, *_fitted(engine, effect_id)),
        fitted_on,
        lambda found: (found[0], *found[2]),
    )
    reduced = without_impacts(dataset, after[0].hypothesis)
    if reduced is not None:
        engine, before, after = fitted_on(reduced)
    if transitions := scanned_transitions(engine, *after):
        rounded = Catalogue(with_transitions(other, transitions) for other in candidates)
        engine = _engine(engine.regression.dataset, rounded, effect)
        after = _fitted(engine, effect_id)[1]
    best = reweighted(engine, with_fitted_transitions(engine, *after), after[1])
    spread = spread_of(engine.regression, best.fit, best.noise, engine.regression.blocks)
    outputs = output_fits(engine, before, (best.fit, best.noise))
    terms = tuple(estimates(engine.regression, best.fit, spread))
    addition = Addition(outputs, terms, _notes(engine, best))
    return FittedWinchAddition(
        engine.regression,
        in_units_of(dataset.profile, addition),
        before[0],
        best.fit,
        engine,
        best.noise,
    )


def _refitted(effect_id: str, dataset: Dataset, catalogue: Catalogue) -> FittedWinchAddition:
    """The profile's effects refitted, one of them last, beside their file values."""
    engine = selection_engine(dataset, catalogue)
    fitted, noise = engine.fit_with_noise(engine.initial_model)
    transitions = scanned_transitions(engine, fitted, noise)
    if transitions:
        known = catalogue.of_winches()
        rounded = Catalogue(with_transitions(other, transitions) for other in known)
        again = selection_engine(dataset, rounded)
        fitted, noise = again.fit_with_noise(again.initial_model)
        fitted = with_fitted_transitions(again, fitted, noise)
    best = reweighted(engine, fitted, noise)
    before = file_model(engine, engine.initial_model, best.noise)
    spread = spread_of(engine.regression, best.fit, best.noise, engine.regression.blocks)
    outputs = output_fits(engine, (before, best.noise), (best.fit, best.noise))
    terms = sorted(
        estimates(engine.regression, best.fit, spread),
        key=lambda pair: pair[0].effect.id == effect_id,
    )
    addition = Addition(outputs, tuple(terms), _notes(engine, best))
    addition = in_units_of(dataset.profile, addition)
    return FittedWinchAddition(engine.regression, addition, before, best.fit, engine, best.noise)


def _engine(dataset: Dataset, catalogue: Catalogue, effect: Effect) -> TimeSeriesSelection:
    """Selection engine with the candidates that the fit of one effect needs.

    Without repeats all are needed, since the noise is that beside them, and for an order, which is
    added only where no other explains more. Otherwise only thermal signatures enter the noise.
    """
    whole = not dataset.repeated or has_orders(effect)
    known = catalogue.of_winches()
    needed = [e for e in known if whole or e.id == effect.id or "temperature" in e.needs]
    return selection_engine(dataset, catalogue, needed)


def _fitted(
    engine: TimeSeriesSelection, effect_id: str
) -> tuple[tuple[Fit, BandNoise], tuple[Fit, BandNoise]]:
    """The profile's effects and those with the new one, each with its noise."""
    initial_model, noise = engine.fit_with_noise(engine.initial_model)
    trials = [
        engine.trial(initial_model, item, noise)
        for item in _candidates_of(engine, effect_id, noise)
    ]
    if not trials:
        raise UsageError(
            f"effect '{effect_id}' changes nothing that these runs measured, or gives no number "
            "there"
        )
    best = min(trials, key=lambda trial: trial.fit.chi_square)
    return (initial_model, noise), engine.fit_with_noise(best.fit.hypothesis, noise)


def _placed(effect: Effect, dataset: Dataset) -> Effect:
    """An empirical curve over the range of its variable in the data; any other effect unchanged."""
    if effect.id not in EMPIRICAL:
        return effect
    name = variable_of(effect)
    ranges = [variables_of(r)[name] for r in dataset.recordings if name in variables_of(r)]
    if not ranges:
        return effect
    return placed(effect, min(float(x.min()) for x in ranges), max(float(x.max()) for x in ranges))


def _candidates_of(engine: TimeSeriesSelection, effect_id: str, noise: BandNoise) -> list[Score]:
    """Grid points of an effect with the largest scores."""
    initial_model = engine.refit(engine.initial_model, noise)
    projected = engine.projected(initial_model, noise)
    ranked = score(projected, initial_model.residual, engine.regression.n_observations)
    return [item for item in ranked if item.candidate.effect.id == effect_id][:_STARTS]


@dataclass(frozen=True, repr=False)
class Removal(Shown):
    """A profile's effects refitted without one, and the change of the errors."""

    effect: str
    outputs: Mapping[str, OutputFit]
    terms: tuple[tuple[Term, Mapping[str, Estimate]], ...]
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """JSON of ``winchkit remove --json``."""
        return fitted_json(self.effect, self.outputs, self.terms, self.notes)


def remove(
    effect_id: str,
    runs: Sequence[Run],
    profile: Profile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Removal:
    """Refit a profile's effects without the last one of a name.

    Parameters
    ----------
    effect_id
        Name of the effect.
    runs
        Recorded runs.
    profile
        The winch, or the robot, whose effect on one line is ``EFFECT/LINE``.
    catalogue
        Effects; by default all that are installed.
    band
        Cut-off frequency of the torque's low-pass filter, Hz; of a winch only.

    Returns
    -------
    Removal
        The other effects with their estimates, and the errors before and after.

    Raises
    ------
    UsageError
        For an effect that the profile does not have.
    RunError
        With every fault of every run.
    """
    require_type(effect_id, str, "effect_id")
    if (by_wing := of_wing("remove", profile, band)) is not None:
        found: Removal = by_wing(effect_id, runs, profile, catalogue)
        return found
    profile = require_winch(profile)
    dataset = prepare(runs, profile, band, decimate=True, catalogue=catalogue)
    catalogue = catalogue_of(profile, catalogue or load_catalogue())

    def fitted_on(runs: Dataset) -> tuple[TimeSeriesSelection, Fit, BandNoise]:
        engine = selection_engine(runs, catalogue)
        return engine, *engine.fit_with_noise(engine.initial_model)

    _, (engine, initial_model, noise) = with_offsets_where_better(
        dataset, fitted_on(dataset), fitted_on, lambda found: found
    )
    terms = initial_model.hypothesis.terms
    there = [index for index, term in enumerate(terms) if term.effect.id == effect_id]
    if not there:
        has = ", ".join(term.label for term in terms) or "none"
        raise UsageError(f"profile '{profile.name}' has no effect '{effect_id}'; it has {has}")
    best = reweighted(engine, *engine.fit_with_noise(initial_model.hypothesis.without(there[-1])))
    # With the noise of the better model: without the effect, its residual would count as noise.
    outputs = output_fits(engine, (initial_model, noise), (best.fit, noise))
    spread = spread_of(engine.regression, best.fit, best.noise, engine.regression.blocks)
    left = tuple(estimates(engine.regression, best.fit, spread))
    return in_units_of(profile, Removal(effect_id, outputs, left, _notes(engine, best)))


def _notes(engine: TimeSeriesSelection, best: Reweighted) -> tuple[str, ...]:
    """Notes on the data and the weights, wrong signs and units, and offsets for every run."""
    dataset = engine.regression.dataset
    wrong = [f"{f.channel}: {f.text}" for f in dataset.sanity if f.code in ALARMING]
    offsets = [finding.text for finding in dataset.sanity if finding.code == "zeroed-anew"]
    return (*dict.fromkeys(wrong), *dataset.notes, *offsets, *best.notes)
