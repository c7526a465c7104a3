"""winchkit: winch and load-cell drivers, winch models, and diagnosis of missing physical effects.

The public names are below, described in docs/api.md; each is imported when it is first used, so
that ``import winchkit`` loads no numpy. ``winchkit.effects``, ``winchkit.model`` and
``winchkit.testing`` are for those who extend it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from winchkit.rendering import renderers
from winchkit.version import __version__

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench
    from winchkit.bench.control.snapshot import BenchSnapshot
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.session import attach
    from winchkit.calibration.robot.calibrate import calibrate
    from winchkit.catalog import find
    from winchkit.diagnosis.add import add
    from winchkit.diagnosis.compare import compare
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.plan import plan
    from winchkit.diagnosis.write import write_addition
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.effects.effect import Effect, Parameter
    from winchkit.errors import (
        ConnectionLost,
        DeviceRefused,
        DriveFault,
        Fault,
        FileError,
        LimitTripped,
        MotionError,
        NoReply,
        NotPermitted,
        RunError,
        UsageError,
        WinchkitError,
    )
    from winchkit.estimation.dahl import DahlEstimator
    from winchkit.estimation.dahl_identification import identify_dahl
    from winchkit.estimation.elongation import ElongationCorrection
    from winchkit.model.robot.cycle import RobotCycle
    from winchkit.model.robot.force_distribution import ForceLimits
    from winchkit.model.robot.kinematics import Pose
    from winchkit.model.robot.robot import Robot, robot_of
    from winchkit.runs.poses import read_poses
    from winchkit.runs.read import read_run
    from winchkit.runs.run import Run
    from winchkit.runs.writer import open_writer, write_run
    from winchkit.schema.read import (
        read_axis,
        read_bench,
        read_profile,
        read_programme,
        read_robot,
        read_simbench,
    )
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench
    from winchkit.sim.record import simulate

__all__ = [
    "Bench",
    "BenchSnapshot",
    "ConnectionLost",
    "DahlEstimator",
    "DeviceRefused",
    "DriveFault",
    "Effect",
    "ElongationCorrection",
    "Fault",
    "FileError",
    "ForceLimits",
    "LimitTripped",
    "LiveBench",
    "MotionError",
    "NoReply",
    "NotPermitted",
    "Parameter",
    "Pose",
    "Robot",
    "RobotCycle",
    "Run",
    "RunError",
    "SimulatedClock",
    "UsageError",
    "WinchkitError",
    "__version__",
    "add",
    "attach",
    "calibrate",
    "compare",
    "diagnose",
    "find",
    "identify_dahl",
    "load_catalogue",
    "open_bench",
    "open_writer",
    "plan",
    "read_axis",
    "read_bench",
    "read_poses",
    "read_profile",
    "read_programme",
    "read_robot",
    "read_run",
    "read_simbench",
    "robot_of",
    "simulate",
    "write_addition",
    "write_run",
]

_NAMES = {
    "winchkit.bench.bench": ("Bench",),
    "winchkit.bench.control.snapshot": ("BenchSnapshot",),
    "winchkit.bench.open": ("open_bench",),
    "winchkit.bench.remote.session": ("attach",),
    "winchkit.calibration.robot.calibrate": ("calibrate",),
    "winchkit.catalog": ("find",),
    "winchkit.diagnosis.add": ("add",),
    "winchkit.diagnosis.compare": ("compare",),
    "winchkit.diagnosis.diagnose": ("diagnose",),
    "winchkit.diagnosis.plan": ("plan",),
    "winchkit.diagnosis.write": ("write_addition",),
    "winchkit.effects.catalogue": ("load_catalogue",),
    "winchkit.effects.effect": (
        "Effect",
        "Parameter",
    ),
    "winchkit.errors": (
        "ConnectionLost",
        "DeviceRefused",
        "DriveFault",
        "Fault",
        "FileError",
        "LimitTripped",
        "MotionError",
        "NoReply",
        "NotPermitted",
        "RunError",
        "UsageError",
        "WinchkitError",
    ),
    "winchkit.estimation.dahl": ("DahlEstimator",),
    "winchkit.estimation.dahl_identification": ("identify_dahl",),
    "winchkit.estimation.elongation": ("ElongationCorrection",),
    "winchkit.model.robot.cycle": ("RobotCycle",),
    "winchkit.model.robot.force_distribution": ("ForceLimits",),
    "winchkit.model.robot.kinematics": ("Pose",),
    "winchkit.model.robot.robot": (
        "Robot",
        "robot_of",
    ),
    "winchkit.runs.poses": ("read_poses",),
    "winchkit.runs.read": ("read_run",),
    "winchkit.runs.run": ("Run",),
    "winchkit.runs.writer": (
        "open_writer",
        "write_run",
    ),
    "winchkit.schema.read": (
        "read_bench",
        "read_profile",
        "read_programme",
        "read_axis",
        "read_robot",
        "read_simbench",
    ),
    "winchkit.sim.clock.simulated_clock": ("SimulatedClock",),
    "winchkit.sim.live.bench": ("LiveBench",),
    "winchkit.sim.record": ("simulate",),
}
# This package contains the results and their renderers, which know nothing of each other.
renderers.load_from("winchkit.report.notebook.register")
_HOME = {name: module for module, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'winchkit' has no attribute '{name}'")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
