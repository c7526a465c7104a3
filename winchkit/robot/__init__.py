"""Cable robots: many winches that move one platform.

``geometry``, ``forces`` and ``dynamics`` have the model, ``workspace`` where it holds the platform,
``identification`` and ``mistakes`` (of tables) what ``calibration`` and ``diagnosis`` share;
``bench`` moves the platform, ``sim`` simulates it; ``effects``, ``files``, ``report``, ``web`` and
``cli`` are the robot's parts of the packages of these names, and ``export`` writes a robot for
other programs. Each name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from winchkit.bench.tracker import TrackerReceiver
    from winchkit.model.elastic import ElongationLaw, ExponentialLaw, LinearLaw, QuarticLaw
    from winchkit.model.rotation import angles_of, rotation_of
    from winchkit.robot.bench.computation import ComputationProcess
    from winchkit.robot.bench.platform import Platform
    from winchkit.robot.bench.self_calibration import PoseVolume, SelfCalibration, self_calibrated
    from winchkit.robot.calibration.calibrate import calibrate
    from winchkit.robot.calibration.pose_design import next_poses
    from winchkit.robot.calibration.profile import write_calibrated
    from winchkit.robot.diagnosis.diagnose import RobotAnswer
    from winchkit.robot.diagnosis.plan import PosePlan
    from winchkit.robot.dynamics.cycle import RobotCycle, flat_pose
    from winchkit.robot.dynamics.dynamics import (
        InverseDynamics,
        PlatformMotion,
        dynamic_wrench,
        inverse_dynamics,
        motion_of,
    )
    from winchkit.robot.dynamics.dynamics_cycle import DynamicsCycle, DynamicTarget
    from winchkit.robot.dynamics.elongation_correction import ElongationCorrection
    from winchkit.robot.dynamics.kernels import PLAIN, RobotKernels, compiled, fastest
    from winchkit.robot.dynamics.rest import Rest, pendulum_modes, rest_poses
    from winchkit.robot.effects.bind import robot_terms, robot_with_effects
    from winchkit.robot.effects.term import robot_with_terms
    from winchkit.robot.files.poses import read_poses
    from winchkit.robot.forces.force_distribution import (
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
    from winchkit.robot.geometry.forward import PosesFound, forward
    from winchkit.robot.geometry.kinematics import (
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
    from winchkit.robot.geometry.robot import Robot, cables_of, robot_of
    from winchkit.robot.geometry.wrench import gravity_wrench
    from winchkit.robot.workspace.distances import Distances, distances
    from winchkit.robot.workspace.mesh import Mesh, mesh_of, write_mesh
    from winchkit.robot.workspace.workspace import (
        CableDemand,
        Grid,
        Workspace,
        grid_of,
        workspace_of,
    )
    from winchkit.schema.read import read_robot
    from winchkit.schema.robot_bench import BodySpec

__all__ = [
    "PLAIN",
    "BodySpec",
    "CableDemand",
    "ComputationProcess",
    "Distances",
    "DynamicTarget",
    "DynamicsCycle",
    "ElongationCorrection",
    "ElongationLaw",
    "ExponentialLaw",
    "Feasibility",
    "ForceLimits",
    "Forces",
    "Geometry",
    "Grid",
    "InverseDynamics",
    "LinearLaw",
    "Mesh",
    "Platform",
    "PlatformMotion",
    "Pose",
    "PosePlan",
    "PoseVolume",
    "PosesFound",
    "QuarticLaw",
    "Rest",
    "Robot",
    "RobotAnswer",
    "RobotCycle",
    "RobotKernels",
    "SelfCalibration",
    "Sensitivities",
    "TrackerReceiver",
    "Workspace",
    "angles_of",
    "approximate_forces",
    "cables_of",
    "calibrate",
    "closed_form",
    "compiled",
    "distances",
    "distributed_forces",
    "dynamic_wrench",
    "fastest",
    "flat_pose",
    "forward",
    "geometry_of",
    "gravity_wrench",
    "grid_of",
    "home_of",
    "improved_closed_form",
    "inverse_dynamics",
    "lengths",
    "mesh_of",
    "motion_of",
    "next_poses",
    "pendulum_modes",
    "quadratic",
    "read_poses",
    "read_robot",
    "rest_poses",
    "robot_of",
    "robot_terms",
    "robot_with_effects",
    "robot_with_terms",
    "rotation_of",
    "self_calibrated",
    "sensitivities",
    "steepest_force",
    "structure_matrix",
    "swivel_angle",
    "swivel_sensitivities",
    "workspace_of",
    "wrap_angle",
    "wrench_feasibility",
    "write_calibrated",
    "write_mesh",
]

_NAMES = {
    "winchkit.bench.tracker": ("TrackerReceiver",),
    "winchkit.model.elastic": ("ElongationLaw", "ExponentialLaw", "LinearLaw", "QuarticLaw"),
    "winchkit.model.rotation": ("angles_of", "rotation_of"),
    "winchkit.robot.bench.computation": ("ComputationProcess",),
    "winchkit.robot.bench.platform": ("Platform",),
    "winchkit.robot.bench.self_calibration": ("PoseVolume", "SelfCalibration", "self_calibrated"),
    "winchkit.robot.calibration.calibrate": ("calibrate",),
    "winchkit.robot.calibration.pose_design": ("next_poses",),
    "winchkit.robot.calibration.profile": ("write_calibrated",),
    "winchkit.robot.diagnosis.diagnose": ("RobotAnswer",),
    "winchkit.robot.diagnosis.plan": ("PosePlan",),
    "winchkit.robot.dynamics.cycle": ("RobotCycle", "flat_pose"),
    "winchkit.robot.dynamics.dynamics": (
        "InverseDynamics",
        "PlatformMotion",
        "dynamic_wrench",
        "inverse_dynamics",
        "motion_of",
    ),
    "winchkit.robot.dynamics.dynamics_cycle": ("DynamicTarget", "DynamicsCycle"),
    "winchkit.robot.dynamics.elongation_correction": ("ElongationCorrection",),
    "winchkit.robot.dynamics.kernels": ("PLAIN", "RobotKernels", "compiled", "fastest"),
    "winchkit.robot.dynamics.rest": ("Rest", "pendulum_modes", "rest_poses"),
    "winchkit.robot.effects.bind": ("robot_terms", "robot_with_effects"),
    "winchkit.robot.effects.term": ("robot_with_terms",),
    "winchkit.robot.files.poses": ("read_poses",),
    "winchkit.robot.forces.force_distribution": (
        "Feasibility",
        "ForceLimits",
        "Forces",
        "approximate_forces",
        "closed_form",
        "distributed_forces",
        "improved_closed_form",
        "quadratic",
        "steepest_force",
        "wrench_feasibility",
    ),
    "winchkit.robot.geometry.forward": ("PosesFound", "forward"),
    "winchkit.robot.geometry.kinematics": (
        "Geometry",
        "Pose",
        "Sensitivities",
        "geometry_of",
        "home_of",
        "lengths",
        "sensitivities",
        "structure_matrix",
        "swivel_angle",
        "swivel_sensitivities",
        "wrap_angle",
    ),
    "winchkit.robot.geometry.robot": ("Robot", "cables_of", "robot_of"),
    "winchkit.robot.geometry.wrench": ("gravity_wrench",),
    "winchkit.robot.workspace.distances": ("Distances", "distances"),
    "winchkit.robot.workspace.mesh": ("Mesh", "mesh_of", "write_mesh"),
    "winchkit.robot.workspace.workspace": (
        "CableDemand",
        "Grid",
        "Workspace",
        "grid_of",
        "workspace_of",
    ),
    "winchkit.schema.read": ("read_robot",),
    "winchkit.schema.robot_bench": ("BodySpec",),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'winchkit.robot' has no attribute '{name}'")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
