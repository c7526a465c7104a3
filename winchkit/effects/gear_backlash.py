"""gear-backlash: the drum does not follow until the play of the gear is taken up."""

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.line import At, Path, Stage
from winchkit.model.recurrence import play


def apply(path: Path, at: At, values: Values) -> Path:
    """Drum angle through a play; the torque arm stays that of the meshing gear."""
    if values["gap"] == 0.0:
        return path
    return Path(play(path.value, values["gap"], values["start"]), path.slope)


EFFECT = Effect(
    id="gear-backlash",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("gap", "rad", null=0.0, typical=4e-3, low=0.0, high=0.2),
        Parameter("start", "1", null=0.0, typical=0.25, low=-0.5, high=0.5, role="fixed"),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    what="Teeth have play: after a reversal the drum stands until the other flank bears.",
    formula="play operator of gap b on φ; start: place in the gap at the run's start, −½ to ½",
    source="play operator (Krasnosel'skii and Pokrovskii, Systems with Hysteresis)",
    looks_like="A step of the length after every reversal, whatever the speed.",
    confused_with=("length-time-offset", "cable-hysteresis"),
    told_apart="A ladder of speeds: the step stays, a time offset grows with the speed.",
    needs=("gearing",),
    order=2,
    memory=True,
    probes=({"gap": 1e-3}, {"gap": 4e-3}, {"gap": 1.6e-2}),
)
