"""An effect of one's own: the fairlead at the exit point grips the rope.

Use it with any command that takes a model: ``--effects examples/my_effect.py``. It is then
listed, has a card, and is a candidate of the diagnosis like every other effect.
"""

import numpy as np

from winchkit.effects import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(tension: np.ndarray, at: At, values: Values) -> np.ndarray:
    """Tension (N) above the fairlead: a constant force against the motion of the rope."""
    return tension + values["grip"] * at.direction


EFFECT = Effect(
    id="fairlead-grip",
    stage=Stage.ROPE_WEIGHT,  # the rope's way up, before the first pulley
    order=1,  # after the rope's own weight
    parameters=(Parameter("grip", "N", null=0.0, typical=5.0, low=0.0, high=500.0),),
    apply=apply,
    outputs=("tension", "motor_torque"),
    what="The fairlead at the exit point grips the rope, whatever hangs on it.",
    formula="T + s F",
    source="Coulomb friction with a clamping force that does not depend on the load",
    looks_like="A step of tension and torque with the direction, the same at every load.",
    confused_with=("pulley-coulomb", "motor-coulomb"),
    told_apart="Two loads in both directions; the cell tells it from the motor's friction.",
    needs=("load",),
)
