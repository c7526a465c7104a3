"""Types that the public functions of robots take and return, for annotations.

Each is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.robot.bench.computation import Computation as Computation
    from winchkit.robot.bench.platform_correction import HeldValues as HeldValues
    from winchkit.robot.bench.trajectory import PlatformTrajectory as PlatformTrajectory
    from winchkit.robot.calibration.calibrate import Calibrated as Calibrated
    from winchkit.robot.calibration.options import Options as Options
    from winchkit.robot.calibration.pose_design import NextPose as NextPose
    from winchkit.robot.calibration.profile import Provenance as Provenance
    from winchkit.robot.diagnosis.diagnose import RobotSelection as RobotSelection
    from winchkit.robot.diagnosis.engine import PoseSelection as PoseSelection
    from winchkit.robot.diagnosis.pose_design import PoseOffer as PoseOffer
    from winchkit.robot.dynamics.elongation_correction import Stretch as Stretch
    from winchkit.robot.files.poses import MeasuredPoses as MeasuredPoses
    from winchkit.robot.geometry.loops import CableLine as CableLine
    from winchkit.robot.geometry.tracker import Tracker as Tracker

_HOME = homes(
    {
        "winchkit.robot.bench.computation": "Computation",
        "winchkit.robot.bench.platform_correction": "HeldValues",
        "winchkit.robot.bench.trajectory": "PlatformTrajectory",
        "winchkit.robot.calibration.calibrate": "Calibrated",
        "winchkit.robot.calibration.options": "Options",
        "winchkit.robot.calibration.pose_design": "NextPose",
        "winchkit.robot.calibration.profile": "Provenance",
        "winchkit.robot.diagnosis.diagnose": "RobotSelection",
        "winchkit.robot.diagnosis.engine": "PoseSelection",
        "winchkit.robot.diagnosis.pose_design": "PoseOffer",
        "winchkit.robot.dynamics.elongation_correction": "Stretch",
        "winchkit.robot.files.poses": "MeasuredPoses",
        "winchkit.robot.geometry.loops": "CableLine",
        "winchkit.robot.geometry.tracker": "Tracker",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
