"""Cable robots: kinematics with swivel pulleys, cable forces, poses and motor angles.

robot = robot_of(read_robot(find("profiles", "cabtive")))
angles = robot.motor_angles(Pose(position, rotation))
found = robot.poses_at(angles)

``identification`` holds what calibration and diagnosis share: bundle adjustment, estimated poses,
tracker and variance components.
"""

from winchkit.model.robot.cycle import RobotCycle, flat_pose
from winchkit.model.robot.dynamics import (
    InverseDynamics,
    PlatformMotion,
    dynamic_wrench,
    inverse_dynamics,
    motion_of,
)
from winchkit.model.robot.dynamics_cycle import DynamicsCycle, DynamicTarget
from winchkit.model.robot.elastic import ElongationLaw, Exponential, Linear, Quartic
from winchkit.model.robot.force_distribution import (
    Feasibility,
    ForceLimits,
    Forces,
    approximate_forces,
    closed_form,
    distributed_forces,
    improved_closed_form,
    quadratic,
    steepest_force,
    wrench_feasibility,
)
from winchkit.model.robot.forward import Found, forward
from winchkit.model.robot.kernels import PLAIN, RobotKernels, compiled, fastest
from winchkit.model.robot.kinematics import (
    Geometry,
    Pose,
    Sensitivities,
    geometry_of,
    home_of,
    lengths,
    sensitivities,
    structure_matrix,
    swivel_angle,
    swivel_sensitivities,
    wrap_angle,
)
from winchkit.model.robot.robot import Robot, cables_of, robot_of
from winchkit.model.robot.rotation import angles_of, rotation_of
from winchkit.model.robot.wrench import gravity_wrench

__all__ = [
    "PLAIN",
    "DynamicTarget",
    "DynamicsCycle",
    "ElongationLaw",
    "Exponential",
    "Feasibility",
    "ForceLimits",
    "Forces",
    "Found",
    "Geometry",
    "InverseDynamics",
    "Linear",
    "PlatformMotion",
    "Pose",
    "Quartic",
    "Robot",
    "RobotCycle",
    "RobotKernels",
    "Sensitivities",
    "angles_of",
    "approximate_forces",
    "cables_of",
    "closed_form",
    "compiled",
    "distributed_forces",
    "dynamic_wrench",
    "fastest",
    "flat_pose",
    "forward",
    "geometry_of",
    "gravity_wrench",
    "home_of",
    "improved_closed_form",
    "inverse_dynamics",
    "lengths",
    "motion_of",
    "quadratic",
    "robot_of",
    "rotation_of",
    "sensitivities",
    "steepest_force",
    "structure_matrix",
    "swivel_angle",
    "swivel_sensitivities",
    "wrap_angle",
    "wrench_feasibility",
]
