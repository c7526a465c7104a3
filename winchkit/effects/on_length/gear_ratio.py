"""gear-ratio: the gear ratio differs from the profile."""

from winchkit.effects.effect import Effect, Parameter, Plausible, Values
from winchkit.model.stages import At, Path, Stage


def apply(path: Path, at: At, values: Values) -> Path:
    """Drum angle and its slope with the ratio i (1 + e)."""
    share = 1.0 + values["ratio_error"]
    return Path(path.value / share, path.slope / share)


EFFECT = Effect(
    id="gear-ratio",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter(
            "ratio_error",
            "1",
            null=0.0,
            typical=5e-3,
            low=-0.5,
            high=1.0,
            plausible=Plausible(
                -0.2, 0.25, "a rounded ratio or belt slip is per cent; more is another gearbox"
            ),
        ),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    variable="cable_length",
    what="The ratio of the gearbox or belt differs from the profile: a rounded or wrong number.",
    formula="φ = θ / (i (1 + e))",
    source="kinematics of a gearbox",
    looks_like="A length error in proportion to the motor angle, at any tension.",
    confused_with=("drum-radius", "layer-thickness"),
    told_apart="An encoder on the drum; on a layered drum a stroke over several layers.",
    needs=("gearing",),
    on_robot=frozenset({"one", "all"}),
)
