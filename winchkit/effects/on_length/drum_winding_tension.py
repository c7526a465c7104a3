"""drum-winding-tension: cable on the drum keeps the strain at which it was wound in."""

from itertools import pairwise

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage

_UNIT_TENSION = 500.0
"""N: middle of a bench's tensions, so that the fraction is the strain at it; another would scale
the parameter and its declared sizes."""


def apply(length: Array, at: At, values: Values) -> Array:
    """Length plus the difference of strained and unstrained length of the cable on the drum.

    Each piece wound in during the run keeps the strain fraction·T/500 N of that moment; the cable
    on the drum before has that of the run's mean tension, since its own is unknown.
    """
    if values["fraction"] == 0.0:
        return length
    strain = values["fraction"] * at.tension / _UNIT_TENSION
    return length + stored((at.profile.reference.cable_length or 0.0) - at.free_length, strain)


def stored(wound: Array, strain: Array) -> Array:
    """Integral of the strain of the cable on the drum over its wound length; m, shape (n,). The
    drum is a stack: cable wound in last is paid out first, with the ``strain`` of its winding.
    """
    before = float(np.mean(strain))
    lowest, n = float(np.min(wound)) - 1.0, len(wound)
    place, total = np.empty(n + 2), np.empty(n + 2)
    place[:2], top = (lowest, wound[0]), 2
    total[:2] = before * place[:2]
    out = np.empty(n)
    out[0] = total[1]
    for first, last in _stretches(wound):
        here = wound[first:last]
        if here[0] > wound[first - 1]:
            step = np.diff(wound[first - 1 : last]) * strain[first:last]
            end = top + len(here)
            place[top:end], total[top:end] = here, total[top - 1] + np.cumsum(step)
            out[first:last] = total[top:end]
            top = end
        else:
            out[first:last] = np.interp(here, place[:top], total[:top])
            top = int(np.searchsorted(place[:top], here[-1]))
            place[top], total[top] = here[-1], out[last - 1]
            top += 1
    return out


def _stretches(wound: Array) -> list[tuple[int, int]]:
    """Index ranges over which the cable runs in one direction; standstill counts as paying out."""
    winds_in = np.diff(wound) > 0
    turns = np.flatnonzero(np.diff(winds_in)) + 2
    ends = [1, *turns.tolist(), len(wound)]
    return [(a, b) for a, b in pairwise(ends) if a < b]


EFFECT = Effect(
    id="drum-winding-tension",
    stage=Stage.CABLE,
    parameters=(Parameter("fraction", "1", null=0.0, typical=5e-3, low=-0.05, high=0.05),),
    apply=apply,
    outputs=("cable_length",),
    variable="load",
    what="Cable wound in under tension stays strained and flattened on the drum until paid out.",
    formula="ℓ + ∫ ε_w dW, ε_w = fraction·T/500 N when that piece was wound in",
    source="Schmidt, Mall, Pott 2015: ovalisation changes winding by 0.3 to 1.2 %",
    looks_like="A length error over the drum angle that depends on the tension at winding.",
    confused_with=("cable-hysteresis", "drum-radius", "cable-elongation-linear"),
    told_apart="Wind in under one load, pay out under another.",
    needs=("cable_force",),
    order=5,
    left_out="the tension at which the cable on the drum was wound in is not known",
)
