"""Adding an effect: fitted on runs, judged on held-out ones, ready to be written to a profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from winchkit.diagnosis.data.dataset import Dataset, prepare
from winchkit.diagnosis.diagnose import selection_engine
from winchkit.diagnosis.regression.exclusion import without_impacts
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import variables_of
from winchkit.diagnosis.results import Estimate, OutputFit
from winchkit.diagnosis.selection.scores import Score, score
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.selection.weighting import reweighted
from winchkit.diagnosis.verdict.decision import output_fits
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.empirical import EMPIRICAL, placed, variable_of
from winchkit.effects.term import Term
from winchkit.errors import UsageError
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

__all__ = [
    "Addition",
    "Grown",
    "Removal",
    "add",
    "fitted_json",
    "grow",
    "remove",
]

_STARTS = 4


@dataclass(frozen=True)
class Addition:
    """A profile's effects, the new one last, refitted together, and what that bought."""

    outputs: Mapping[str, OutputFit]
    terms: tuple[tuple[Term, Mapping[str, Estimate]], ...]
    notes: tuple[str, ...] = ()

    @property
    def added(self) -> tuple[Term, Mapping[str, Estimate]]:
        """The new effect with its values."""
        return self.terms[-1]

    def to_json(self) -> dict[str, Any]:
        """As ``winchkit add --json`` prints it."""
        return fitted_json(self.added[0].effect.id, self.outputs, self.terms, self.notes)


def fitted_json(
    effect_id: str,
    outputs: Mapping[str, OutputFit],
    terms: Sequence[tuple[Term, Mapping[str, Estimate]]],
    notes: Sequence[str],
) -> dict[str, Any]:
    """What one effect more or less did to a profile, as ``add`` and ``remove`` print it."""
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
class Grown:
    """An addition with everything behind it, for reports."""

    regression: TimeSeriesRegression
    initial_model: Fit
    """The effects that the profile had, refitted."""
    final: Fit
    """With the new one."""
    addition: Addition


def add(
    effect_id: str,
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Addition:
    """Fit an effect beside those that a profile has, all of them refitted.

    Raises UsageError for an effect that is unknown, there already, or cannot be seen in the runs,
    RunError with every fault of every run.
    """
    return grow(effect_id, runs, profile, catalogue, band).addition


def grow(
    effect_id: str,
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Grown:
    """As :func:`add`, with the fits that the figures were taken from."""
    catalogue = catalogue or load_catalogue()
    effect = catalogue[effect_id]
    if not effect.repeatable and any(table.id == effect_id for table in profile.effect):
        raise UsageError(f"profile '{profile.name}' has the effect '{effect_id}' already")
    dataset = prepare(runs, profile, band, thin=True)
    candidates = Catalogue([*catalogue, _placed(effect, dataset)])
    engine = selection_engine(dataset, candidates)
    lacking = engine.regression.missing_needs(effect)
    if lacking:
        raise UsageError(
            f"effect '{effect_id}' cannot be seen in these runs: without {', '.join(lacking)}"
        )
    (initial_model, noise), (final, final_noise) = _fitted(engine, effect_id)
    calm = without_impacts(dataset, final.hypothesis)
    if calm is not None:
        engine = selection_engine(calm, candidates)
        (initial_model, noise), (final, final_noise) = _fitted(engine, effect_id)
    best = reweighted(engine, final, final_noise)
    spread = spread_of(engine.regression, best.fit, best.noise, engine.regression.blocks)
    outputs = output_fits(engine, (initial_model, noise), (best.fit, best.noise))
    terms = tuple(estimates(engine.regression, best.fit, spread))
    notes = (*engine.regression.dataset.notes, *best.notes)
    return Grown(engine.regression, initial_model, best.fit, Addition(outputs, terms, notes))


def _fitted(
    engine: TimeSeriesSelection, effect_id: str
) -> tuple[tuple[Fit, Noise], tuple[Fit, Noise]]:
    """The profile as it is, and with the effect, each with its noise."""
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
    """An empirical curve over what its variable covers in the data; any other effect as it is."""
    if effect.id not in EMPIRICAL:
        return effect
    name = variable_of(effect)
    ranges = [variables_of(r)[name] for r in dataset.recordings if name in variables_of(r)]
    if not ranges:
        return effect
    return placed(effect, min(float(x.min()) for x in ranges), max(float(x.max()) for x in ranges))


def _candidates_of(engine: TimeSeriesSelection, effect_id: str, noise: Noise) -> list[Score]:
    """Points of an effect's shape grid that fit best."""
    initial_model = engine.refit(engine.initial_model, noise)
    projected = engine.projected(initial_model, noise)
    ranked = score(projected, initial_model.residual, engine.regression.n_rows)
    return [item for item in ranked if item.candidate.effect.id == effect_id][:_STARTS]


@dataclass(frozen=True)
class Removal:
    """What is left of a profile's effects, refitted together, and what the loss did."""

    effect: str
    outputs: Mapping[str, OutputFit]
    terms: tuple[tuple[Term, Mapping[str, Estimate]], ...]
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """As ``winchkit remove --json`` prints it."""
        return fitted_json(self.effect, self.outputs, self.terms, self.notes)


def remove(
    effect_id: str,
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Removal:
    """Refit a profile's effects without the last one of this name.

    Raises UsageError for an effect that the profile does not have, RunError with every fault of
    every run.
    """
    engine = selection_engine(
        prepare(runs, profile, band, thin=True), catalogue or load_catalogue()
    )
    initial_model, noise = engine.fit_with_noise(engine.initial_model)
    terms = initial_model.hypothesis.terms
    there = [index for index, term in enumerate(terms) if term.effect.id == effect_id]
    if not there:
        has = ", ".join(term.label for term in terms) or "none"
        raise UsageError(f"profile '{profile.name}' has no effect '{effect_id}'; it has {has}")
    best = reweighted(engine, *engine.fit_with_noise(initial_model.hypothesis.without(there[-1])))
    # Judged by the noise of the better model: without the effect its trace would pass for noise.
    outputs = output_fits(engine, (initial_model, noise), (best.fit, noise))
    spread = spread_of(engine.regression, best.fit, best.noise, engine.regression.blocks)
    left = tuple(estimates(engine.regression, best.fit, spread))
    notes = (*engine.regression.dataset.notes, *best.notes)
    return Removal(effect_id, outputs, left, notes)
