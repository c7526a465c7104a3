"""Physical effects: the catalogue, and the binding of effects to profiles.

``on_length``, ``on_tension``, ``on_torque``, ``on_axis`` and ``on_robot`` have one effect per file,
ordered by the first output that it changes. ``bind`` and ``bind_robot`` make terms of the tables of
a profile, ``parametrization`` gives the coordinates in which a fit changes their values.
"""

from winchkit.effects.bind import check_profile, line_of, terms_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.term import Term, modifiers_of, robot_with_terms
from winchkit.robot.effects.bind import robot_terms, robot_with_effects

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
