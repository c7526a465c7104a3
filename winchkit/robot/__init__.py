"""Cable robots: many winches that move one platform.

``geometry``, ``forces`` and ``dynamics`` have the model, ``workspace`` where it holds the platform,
``identification`` and ``mistakes`` (of tables) what ``calibration`` and ``diagnosis`` share;
``bench`` moves the platform, ``sim`` simulates it; ``effects``, ``files``, ``report``, ``web`` and
``cli`` are the robot's parts of the packages of these names, and ``export`` writes a robot for
other programs. Each name is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.bench.tracker import TrackerReceiver as TrackerReceiver
    from winchkit.model.elastic import ElongationLaw as ElongationLaw
    from winchkit.model.elastic import ExponentialLaw as ExponentialLaw
    from winchkit.model.elastic import LinearLaw as LinearLaw
    from winchkit.model.elastic import QuarticLaw as QuarticLaw
    from winchkit.model.rotation import angles_of as angles_of
    from winchkit.model.rotation import rotation_of as rotation_of
    from winchkit.robot.bench.computation import ComputationProcess as ComputationProcess
    from winchkit.robot.bench.platform import Platform as Platform
    from winchkit.robot.bench.self_calibration import PoseVolume as PoseVolume
    from winchkit.robot.bench.self_calibration import SelfCalibration as SelfCalibration
    from winchkit.robot.bench.self_calibration import self_calibrated as self_calibrated
    from winchkit.robot.calibration.calibrate import calibrate as calibrate
    from winchkit.robot.calibration.pose_design import next_poses as next_poses
    from winchkit.robot.calibration.profile import write_calibrated as write_calibrated
    from winchkit.robot.diagnosis.diagnose import RobotAnswer as RobotAnswer
    from winchkit.robot.diagnosis.plan import PosePlan as PosePlan
    from winchkit.robot.dynamics.cycle import RobotCycle as RobotCycle
    from winchkit.robot.dynamics.cycle import flat_pose as flat_pose
    from winchkit.robot.dynamics.dynamics import InverseDynamics as InverseDynamics
    from winchkit.robot.dynamics.dynamics import PlatformMotion as PlatformMotion
    from winchkit.robot.dynamics.dynamics import dynamic_wrench as dynamic_wrench
    from winchkit.robot.dynamics.dynamics import inverse_dynamics as inverse_dynamics
    from winchkit.robot.dynamics.dynamics import motion_of as motion_of
    from winchkit.robot.dynamics.dynamics_cycle import DynamicsCycle as DynamicsCycle
    from winchkit.robot.dynamics.dynamics_cycle import DynamicTarget as DynamicTarget
    from winchkit.robot.dynamics.elongation_correction import (
        ElongationCorrection as ElongationCorrection,
    )
    from winchkit.robot.dynamics.kernels import PLAIN as PLAIN
    from winchkit.robot.dynamics.kernels import RobotKernels as RobotKernels
    from winchkit.robot.dynamics.kernels import compiled as compiled
    from winchkit.robot.dynamics.kernels import fastest as fastest
    from winchkit.robot.dynamics.rest import Rest as Rest
    from winchkit.robot.dynamics.rest import pendulum_modes as pendulum_modes
    from winchkit.robot.dynamics.rest import rest_poses as rest_poses
    from winchkit.robot.effects.bind import robot_terms as robot_terms
    from winchkit.robot.effects.bind import robot_with_effects as robot_with_effects
    from winchkit.robot.effects.term import robot_with_terms as robot_with_terms
    from winchkit.robot.files.poses import read_poses as read_poses
    from winchkit.robot.forces.force_distribution import Feasibility as Feasibility
    from winchkit.robot.forces.force_distribution import ForceLimits as ForceLimits
    from winchkit.robot.forces.force_distribution import Forces as Forces
    from winchkit.robot.forces.force_distribution import approximate_forces as approximate_forces
    from winchkit.robot.forces.force_distribution import closed_form as closed_form
    from winchkit.robot.forces.force_distribution import distributed_forces as distributed_forces
    from winchkit.robot.forces.force_distribution import (
        improved_closed_form as improved_closed_form,
    )
    from winchkit.robot.forces.force_distribution import quadratic as quadratic
    from winchkit.robot.forces.force_distribution import steepest_force as steepest_force
    from winchkit.robot.forces.force_distribution import wrench_feasibility as wrench_feasibility
    from winchkit.robot.geometry.forward import PosesFound as PosesFound
    from winchkit.robot.geometry.forward import forward as forward
    from winchkit.robot.geometry.kinematics import Geometry as Geometry
    from winchkit.robot.geometry.kinematics import Pose as Pose
    from winchkit.robot.geometry.kinematics import Sensitivities as Sensitivities
    from winchkit.robot.geometry.kinematics import geometry_of as geometry_of
    from winchkit.robot.geometry.kinematics import home_of as home_of
    from winchkit.robot.geometry.kinematics import lengths as lengths
    from winchkit.robot.geometry.kinematics import sensitivities as sensitivities
    from winchkit.robot.geometry.kinematics import structure_matrix as structure_matrix
    from winchkit.robot.geometry.kinematics import swivel_angle as swivel_angle
    from winchkit.robot.geometry.kinematics import swivel_sensitivities as swivel_sensitivities
    from winchkit.robot.geometry.kinematics import wrap_angle as wrap_angle
    from winchkit.robot.geometry.robot import Robot as Robot
    from winchkit.robot.geometry.robot import cables_of as cables_of
    from winchkit.robot.geometry.robot import robot_of as robot_of
    from winchkit.robot.geometry.wrench import gravity_wrench as gravity_wrench
    from winchkit.robot.workspace.distances import Distances as Distances
    from winchkit.robot.workspace.distances import distances as distances
    from winchkit.robot.workspace.mesh import Mesh as Mesh
    from winchkit.robot.workspace.mesh import mesh_of as mesh_of
    from winchkit.robot.workspace.mesh import write_mesh as write_mesh
    from winchkit.robot.workspace.workspace import CableDemand as CableDemand
    from winchkit.robot.workspace.workspace import Grid as Grid
    from winchkit.robot.workspace.workspace import Workspace as Workspace
    from winchkit.robot.workspace.workspace import grid_of as grid_of
    from winchkit.robot.workspace.workspace import workspace_of as workspace_of
    from winchkit.schema.read import read_robot as read_robot
    from winchkit.schema.robot_bench import BodySpec as BodySpec

_HOME = homes(
    {
        "winchkit.bench.tracker": "TrackerReceiver",
        "winchkit.model.elastic": "ElongationLaw ExponentialLaw LinearLaw QuarticLaw",
        "winchkit.model.rotation": "angles_of rotation_of",
        "winchkit.robot.bench.computation": "ComputationProcess",
        "winchkit.robot.bench.platform": "Platform",
        "winchkit.robot.bench.self_calibration": "PoseVolume SelfCalibration self_calibrated",
        "winchkit.robot.calibration.calibrate": "calibrate",
        "winchkit.robot.calibration.pose_design": "next_poses",
        "winchkit.robot.calibration.profile": "write_calibrated",
        "winchkit.robot.diagnosis.diagnose": "RobotAnswer",
        "winchkit.robot.diagnosis.plan": "PosePlan",
        "winchkit.robot.dynamics.cycle": "RobotCycle flat_pose",
        "winchkit.robot.dynamics.dynamics": (
            "InverseDynamics PlatformMotion dynamic_wrench inverse_dynamics motion_of"
        ),
        "winchkit.robot.dynamics.dynamics_cycle": "DynamicTarget DynamicsCycle",
        "winchkit.robot.dynamics.elongation_correction": "ElongationCorrection",
        "winchkit.robot.dynamics.kernels": "PLAIN RobotKernels compiled fastest",
        "winchkit.robot.dynamics.rest": "Rest pendulum_modes rest_poses",
        "winchkit.robot.effects.bind": "robot_terms robot_with_effects",
        "winchkit.robot.effects.term": "robot_with_terms",
        "winchkit.robot.files.poses": "read_poses",
        "winchkit.robot.forces.force_distribution": (
            "Feasibility ForceLimits Forces approximate_forces closed_form distributed_forces "
            "improved_closed_form quadratic steepest_force wrench_feasibility"
        ),
        "winchkit.robot.geometry.forward": "PosesFound forward",
        "winchkit.robot.geometry.kinematics": (
            "Geometry Pose Sensitivities geometry_of home_of lengths sensitivities "
            "structure_matrix swivel_angle swivel_sensitivities wrap_angle"
        ),
        "winchkit.robot.geometry.robot": "Robot cables_of robot_of",
        "winchkit.robot.geometry.wrench": "gravity_wrench",
        "winchkit.robot.workspace.distances": "Distances distances",
        "winchkit.robot.workspace.mesh": "Mesh mesh_of write_mesh",
        "winchkit.robot.workspace.workspace": "CableDemand Grid Workspace grid_of workspace_of",
        "winchkit.schema.read": "read_robot",
        "winchkit.schema.robot_bench": "BodySpec",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
