"""cell-gain: the load cell's span is wrong."""

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Stage


def apply(tension: Array, at: At, values: Values) -> Array:
    """Reading (1 + g) T."""
    return tension * (1.0 + values["gain_error"])


EFFECT = Effect(
    id="cell-gain",
    stage=Stage.CELL,
    parameters=(
        Parameter(
            "gain_error",
            "1",
            null=0.0,
            typical=0.01,
            low=-0.9,
            high=10.0,
            plausible=Plausible(
                -0.5,
                1.0,
                "a span is per cent off; a factor of two is a second cable or another unit",
            ),
        ),
    ),
    apply=apply,
    outputs=("tension",),
    variable="load",
    what="The cell's span is wrong: calibration, mounting angle, a parallel load path.",
    formula="(1 + g) T",
    source="load-cell practice",
    looks_like="A tension error in proportion to the tension, equal in both directions.",
    confused_with=("pulley-coulomb", "pulley-capstan", "cell-nonlinearity", "torque-constant"),
    told_apart="Several loads in both directions; the torque distinguishes it from a wrong load.",
    family="cell static",
    needs=("load",),
    order=0,
    on_robot=frozenset({"one"}),
)
