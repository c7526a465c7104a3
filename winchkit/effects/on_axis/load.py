"""Torque of what an axis moves: weight of a part, payload, spring."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.errors import UsageError
from winchkit.model.stages import At, Stage
from winchkit.units import GRAVITY


def _joint_gravity(torque: Array, at: At, values: Values) -> Array:
    return torque + values["amplitude"] * np.sin(at.drum_angle + values["phase"])


JOINT_GRAVITY = Effect(
    id="joint-gravity",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("amplitude", "N m", null=0.0, typical=1.0, low=0.0, high=1e6),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=_joint_gravity,
    outputs=("motor_torque",),
    part="load",
    variable="drum_angle",
    what="The axis carries a part whose centre of mass is not on it.",
    formula="τ + a sin(φ + p), a = m g l / ratio, φ the angle of the joint",
    source="statics of a pendulum; minimal parameters m l of robot dynamics (Khalil, Dombre 2002)",
    looks_like="A sine of the joint angle in the torque, the same in both directions.",
    confused_with=("drum-unbalance", "spring-balancer", "motor-coulomb-asymmetry"),
    told_apart="A stroke of at least a quarter turn: a short one is a straight line.",
    needs=("axis",),
    polar=("amplitude", "phase"),
    order=-2,
)


def _joint_payload(torque: Array, at: At, values: Values) -> Array:
    lever, gear = values["lever"], at.profile.gearbox
    if not lever:
        return torque
    if at.payload is None:
        raise UsageError(
            "effect 'joint-payload' needs the load of every run: state load_mass, 0 kg for none"
        )
    weight = GRAVITY * lever * np.sin(at.drum_angle + values["phase"])
    slope = gear.direction / gear.ratio
    return torque + at.payload * slope * (weight + lever**2 * slope * at.motor_acceleration)


JOINT_PAYLOAD = Effect(
    id="joint-payload",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("lever", "m", null=0.0, typical=0.3, low=0.0, high=100.0),
        Parameter("phase", "rad", null=0.0, typical=1.0),
    ),
    apply=_joint_payload,
    outputs=("motor_torque",),
    part="load",
    what="The axis carries the stated load on a lever, whose length is as exact as that load.",
    formula="τ + m (g l sin(φ + p) + l² φ̈) / ratio, m the run's load_mass, φ the joint angle",
    source="statics and inertia of a point mass on a pendulum",
    looks_like="A sine of the joint angle in the torque, in proportion to the stated load.",
    confused_with=("joint-gravity",),
    told_apart="Runs with further loads, one of them without any.",
    needs=("axis", "payloads"),
    polar=("lever", "phase"),
    order=-2,
)


def _spring_balancer(torque: Array, at: At, values: Values) -> Array:
    return torque + (values["stiffness"] * at.drum_angle + values["torque"])


SPRING_BALANCER = Effect(
    id="spring-balancer",
    stage=Stage.MOTOR,
    parameters=(
        Parameter("stiffness", "N m/rad", null=0.0, typical=1e-3, low=-1e6, high=1e6),
        Parameter("torque", "N m", null=0.0, typical=0.01, low=-1e6, high=1e6),
    ),
    apply=_spring_balancer,
    outputs=("motor_torque",),
    part="load",
    variable="drum_angle",
    reduces_to=("motor-coulomb-asymmetry",),
    what="A spring, or a counterweight with a chain, acts on the moving part.",
    formula="τ + k φ + c, φ the drum angle since the reference",
    source="Hooke's law; weight balancing of arms and doors by springs",
    looks_like="A torque error that is a straight line over the position, at every load.",
    confused_with=("cable-weight", "joint-gravity", "motor-coulomb-asymmetry"),
    told_apart="A longer way; where there is a cable, its tension.",
    family="motor friction",
    contains=("motor-coulomb-asymmetry",),
    order=-2,
)
