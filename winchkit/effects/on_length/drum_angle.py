"""Effects between motor and drum: ratio, transmission error, backlash, slip of the encoder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.effects.effect import (
    MOTOR_ORDERS,
    Dynamics,
    Effect,
    Parameter,
    Plausible,
    Values,
    order_per_turn,
)
from winchkit.model.recurrence import play, share
from winchkit.model.stages import At, Path, Stage


def _gear_ratio(path: Path, at: At, values: Values) -> Path:
    """Drum angle and its slope with the ratio i (1 + e)."""
    share = 1.0 + values["ratio_error"]
    return Path(path.value / share, path.slope / share)


GEAR_RATIO = Effect(
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
    apply=_gear_ratio,
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


def _gear_transmission_error(path: Path, at: At, values: Values) -> Path:
    """Drum angle plus a sin(kθ + p), and its derivative by the motor angle."""
    size, order = values["amplitude"], values["order"]
    turned = order * at.motor_angle + values["phase"]
    return Path(path.value + size * np.sin(turned), path.slope + size * order * np.cos(turned))


GEAR_TRANSMISSION_ERROR = Effect(
    id="gear-transmission-error",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("amplitude", "rad", null=0.0, typical=2e-4, low=0.0, high=0.05),
        Parameter("phase", "rad", null=0.0, typical=1.0),
        order_per_turn(MOTOR_ORDERS, typical=2.0),
    ),
    apply=_gear_transmission_error,
    outputs=("cable_length", "motor_torque"),
    variable="motor_angle",
    what="Runout of teeth and shafts: the drum leads and lags within each motor turn.",
    formula="φ + a sin(k θ + p), k whole per motor turn",
    source="static transmission error of gears, one harmonic",
    looks_like="A ripple over the motor angle: in length, and in torque in proportion to the load.",
    confused_with=("motor-cogging", "drum-eccentricity"),
    told_apart="A scan of the orders under two loads: cogging does not grow with the load.",
    needs=("gearing",),
    order=1,
    polar=("amplitude", "phase"),
    repeatable=True,
)

_ON_THE_FLANK = 0.98
"""Share of the gap: teeth closer to a flank than this count as in contact (encoder noise)."""


def _gear_backlash(path: Path, at: At, values: Values) -> Path:
    """Drum angle behind a backlash, within which the drum stands and a share of the torque acts.

    The share is a parameter, since the gear's friction determines whether the motor turns freely or
    the load keeps the teeth on one flank. A single state at rest is assumed in contact.
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


def _gear_backlash_impacts(at: At, values: Values) -> NDArray[np.bool_]:
    """Samples near separation and impact of the teeth, between which the speed jumps."""
    gap, turned = values["gap"], at.drum_angle
    if gap == 0.0 or len(turned) < 2:
        return np.zeros(len(turned), dtype=bool)
    meshes = _meshes(turned, play(turned, gap, values["start"]), gap)
    return np.diff(meshes, prepend=meshes[0])


def _gear_backlash_carried(after: Path, before: Path, _at: At, values: Values) -> Array:
    """Position in the gap at the last sample."""
    gap = values["gap"]
    return share(after.value[-1] - before.value[-1], gap, values["start"])


def _gear_backlash_at_state(path: Path, at: At, values: Values) -> Path:
    """The share rises evenly over the last fiftieth: a rotor that would jump over its begin could
    come to rest there after endlessly many reversals."""
    drum_angle = path.value + values["gap"] * values["start"]
    to_flank = 2.0 * np.abs(values["start"]) - _ON_THE_FLANK
    near = np.clip(to_flank / (1.0 - _ON_THE_FLANK), 0.0, 1.0)
    return Path(drum_angle, path.slope * (values["held"] + (1.0 - values["held"]) * near))


def _gear_backlash_rate(path: Path, at: At, values: Values) -> Array:
    """Within the gap the drum stands still."""
    return np.asanyarray(-np.gradient(path.value, at.time) / values["gap"])


GEAR_BACKLASH = Effect(
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
    apply=_gear_backlash,
    outputs=("cable_length", "motor_torque"),
    what="Clearance (play) between teeth: after a reversal the drum stands until the other flank "
    "is in contact.",
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
    carry=_gear_backlash_carried,
    dynamics=Dynamics(_gear_backlash_at_state, _gear_backlash_rate),
    impacts=_gear_backlash_impacts,
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

_DURATION = 0.4
"""s: several samples at 50 Hz, so that a fit's derivative by the time of the slip exists; short
against a stroke."""


def _encoder_slip(path: Path, at: At, values: Values) -> Path:
    """Drum angle with a smooth step that begins at t0 and takes 0.4 s."""
    x = np.clip((at.time - values["time"]) / _DURATION, 0.0, 1.0)
    return Path(path.value + values["step"] * (x * x * (3 - 2 * x)), path.slope)


ENCODER_SLIP = Effect(
    id="encoder-slip",
    stage=Stage.DRUM_ANGLE,
    parameters=(
        Parameter("step", "rad", null=0.0, typical=0.02, low=-7.0, high=7.0),
        Parameter(
            "time",
            "s",
            null=60.0,
            typical=90.0,
            low=0.0,
            high=86400.0,
            role="shape",
            grid=(2, 6, 12, 20, 30, 45, 60, 80, 100, 125, 150, 180),
            onset=_DURATION,
        ),
    ),
    apply=_encoder_slip,
    outputs=("cable_length", "motor_torque"),
    part="encoder",
    variable="time",
    what="A coupling or a belt slipped: from then on the encoder has an error.",
    formula="φ + Δφ x²(3 − 2x), x = (t − t0) / 0.4 s from 0 to 1, t from the run's start",
    source="field experience; a smooth step, so that a fit can find its time",
    looks_like="A step of the length at one moment that does not return.",
    confused_with=("cable-creep", "gear-backlash"),
    told_apart="Return to the same place at the end of the run: creep recovers, a slip stays.",
    order=3,
    left_out="it occurred once, in the run that showed it; repeat the homing (winchkit home)",
)
