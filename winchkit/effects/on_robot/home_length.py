"""home-length: a line had another length of rope out when its motor was zeroed."""

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At, Stage


def apply(length: float, at: At, values: Values) -> float:
    """Rope out at home, and with it everywhere, longer by a constant."""
    return length + values["length"]


EFFECT = Effect(
    id="home-length",
    stage=Stage.HOME_LENGTH,
    parameters=(Parameter("length", "m", null=0.0, typical=1e-3, low=-1.0, high=1.0),),
    apply=apply,
    outputs=("cable_length",),
    what="A motor was zeroed with another length of rope out than the home pose asks for.",
    formula="ℓ + δℓ",
    source="L_j = L_0 + Δl with its own L_0 for each line (CABTIVE paper, Eq. 3)",
    looks_like="One line's length error, the same at every pose.",
    confused_with=("exit-point", "anchor-point", "swivel-radius"),
    told_apart="Poses all around home: a shifted point's error changes sign with the direction.",
    needs=("robot",),
    on_robot=frozenset({"one"}),
)
