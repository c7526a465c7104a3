"""Taking an effect out of a robot's profile: what the others then are, and what that costs."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.diagnosis.remove import Removal
from winchkit.diagnosis.robot.figures import Shown, figures
from winchkit.diagnosis.robot.study import study_of
from winchkit.diagnosis.uncertainty import estimates, spread_of
from winchkit.effects.bind_robot import declared_terms
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.errors import UsageError
from winchkit.runs.run import Run
from winchkit.schema.robot import RobotProfile

__all__ = ["remove_from_robot"]


def remove_from_robot(
    effect_id: str,
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
) -> Removal:
    """Refit a robot's effects on poses without one of them, ``EFFECT`` or ``EFFECT/LINE``.

    ``home-length`` alone takes out those of all lines. Raises UsageError for an effect that the
    profile itself does not have, RunError with every fault of every run.
    """
    catalogue = catalogue or load_catalogue()
    own = [term.effect.id for term in declared_terms(profile, catalogue)]
    gone = [name for name in own if name == effect_id]
    if not gone and effect_id == "home-length":
        gone = [name for name in own if name.startswith("home-length/")]
    if not gone:
        has = ", ".join(own) or "none"
        raise UsageError(f"robot '{profile.name}' has no effect '{effect_id}'; it has {has}")
    study = study_of(runs, profile, catalogue)
    inquiry = study.as_filed()
    begin, noise = inquiry.settle(inquiry.begin)
    hypothesis = begin.hypothesis
    for index in reversed(range(len(hypothesis.terms))):
        if hypothesis.terms[index].effect.id in gone:
            hypothesis = hypothesis.without(index)
    final, _ = inquiry.settle(hypothesis)
    problem = inquiry.robot_problem
    before, after = (Shown(problem, fit, noise, inquiry.groups) for fit in (begin, final))
    found = estimates(problem, final, spread_of(problem, final, noise, inquiry.blocks))
    # What a line's winch brings along is refitted beside them and stays in the winch's own profile.
    left = tuple(item for item in found if item[0].effect.id in own)
    outputs = figures(before, after, study.noise)
    return Removal(effect_id, outputs, left, study.dataset.notes)
