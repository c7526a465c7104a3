"""Types that the public functions take and return, for annotations and profiles made in Python.

Functions are in ``winchkit``. Types of robots are in ``winchkit.robot.types``, of fleets in
``winchkit.fleet.types``; each is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.bench.bench import Stations as Stations
    from winchkit.bench.cells.results import CellExchange as CellExchange
    from winchkit.bench.cells.results import CellTares as CellTares
    from winchkit.bench.cells.results import CellTiming as CellTiming
    from winchkit.bench.cells.results import CellValue as CellValue
    from winchkit.bench.commissioning.record import CommissioningRecord as CommissioningRecord
    from winchkit.bench.control.homing_motion import HomingRequest as HomingRequest
    from winchkit.bench.control.snapshot import Direction as Direction
    from winchkit.bench.control.snapshot import Trip as Trip
    from winchkit.bench.control.snapshot import WinchSnapshot as WinchSnapshot
    from winchkit.bench.emergency_stop import Stopped as Stopped
    from winchkit.bench.ownership import Ownership as Ownership
    from winchkit.bench.recording.replay import Replay as Replay
    from winchkit.bench.remote.client import RemoteStation as RemoteStation
    from winchkit.bench.tracker import TrackedPose as TrackedPose
    from winchkit.bench.winch import Winch as Winch
    from winchkit.calibration.cell.files import PointFile as PointFile
    from winchkit.calibration.cell.fit import CellFit as CellFit
    from winchkit.calibration.cell.health import Health as Health
    from winchkit.calibration.cell.static_effects import StaticDiagnosis as StaticDiagnosis
    from winchkit.can_trace import TraceFrame as TraceFrame
    from winchkit.cli.files.check import Verdict as Verdict
    from winchkit.diagnosis.add import Addition as Addition
    from winchkit.diagnosis.add import Removal as Removal
    from winchkit.diagnosis.diagnose import Answer as Answer
    from winchkit.diagnosis.diagnose import WinchAnswer as WinchAnswer
    from winchkit.diagnosis.plan import Plan as Plan
    from winchkit.diagnosis.results import Comparison as Comparison
    from winchkit.diagnosis.results import RobotDiagnosis as RobotDiagnosis
    from winchkit.diagnosis.verdict.equivalence import EquivalenceSet as EquivalenceSet
    from winchkit.drivers.can.bus.load import BusLoad as BusLoad
    from winchkit.drivers.can.canopen.identity import Identity as Identity
    from winchkit.drivers.can.tools.config import Difference as Difference
    from winchkit.drivers.can.tools.decode import DecodedFrame as DecodedFrame
    from winchkit.drivers.can.tools.info import DriveInfo as DriveInfo
    from winchkit.drivers.can.tools.scan import ScannedNode as ScannedNode
    from winchkit.drivers.can.tools.trace_decoder import TracedNode as TracedNode
    from winchkit.drivers.clock import Clock as Clock
    from winchkit.drivers.counters import Latency as Latency
    from winchkit.dynamics.export import ExportedModel as ExportedModel
    from winchkit.effects.effect import Dynamics as Dynamics
    from winchkit.effects.effect import Plausible as Plausible
    from winchkit.estimation.dahl_identification import Identified as Identified
    from winchkit.estimation.dahl_identification import PulleyRecord as PulleyRecord
    from winchkit.model.derivatives import SamplingTimes as SamplingTimes
    from winchkit.model.line import Line as Line
    from winchkit.model.sizing.row import Row as Row
    from winchkit.profile_edit.history import HistoryStep as HistoryStep
    from winchkit.runs.info import LogInfo as LogInfo
    from winchkit.runs.log import Log as Log
    from winchkit.runs.recover import Recovered as Recovered
    from winchkit.runs.run import Channel as Channel
    from winchkit.runs.run_writer import RunWriter as RunWriter
    from winchkit.schema.bench import BenchSpec as BenchSpec
    from winchkit.schema.bench import LimitSpec as LimitSpec
    from winchkit.schema.calibration import CalibrationPoint as CalibrationPoint
    from winchkit.schema.mapping import ImportMapping as ImportMapping
    from winchkit.schema.profiles.axis import AxisProfile as AxisProfile
    from winchkit.schema.profiles.control import ControlSpec as ControlSpec
    from winchkit.schema.profiles.robot import PlatformSpec as PlatformSpec
    from winchkit.schema.profiles.robot import RobotProfile as RobotProfile
    from winchkit.schema.profiles.sizing import SizeSpec as SizeSpec
    from winchkit.schema.profiles.winch import CableSpec as CableSpec
    from winchkit.schema.profiles.winch import DrumSpec as DrumSpec
    from winchkit.schema.profiles.winch import EffectTable as EffectTable
    from winchkit.schema.profiles.winch import GearboxSpec as GearboxSpec
    from winchkit.schema.profiles.winch import GuideSpec as GuideSpec
    from winchkit.schema.profiles.winch import MotorSpec as MotorSpec
    from winchkit.schema.profiles.winch import PathSpec as PathSpec
    from winchkit.schema.profiles.winch import PulleySpec as PulleySpec
    from winchkit.schema.profiles.winch import ReferenceSpec as ReferenceSpec
    from winchkit.schema.profiles.winch import WinchProfile as WinchProfile
    from winchkit.schema.programme import Programme as Programme
    from winchkit.schema.programme import ProgrammeStep as ProgrammeStep
    from winchkit.schema.simbench import SimBench as SimBench
    from winchkit.sim.bench import ListedEffect as ListedEffect
    from winchkit.sim.clock.simulated_clock import SimulatedEvent as SimulatedEvent
    from winchkit.sim.clock.simulated_clock import SimulatedLock as SimulatedLock
    from winchkit.sim.clock.simulated_clock import SimulatedThread as SimulatedThread

_HOME = homes(
    {
        "winchkit.bench.bench": "Stations",
        "winchkit.bench.cells.results": "CellExchange CellTares CellTiming CellValue",
        "winchkit.bench.commissioning.record": "CommissioningRecord",
        "winchkit.bench.control.homing_motion": "HomingRequest",
        "winchkit.bench.control.snapshot": "Direction Trip WinchSnapshot",
        "winchkit.bench.emergency_stop": "Stopped",
        "winchkit.bench.ownership": "Ownership",
        "winchkit.bench.recording.replay": "Replay",
        "winchkit.bench.remote.client": "RemoteStation",
        "winchkit.bench.tracker": "TrackedPose",
        "winchkit.bench.winch": "Winch",
        "winchkit.calibration.cell.files": "PointFile",
        "winchkit.calibration.cell.fit": "CellFit",
        "winchkit.calibration.cell.health": "Health",
        "winchkit.calibration.cell.static_effects": "StaticDiagnosis",
        "winchkit.can_trace": "TraceFrame",
        "winchkit.cli.files.check": "Verdict",
        "winchkit.diagnosis.add": "Addition Removal",
        "winchkit.diagnosis.diagnose": "Answer WinchAnswer",
        "winchkit.diagnosis.plan": "Plan",
        "winchkit.diagnosis.results": "Comparison RobotDiagnosis",
        "winchkit.diagnosis.verdict.equivalence": "EquivalenceSet",
        "winchkit.drivers.counters": "Latency",
        "winchkit.drivers.can.bus.load": "BusLoad",
        "winchkit.drivers.can.canopen.identity": "Identity",
        "winchkit.drivers.can.tools.config": "Difference",
        "winchkit.drivers.can.tools.decode": "DecodedFrame",
        "winchkit.drivers.can.tools.info": "DriveInfo",
        "winchkit.drivers.can.tools.scan": "ScannedNode",
        "winchkit.drivers.can.tools.trace_decoder": "TracedNode",
        "winchkit.drivers.clock": "Clock",
        "winchkit.dynamics.export": "ExportedModel",
        "winchkit.effects.effect": "Dynamics Plausible",
        "winchkit.estimation.dahl_identification": "Identified PulleyRecord",
        "winchkit.model.derivatives": "SamplingTimes",
        "winchkit.model.line": "Line",
        "winchkit.model.sizing.row": "Row",
        "winchkit.profile_edit.history": "HistoryStep",
        "winchkit.runs.info": "LogInfo",
        "winchkit.runs.log": "Log",
        "winchkit.runs.recover": "Recovered",
        "winchkit.runs.run": "Channel",
        "winchkit.runs.run_writer": "RunWriter",
        "winchkit.schema.bench": "BenchSpec LimitSpec",
        "winchkit.schema.calibration": "CalibrationPoint",
        "winchkit.schema.mapping": "ImportMapping",
        "winchkit.schema.profiles.axis": "AxisProfile",
        "winchkit.schema.profiles.control": "ControlSpec",
        "winchkit.schema.profiles.robot": "PlatformSpec RobotProfile",
        "winchkit.schema.profiles.sizing": "SizeSpec",
        "winchkit.schema.profiles.winch": (
            "CableSpec DrumSpec EffectTable GearboxSpec GuideSpec MotorSpec PathSpec "
            "PulleySpec ReferenceSpec WinchProfile"
        ),
        "winchkit.schema.programme": "Programme ProgrammeStep",
        "winchkit.schema.simbench": "SimBench",
        "winchkit.sim.bench": "ListedEffect",
        "winchkit.sim.clock.simulated_clock": "SimulatedEvent SimulatedLock SimulatedThread",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
