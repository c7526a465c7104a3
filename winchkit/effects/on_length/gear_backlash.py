"""gear-backlash: after a reversal the drum stands still until the backlash is closed.

Within the backlash the motor turns freely, unless the load keeps the teeth on one flank. The
friction of the gear determines which of both applies, so that the share of the torque that acts
within the backlash is a parameter.
"""

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.effects.effect import Dynamics, Effect, Parameter, Plausible, Values
from winchkit.model.recurrence import play, share
from winchkit.model.stages import At, Path, Stage

_ON_THE_FLANK = 0.98
"""Share of the gap: teeth closer to a flank than this count as in contact (encoder noise)."""


def apply(path: Path, at: At, values: Values) -> Path:
    """Drum angle behind a backlash, within which the drum stands and a share of the torque acts.

    For a single state at rest the position within the gap is unknown; it is assumed in contact.
    """
    gap = values["gap"]
    if gap == 0.0 or len(path.value) < 2:
        return path
    drum_angle = play(path.value, gap, values["start"])
    meshes = _meshes(path.value, drum_angle, gap)
    return Path(drum_angle, path.slope * np.where(meshes, 1.0, values["held"]))


def _meshes(turned: Array, drum_angle: Array, gap: float) -> NDArray[np.bool_]:
    """Samples at which the teeth are in contact."""
    return np.asanyarray(np.abs(drum_angle - turned) >= gap / 2 * _ON_THE_FLANK)


def impacts(at: At, values: Values) -> NDArray[np.bool_]:
    """Samples near separation and impact of the teeth, between which the speed jumps."""
    gap, turned = values["gap"], at.drum_angle
    if gap == 0.0 or len(turned) < 2:
        return np.zeros(len(turned), dtype=bool)
    meshes = _meshes(turned, play(turned, gap, values["start"]), gap)
    return np.diff(meshes, prepend=meshes[0])


def carried(after: Path, before: Path, _at: At, values: Values) -> Array:
    """Position in the gap at the last sample."""
    gap = values["gap"]
    return share(after.value[-1] - before.value[-1], gap, values["start"])


def _at_state(path: Path, at: At, values: Values) -> Path:
    drum_angle = path.value + values["gap"] * values["start"]
    meshes = _meshes(path.value, drum_angle, values["gap"])
    return Path(drum_angle, path.slope * np.where(meshes, 1.0, values["held"]))


def _rate(path: Path, at: At, values: Values) -> Array:
    """Within the gap the drum stands still."""
    return np.asanyarray(-np.gradient(path.value, at.time) / values["gap"])


EFFECT = Effect(
    id="gear-backlash",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("gap", "rad", null=0.0, typical=4e-3, low=0.0, high=0.2),
        Parameter(
            "held",
            "1",
            null=1.0,
            typical=0.5,
            low=0.0,
            high=1.0,
            plausible=Plausible(0.0, 1.0, "a share of the torque"),
        ),
        Parameter("start", "1", null=0.0, typical=0.25, low=-0.5, high=0.5, role="fixed"),
    ),
    apply=apply,
    outputs=("cable_length", "motor_torque"),
    what="Clearance between teeth: after a reversal the drum stands until the other flank is in "
    "contact.",
    formula="play operator of gap b on φ; held: share of the cable's torque within the gap, "
    "except in the last fiftieth before a flank; start: position in the gap at the run's "
    "start, −½ to ½",
    source="play operator (Krasnosel'skii and Pokrovskii, Systems with Hysteresis)",
    looks_like="A step of the length after a reversal, at any speed.",
    confused_with=("length-time-offset", "cable-hysteresis"),
    told_apart="A ladder of speeds: the step stays, a time offset grows with the speed.",
    needs=("gearing",),
    order=2,
    memory=True,
    carry=carried,
    dynamics=Dynamics(_at_state, _rate),
    impacts=impacts,
    probes=(
        {"gap": 1e-3},
        {"gap": 4e-3},
        {"gap": 1.6e-2},
        {"gap": 6e-2},
        {"gap": 4e-3, "held": 0.0},
        {"gap": 1.6e-2, "held": 0.0},
        {"gap": 6e-2, "held": 0.0},
    ),
)
