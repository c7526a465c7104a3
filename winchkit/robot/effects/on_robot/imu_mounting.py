"""imu-mounting: the axes of a target or an IMU are not those of the platform."""

from dataclasses import replace

import numpy as np

from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.rotation import rotation_by, rotation_vector
from winchkit.model.stages import At, Stage
from winchkit.robot.geometry.tracker import Tracker


def apply(tracker: Tracker, at: At, values: Values) -> Tracker:
    """An instrument that is turned on the platform."""
    turned = rotation_by(np.array([values["rx"], values["ry"], values["rz"]]))
    if tracker.mounting is not None:
        turned = rotation_by(tracker.mounting) @ turned
    elif not any(values[axis] for axis in ("rx", "ry", "rz")):
        return tracker
    return replace(tracker, mounting=rotation_vector(turned))


EFFECT = Effect(
    id="imu-mounting",
    stage=Stage.TRACKER,
    parameters=tuple(
        Parameter(axis, "rad", null=0.0, typical=2e-3, low=-3.2, high=3.2)
        for axis in ("rx", "ry", "rz")
    ),
    apply=apply,
    outputs=("cable_length",),
    variable="pose",
    what="The target of the tracker, or the IMU, is mounted at an angle to the platform's axes.",
    formula="R_y = R exp([m]×)",
    source="Sensor-to-body alignment of inertial measurement units",
    looks_like="Constant differences of roll, pitch and yaw; cables and positions agree.",
    confused_with=("tracker-frame",),
    told_apart="Poses with large yaw: a mounting turns with the platform, a frame does not.",
    needs=("robot",),
    on_robot=frozenset({"platform"}),
)
