"""Add an effect to a robot's profile or remove one, refitted and compared by held-out error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from winchkit.arguments import require_type, require_types
from winchkit.diagnosis.add import Addition, FittedAddition, Removal
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import estimates
from winchkit.diagnosis.results import Estimate, OutputFit
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.placement import at_line
from winchkit.effects.term import Term
from winchkit.errors import UsageError
from winchkit.robot.diagnosis.candidates import lacking, with_needs_met
from winchkit.robot.diagnosis.errors import Errors, FittedModel, output_fits_of
from winchkit.robot.diagnosis.preparation import Preparation, prepare_selection
from winchkit.robot.diagnosis.regression import PoseRegression
from winchkit.robot.effects.bind import declared_terms, robot_terms
from winchkit.runs.run import Run
from winchkit.schema.profiles.robot import RobotProfile


@dataclass(frozen=True)
class FittedRobotAddition(FittedAddition):
    """An addition to a robot's profile."""

    wing: ClassVar[str] = "robot"

    regression: PoseRegression
    errors: tuple[Errors, Errors]
    """Before and after, at every pose, SI."""


def fitted_addition(
    effect_id: str,
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
) -> FittedRobotAddition:
    """Fit ``EFFECT`` or ``EFFECT/LINE`` beside the profile's own, with the geometry of the file.
    Raises UsageError for one that is unknown, present already, at no such place or not visible, and
    RunError."""
    require_types(runs, Run, "runs")
    require_type(profile, RobotProfile, "profile")
    catalogue = catalogue or load_catalogue()
    base, _, line = effect_id.partition("/")
    effect = _placed(catalogue[base], profile, line)
    if any(term.effect.id == effect.id for term in robot_terms(profile, catalogue)):
        raise UsageError(f"robot '{profile.name}' has the effect '{effect.id}' already")
    preparation = prepare_selection(runs, profile, catalogue)
    if missing := lacking(effect, preparation.dataset):
        raise UsageError(
            f"effect '{base}' cannot be seen in these poses: without {', '.join(missing)}"
        )
    return _added(preparation, with_needs_met(effect, preparation.dataset))


def _placed(effect: Effect, profile: RobotProfile, line: str) -> Effect:
    names = [known.name for known in profile.line]
    places = effect.places(moving=True)
    if not places:
        raise UsageError(f"effect '{effect.id}' shows in the motion of a single winch only")
    if not line:
        if not places & {"all", "platform"}:
            raise UsageError(
                f"effect '{effect.id}' acts on one line: name it with --winch, one of "
                f"{', '.join(names)}"
            )
        return effect
    if "one" not in places:
        raise UsageError(f"effect '{effect.id}' acts on the robot as a whole; leave --winch out")
    if line not in names:
        raise UsageError(f"no line '{line}'; the lines are {', '.join(names)}")
    return at_line(effect, line)


def _added(preparation: Preparation, effect: Effect) -> FittedRobotAddition:
    engine = preparation.file_geometry()
    initial_model, noise = engine.fit_with_noise(engine.initial_model)
    scores = [s for s in engine.scores(initial_model, noise) if s.candidate.effect.id == effect.id]
    if not scores:
        raise UsageError(f"effect '{effect.id}' changes nothing that these poses measured")
    final: Fit = engine.trial(initial_model, scores[0], noise).fit
    before, after = (FittedModel(engine.regression, f, noise) for f in (initial_model, final))
    outputs, found = _outputs_and_values(preparation, before, after)
    own = {
        term.effect.id for term in declared_terms(preparation.dataset.robot, preparation.catalogue)
    }
    # Effects of a line's winch are refitted too and stay in the winch's own profile.
    terms = tuple(item for item in found if item[0].effect.id in own or item is found[-1])
    addition = Addition(outputs, terms, preparation.dataset.notes)
    return FittedRobotAddition(engine.regression, addition, (before.errors, after.errors))


def _outputs_and_values(
    preparation: Preparation, before: FittedModel, after: FittedModel
) -> tuple[dict[str, OutputFit], list[tuple[Term, dict[str, Estimate]]]]:
    """Errors of every output before and after, and the effects with their estimates."""
    found = estimates(after.regression, after.fit, after.spread)
    return output_fits_of(before, after, preparation.noise), found


def remove(
    effect_id: str,
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
) -> Removal:
    """Refit the profile's effects without one of them, ``EFFECT`` or ``EFFECT/LINE``.

    ``home-length`` alone removes those of all lines. Raises UsageError for an effect that the
    profile itself does not have, and RunError with every fault of every run.
    """
    require_types(runs, Run, "runs")
    require_type(profile, RobotProfile, "profile")
    catalogue = catalogue or load_catalogue()
    own = [term.effect.id for term in declared_terms(profile, catalogue)]
    gone = [name for name in own if name == effect_id]
    if not gone and effect_id == "home-length":
        gone = [name for name in own if name.startswith("home-length/")]
    if not gone:
        has = ", ".join(own) or "none"
        raise UsageError(f"robot '{profile.name}' has no effect '{effect_id}'; it has {has}")
    preparation = prepare_selection(runs, profile, catalogue)
    engine = preparation.file_geometry()
    initial_model, noise = engine.fit_with_noise(engine.initial_model)
    hypothesis = initial_model.hypothesis
    for index in reversed(range(len(hypothesis.terms))):
        if hypothesis.terms[index].effect.id in gone:
            hypothesis = hypothesis.without(index)
    final, _ = engine.fit_with_noise(hypothesis)
    before, after = (FittedModel(engine.regression, f, noise) for f in (initial_model, final))
    outputs, found = _outputs_and_values(preparation, before, after)
    # Effects of a line's winch are refitted too and stay in the winch's own profile.
    left = tuple(item for item in found if item[0].effect.id in own)
    return Removal(effect_id, outputs, left, preparation.dataset.notes)
