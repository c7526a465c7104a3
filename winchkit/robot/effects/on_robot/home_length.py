"""home-length: the cable length at the zero of a motor differs from that of the home pose."""

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(length: float, at: At, values: Values) -> float:
    """Cable length plus a constant, at home and at every pose."""
    return length + values["length"]


EFFECT = Effect(
    id="home-length",
    stage=Stage.HOME_LENGTH,
    parameters=(Parameter("length", "m", null=0.0, typical=1e-3, low=-1.0, high=1.0),),
    apply=apply,
    outputs=("cable_length",),
    what="A motor was zeroed at a cable length other than that of the home pose.",
    formula="ℓ + δℓ",
    source="L_j = L_0 + Δl with its own L_0 for each line (CABTIVE paper, Eq. 3)",
    looks_like="One line's length error, the same at every pose.",
    confused_with=("exit-point", "anchor-point", "swivel-radius"),
    told_apart="Poses all around home: a shifted point's error changes sign with the direction.",
    needs=("robot",),
    on_robot=frozenset({"one"}),
)
