"""Physical effects: the catalogue, and the binding of effects to profiles.

``on_length``, ``on_tension``, ``on_torque`` and ``on_axis`` have the effects by the first output
that they change, a file for each part of the machine. ``bind`` makes terms of the tables of a
profile, ``parametrization`` gives the coordinates in which a fit changes their values. Effects of
robots are in ``winchkit.robot.effects``.
"""

from winchkit.effects.bind import check_profile, line_of, terms_of
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.effects.term import Term, modifiers_of

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
    "terms_of",
]
