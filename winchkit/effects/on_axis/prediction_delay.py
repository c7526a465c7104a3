"""prediction-delay: the torque that another model predicts is late, or early, in the recording."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.derivatives import shifted
from winchkit.model.stages import At, Stage


def apply(torque: Array, at: At, values: Values) -> Array:
    """Predicted torque at the time for which it was predicted."""
    return shifted(torque, at.time, values["delay"])


EFFECT = Effect(
    id="prediction-delay",
    stage=Stage.MOTOR,
    parameters=(
        Parameter(
            "delay", "s", null=0.0, typical=5e-3, low=-2.0, high=2.0,
            plausible=Plausible(-0.2, 0.2, "a cycle or a filter of the model, another clock"),
        ),
    ),
    apply=apply,
    outputs=("motor_torque",),
    part="model",
    what="The column of the predicted torque is late (negative: early) against the measured one.",
    formula="τ(t) = p(t + δ), p the predicted torque",
    source="definition of a delay",
    looks_like="A torque error in proportion to the rate of the predicted torque.",
    confused_with=("torque-lead", "torque-lag"),
    told_apart="Fast reversals: friction, which the motor's own motion gives, is not shifted.",
    needs=("prediction",),
    order=-3,
)  # fmt: skip
