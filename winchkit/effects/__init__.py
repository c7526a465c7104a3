"""One file per physical effect, and what binds them to a profile."""

from winchkit.effects.bind import check_profile, line_of, terms_of
from winchkit.effects.bind_robot import robot_terms, robot_with_effects
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.term import Term, modifiers_of, robot_with_terms

__all__ = [
    "Catalogue",
    "Effect",
    "Parameter",
    "Term",
    "Values",
    "check_profile",
    "line_of",
    "load_catalogue",
    "modifiers_of",
    "robot_terms",
    "robot_with_effects",
    "robot_with_terms",
    "terms_of",
]
