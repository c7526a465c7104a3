"""Whether a law of the cable stands for a home pose that is not the profile's.

A law of the cable is fitted with the home lengths of the lines, since its strain counts from home,
where the tensions are not known. Where these lengths alone explain what it does, no property of the
cable was seen: the platform was elsewhere when the motors had their reference angles.
"""

from __future__ import annotations

from dataclasses import replace

from winchkit.diagnosis.regression.cross_validation import CERTAIN, excess
from winchkit.diagnosis.results import Doubt, Step
from winchkit.effects.placement import HOME
from winchkit.effects.term import Term
from winchkit.robot.diagnosis.engine import PoseSelection
from winchkit.robot.diagnosis.errors import FittedModel, errors_in_noise

_TEXT = "the cable lengths at home, which are fitted with a law of the cable, explain it alone"


def with_home_doubt(
    engine: PoseSelection, final: FittedModel, without: FittedModel, step: Step, index: int
) -> Step:
    """The step, in doubt where the home lengths that are fitted with it explain nine tenths."""
    term = final.fit.hypothesis.terms[index]
    if not any(name.startswith(HOME) for name in term.values):
        return step
    alone = final.fit.hypothesis.with_term_at(index, _of_home_alone(term))
    model = replace(final, fit=engine.refit(alone, final.noise))
    errors = [errors_in_noise(one) for one in (model, final, without)]
    left, now, whole = (excess(one, dict.fromkeys(one, 1.0)) for one in errors)
    if left - now > CERTAIN * (whole - now):
        return step
    return replace(step, law="open", certain=False, doubts=(*step.doubts, Doubt("home", _TEXT)))


def _of_home_alone(term: Term) -> Term:
    """A law of the cable with its own values at their null, and its home lengths free."""
    effect, own = term.effect, {}
    parameters = []
    for parameter in effect.parameters:
        if parameter.name.startswith(HOME):
            parameters.append(parameter)
        else:
            parameters.append(replace(parameter, role="fixed"))
            own[parameter.name] = effect.null[parameter.name]
    return Term(replace(effect, parameters=tuple(parameters)), {**term.values, **own})
