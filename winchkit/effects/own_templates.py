"""What the file of an effect of a user's own begins with; names in braces are filled in."""

from __future__ import annotations

__all__ = ["CURVE", "DRUM", "FOOT", "HEAD", "WAVE"]

HEAD = '''"""{id}: found in the {output} over the {variable}, physics to be filled in.

Use it with --effects {file}. Written by winchkit effects new; change whatever you understand:
the formula in apply, the stage at which it acts, the words.
"""

import numpy as np
from numpy.typing import NDArray

from winchkit.effects import Effect, Parameter, Values
from winchkit.model.stages import At, Stage
from winchkit.model.variables import VARIABLES

Array = NDArray[np.float64]

'''
WAVE = '''ORDER = {order:g}
"""Periods per turn."""


def apply(value: Array, at: At, values: Values) -> Array:
    """The {output} with a wave on it; exactly the value given at amplitude zero."""
    x = VARIABLES["{variable}"](at)
    return value + values["amplitude"] * np.sin(ORDER * x + values["phase"])


PARAMETERS = (
    Parameter("amplitude", "{unit}", null=0.0, typical={typical:.3g}, low=0.0, high={high:.3g}),
    Parameter("phase", "rad", null=0.0, typical=1.0),
)
POLAR = ("amplitude", "phase")
'''
CURVE = '''X = np.array({x})
"""The {variable}, {own_unit}."""
Y = np.array({y})
"""What the {output} had too much there, {unit}."""


def apply(value: Array, at: At, values: Values) -> Array:
    """The {output} with the curve on it; exactly the value given at scale zero."""
    x = VARIABLES["{variable}"](at)
    return np.asarray(value + values["scale"] * np.interp(x, X, Y))


PARAMETERS = (Parameter("scale", "1", null=0.0, typical=1.0, low=-100.0, high=100.0),)
POLAR = None
'''
FOOT = """
# Where it acts. Control follows what happens to the rope (Stage.ROPE, FRAME, PULLEY, CELL), not
# what an instrument or the torque shows: 'winchkit effects {id} --effects {file}' says which.
EFFECT = Effect(
    id="{id}",
    stage=Stage.{stage},
    parameters=PARAMETERS,
    apply=apply,
    outputs=("{output}",),
    what="To be understood: something over the {words}.",
    formula="as in apply",
    source="the runs that it was found on",
    looks_like="An error of the {output_words} over the {words}.",
    told_apart="To be found: which run would show it apart from what resembles it?",
    needs={needs},
    polar=POLAR,
)
"""
DRUM = '''"""{id}: a wave of {order} periods per drum turn, physics to be filled in.

Use it with --effects {file}. Written by winchkit effects new because several outputs show the
same order of the drum: what is wound in has the wave, and torque and tension follow by themselves.
"""

import numpy as np

from winchkit.effects import Effect, Parameter, Values
from winchkit.model.stages import At, Path, Stage

ORDER = {order}
"""Periods per drum turn."""


def apply(path: Path, at: At, values: Values) -> Path:
    """Wound length (m) and torque arm (m) with a wave on them."""
    size, phase = values["amplitude"], values["phase"]
    angle = ORDER * at.drum_angle + phase
    wave = size * (np.sin(angle) - np.sin(phase))
    return Path(path.value + wave, path.slope + ORDER * size * np.cos(angle))


EFFECT = Effect(
    id="{id}",
    stage=Stage.WOUND,
    parameters=(
        Parameter("amplitude", "m", null=0.0, typical=1e-4, low=0.0, high=0.02),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=apply,
    outputs=("cable_length", "tension", "motor_torque"),
    what="To be understood: the drum winds in a wave of {order} periods per turn.",
    formula="W + a (sin({order} φ + p) − sin p)",
    source="the runs that it was found on",
    looks_like="{order} waves per drum turn in length, torque and the load's acceleration.",
    told_apart="To be found: which run would show it apart from what resembles it?",
    polar=("amplitude", "phase"),
)
'''
