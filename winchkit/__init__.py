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
    from winchkit.bench.cells.calls import (
        cell_health,
        cell_info,
        cell_rate,
        cell_store,
        cell_tare,
        cell_zero,
    )
    from winchkit.bench.commissioning.calls import commission
    from winchkit.bench.control.snapshot import BenchSnapshot
    from winchkit.bench.drives.calls import (
        bus_load,
        can_bus,
        config_diff,
        config_load,
        config_restore,
        config_save,
        config_store,
        drive_info,
        lss_identify,
        lss_list,
        lss_set,
        scan,
    )
    from winchkit.bench.emergency_stop import stop_on_bus
    from winchkit.bench.open import open_bench
    from winchkit.bench.programme import run_programme
    from winchkit.bench.recording.replay import open_replay
    from winchkit.bench.remote.session import attach
    from winchkit.bench.robot.computation import ComputationProcess
    from winchkit.bench.robot.self_calibration import PoseVolume, SelfCalibration, self_calibrated
    from winchkit.bench.robot.tracker import Tracker
    from winchkit.calibration.cell.files import read_points
    from winchkit.calibration.cell.fit import fit_cell
    from winchkit.calibration.cell.recordings import CellFindings, recorded_cell_health
    from winchkit.calibration.cell.static_effects import static_effects
    from winchkit.calibration.robot.calibrate import calibrate
    from winchkit.calibration.robot.pose_design import next_poses
    from winchkit.calibration.robot.profile import write_calibrated
    from winchkit.catalog import find
    from winchkit.cli.files.check import check
    from winchkit.diagnosis.add import add, remove
    from winchkit.diagnosis.compare import compare
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.fleet.diagnose import diagnose_each
    from winchkit.diagnosis.new_effect import new_effect
    from winchkit.diagnosis.plan import plan
    from winchkit.diagnosis.robot.add import add_to_robot, remove_from_robot
    from winchkit.diagnosis.robot.compare import compare_robot
    from winchkit.diagnosis.robot.diagnose import diagnose_robot
    from winchkit.diagnosis.robot.plan import plan_poses
    from winchkit.diagnosis.write import write_addition, write_removal
    from winchkit.drivers.can.tools.decoded_trace import DecodedTrace, decode_trace
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
    from winchkit.library.diagnose import diagnose_library
    from winchkit.library.history import LibraryHistory, library_history
    from winchkit.library.index import index_library
    from winchkit.library.query import library_estimates, library_runs, query_library
    from winchkit.model.robot.cycle import RobotCycle
    from winchkit.model.robot.force_distribution import ForceLimits
    from winchkit.model.robot.kinematics import Pose
    from winchkit.model.robot.robot import Robot, robot_of
    from winchkit.model.sizing.sizing import sized
    from winchkit.profile_edit.history import ladder
    from winchkit.profile_edit.ledger import undo
    from winchkit.profile_edit.naming import extended_name
    from winchkit.runs.export import export
    from winchkit.runs.info import info_of
    from winchkit.runs.poses import read_poses
    from winchkit.runs.read import read_log, read_run
    from winchkit.runs.recover import recover
    from winchkit.runs.run import Run
    from winchkit.runs.tables import run_of
    from winchkit.runs.writer import open_writer, write_run
    from winchkit.schema.programme import write_programme
    from winchkit.schema.read import (
        read_bench,
        read_mapping,
        read_profile,
        read_programme,
        read_robot,
        read_simbench,
        read_size,
    )
    from winchkit.sim.bench import listed_benches
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench
    from winchkit.sim.record import simulate
    from winchkit.web.server import serve

__all__ = [
    "Bench",
    "BenchSnapshot",
    "CellFindings",
    "ComputationProcess",
    "ConnectionLost",
    "DahlEstimator",
    "DecodedTrace",
    "DeviceRefused",
    "DriveFault",
    "Effect",
    "ElongationCorrection",
    "Fault",
    "FileError",
    "ForceLimits",
    "LibraryHistory",
    "LimitTripped",
    "LiveBench",
    "MotionError",
    "NoReply",
    "NotPermitted",
    "Parameter",
    "Pose",
    "PoseVolume",
    "Robot",
    "RobotCycle",
    "Run",
    "RunError",
    "SelfCalibration",
    "SimulatedClock",
    "Tracker",
    "UsageError",
    "WinchkitError",
    "__version__",
    "add",
    "add_to_robot",
    "attach",
    "bus_load",
    "calibrate",
    "can_bus",
    "cell_health",
    "cell_info",
    "cell_rate",
    "cell_store",
    "cell_tare",
    "cell_zero",
    "check",
    "commission",
    "compare",
    "compare_robot",
    "config_diff",
    "config_load",
    "config_restore",
    "config_save",
    "config_store",
    "decode_trace",
    "diagnose",
    "diagnose_each",
    "diagnose_library",
    "diagnose_robot",
    "drive_info",
    "export",
    "extended_name",
    "find",
    "fit_cell",
    "identify_dahl",
    "index_library",
    "info_of",
    "ladder",
    "library_estimates",
    "library_history",
    "library_runs",
    "listed_benches",
    "load_catalogue",
    "lss_identify",
    "lss_list",
    "lss_set",
    "new_effect",
    "next_poses",
    "open_bench",
    "open_replay",
    "open_writer",
    "plan",
    "plan_poses",
    "query_library",
    "read_bench",
    "read_log",
    "read_mapping",
    "read_points",
    "read_poses",
    "read_profile",
    "read_programme",
    "read_robot",
    "read_run",
    "read_simbench",
    "read_size",
    "recorded_cell_health",
    "recover",
    "remove",
    "remove_from_robot",
    "robot_of",
    "run_of",
    "run_programme",
    "scan",
    "self_calibrated",
    "serve",
    "simulate",
    "sized",
    "static_effects",
    "stop_on_bus",
    "undo",
    "write_addition",
    "write_calibrated",
    "write_programme",
    "write_removal",
    "write_run",
]

_NAMES = {
    "winchkit.bench.bench": ("Bench",),
    "winchkit.bench.cells.calls": (
        "cell_health",
        "cell_info",
        "cell_rate",
        "cell_store",
        "cell_tare",
        "cell_zero",
    ),
    "winchkit.bench.commissioning.calls": ("commission",),
    "winchkit.bench.robot.computation": ("ComputationProcess",),
    "winchkit.bench.robot.self_calibration": ("PoseVolume", "SelfCalibration", "self_calibrated"),
    "winchkit.bench.robot.tracker": ("Tracker",),
    "winchkit.bench.control.snapshot": ("BenchSnapshot",),
    "winchkit.bench.drives.calls": (
        "bus_load",
        "can_bus",
        "config_diff",
        "config_load",
        "config_restore",
        "config_save",
        "config_store",
        "drive_info",
        "lss_identify",
        "lss_list",
        "lss_set",
        "scan",
    ),
    "winchkit.bench.emergency_stop": ("stop_on_bus",),
    "winchkit.bench.open": ("open_bench",),
    "winchkit.bench.programme": ("run_programme",),
    "winchkit.bench.recording.replay": ("open_replay",),
    "winchkit.bench.remote.session": ("attach",),
    "winchkit.calibration.cell.recordings": ("CellFindings", "recorded_cell_health"),
    "winchkit.calibration.cell.files": ("read_points",),
    "winchkit.calibration.cell.fit": ("fit_cell",),
    "winchkit.calibration.cell.static_effects": ("static_effects",),
    "winchkit.calibration.robot.calibrate": ("calibrate",),
    "winchkit.calibration.robot.pose_design": ("next_poses",),
    "winchkit.calibration.robot.profile": ("write_calibrated",),
    "winchkit.catalog": ("find",),
    "winchkit.cli.files.check": ("check",),
    "winchkit.diagnosis.add": (
        "add",
        "remove",
    ),
    "winchkit.diagnosis.compare": ("compare",),
    "winchkit.diagnosis.diagnose": ("diagnose",),
    "winchkit.diagnosis.fleet.diagnose": ("diagnose_each",),
    "winchkit.diagnosis.new_effect": ("new_effect",),
    "winchkit.diagnosis.plan": ("plan",),
    "winchkit.diagnosis.robot.add": (
        "add_to_robot",
        "remove_from_robot",
    ),
    "winchkit.diagnosis.robot.compare": ("compare_robot",),
    "winchkit.diagnosis.robot.diagnose": ("diagnose_robot",),
    "winchkit.diagnosis.robot.plan": ("plan_poses",),
    "winchkit.diagnosis.write": (
        "write_addition",
        "write_removal",
    ),
    "winchkit.drivers.can.tools.decoded_trace": ("DecodedTrace", "decode_trace"),
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
    "winchkit.library.history": ("LibraryHistory", "library_history"),
    "winchkit.library.diagnose": ("diagnose_library",),
    "winchkit.library.index": ("index_library",),
    "winchkit.library.query": (
        "library_estimates",
        "library_runs",
        "query_library",
    ),
    "winchkit.model.robot.cycle": ("RobotCycle",),
    "winchkit.model.robot.force_distribution": ("ForceLimits",),
    "winchkit.model.robot.kinematics": ("Pose",),
    "winchkit.model.robot.robot": (
        "Robot",
        "robot_of",
    ),
    "winchkit.model.sizing.sizing": ("sized",),
    "winchkit.profile_edit.history": ("ladder",),
    "winchkit.profile_edit.ledger": ("undo",),
    "winchkit.profile_edit.naming": ("extended_name",),
    "winchkit.runs.export": ("export",),
    "winchkit.runs.info": ("info_of",),
    "winchkit.runs.poses": ("read_poses",),
    "winchkit.runs.read": (
        "read_log",
        "read_run",
    ),
    "winchkit.runs.recover": ("recover",),
    "winchkit.runs.run": ("Run",),
    "winchkit.runs.tables": ("run_of",),
    "winchkit.runs.writer": (
        "open_writer",
        "write_run",
    ),
    "winchkit.schema.programme": ("write_programme",),
    "winchkit.schema.read": (
        "read_bench",
        "read_mapping",
        "read_profile",
        "read_programme",
        "read_robot",
        "read_simbench",
        "read_size",
    ),
    "winchkit.sim.bench": ("listed_benches",),
    "winchkit.sim.clock.simulated_clock": ("SimulatedClock",),
    "winchkit.sim.live.bench": ("LiveBench",),
    "winchkit.sim.record": ("simulate",),
    "winchkit.web.server": ("serve",),
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
