"""winchkit: winch and load-cell drivers, winch models, and diagnosis of missing physical effects.

The public names are below, described in docs/api.md; each is imported when it is first used, so
that ``import winchkit`` loads no numpy. Robots have theirs in ``winchkit.robot``, fleets in
``winchkit.fleet``, types for annotations in ``winchkit.types``. ``winchkit.effects``,
``winchkit.model`` and ``winchkit.testing`` are for those who extend it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.rendering import renderers
from winchkit.version import __version__ as __version__
from winchkit.wings import homes, lazy

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench as Bench
    from winchkit.bench.cells.calls import cell_health as cell_health
    from winchkit.bench.cells.calls import cell_info as cell_info
    from winchkit.bench.cells.calls import cell_rate as cell_rate
    from winchkit.bench.cells.calls import cell_store as cell_store
    from winchkit.bench.cells.calls import cell_tare as cell_tare
    from winchkit.bench.cells.calls import cell_zero as cell_zero
    from winchkit.bench.cells.results import CellInfo as CellInfo
    from winchkit.bench.cells.results import CellRate as CellRate
    from winchkit.bench.cells.results import CellTare as CellTare
    from winchkit.bench.commissioning.procedure import commission as commission
    from winchkit.bench.control.snapshot import BenchSnapshot as BenchSnapshot
    from winchkit.bench.drives.calls import bus_load as bus_load
    from winchkit.bench.drives.calls import can_bus as can_bus
    from winchkit.bench.drives.calls import config_diff as config_diff
    from winchkit.bench.drives.calls import config_load as config_load
    from winchkit.bench.drives.calls import config_restore as config_restore
    from winchkit.bench.drives.calls import config_save as config_save
    from winchkit.bench.drives.calls import config_store as config_store
    from winchkit.bench.drives.calls import drive_info as drive_info
    from winchkit.bench.drives.calls import lss_identify as lss_identify
    from winchkit.bench.drives.calls import lss_list as lss_list
    from winchkit.bench.drives.calls import lss_set as lss_set
    from winchkit.bench.drives.calls import scan as scan
    from winchkit.bench.emergency_stop import stop_on_bus as stop_on_bus
    from winchkit.bench.open import open_bench as open_bench
    from winchkit.bench.programme import run_programme as run_programme
    from winchkit.bench.recording.replay import open_replay as open_replay
    from winchkit.bench.remote.session import attach as attach
    from winchkit.calibration.cell.files import read_points as read_points
    from winchkit.calibration.cell.fit import fit_cell as fit_cell
    from winchkit.calibration.cell.recordings import CellFindings as CellFindings
    from winchkit.calibration.cell.recordings import recorded_cell_health as recorded_cell_health
    from winchkit.calibration.cell.static_effects import static_effects as static_effects
    from winchkit.catalog import find as find
    from winchkit.cli.files.check import check as check
    from winchkit.diagnosis.add import add as add
    from winchkit.diagnosis.add import remove as remove
    from winchkit.diagnosis.compare import compare as compare
    from winchkit.diagnosis.diagnose import diagnose as diagnose
    from winchkit.diagnosis.new_effect import new_effect as new_effect
    from winchkit.diagnosis.plan import plan as plan
    from winchkit.diagnosis.write import write_addition as write_addition
    from winchkit.diagnosis.write import write_removal as write_removal
    from winchkit.drivers.can.tools.decoded_trace import DecodedTrace as DecodedTrace
    from winchkit.drivers.can.tools.decoded_trace import decode_trace as decode_trace
    from winchkit.dynamics.export import export_model as export_model
    from winchkit.dynamics.forward import forward as forward
    from winchkit.effects.catalogue import load_catalogue as load_catalogue
    from winchkit.effects.effect import Effect as Effect
    from winchkit.effects.effect import Parameter as Parameter
    from winchkit.errors import ConnectionLost as ConnectionLost
    from winchkit.errors import DeviceRefused as DeviceRefused
    from winchkit.errors import DriveFault as DriveFault
    from winchkit.errors import Fault as Fault
    from winchkit.errors import FileError as FileError
    from winchkit.errors import LimitTripped as LimitTripped
    from winchkit.errors import MotionError as MotionError
    from winchkit.errors import NoReply as NoReply
    from winchkit.errors import NotPermitted as NotPermitted
    from winchkit.errors import RunError as RunError
    from winchkit.errors import UsageError as UsageError
    from winchkit.errors import WinchkitError as WinchkitError
    from winchkit.estimation.dahl import DahlEstimator as DahlEstimator
    from winchkit.estimation.dahl_identification import identify_dahl as identify_dahl
    from winchkit.model.sizing.sizing import sized as sized
    from winchkit.profile_edit.history import ledger as ledger
    from winchkit.profile_edit.ledger import undo as undo
    from winchkit.profile_edit.naming import extended_name as extended_name
    from winchkit.profile_edit.new_profile import new_profile as new_profile
    from winchkit.runs.export import export as export
    from winchkit.runs.importing.session import import_runs as import_runs
    from winchkit.runs.info import info_of as info_of
    from winchkit.runs.read import read_log as read_log
    from winchkit.runs.read import read_run as read_run
    from winchkit.runs.recover import recover as recover
    from winchkit.runs.run import Run as Run
    from winchkit.runs.tables import run_of as run_of
    from winchkit.runs.writer import open_writer as open_writer
    from winchkit.runs.writer import write_run as write_run
    from winchkit.schema.read import read_bench as read_bench
    from winchkit.schema.read import read_mapping as read_mapping
    from winchkit.schema.read import read_profile as read_profile
    from winchkit.schema.read import read_programme as read_programme
    from winchkit.schema.read import read_simbench as read_simbench
    from winchkit.schema.read import read_size as read_size
    from winchkit.schema.write import write_profile as write_profile
    from winchkit.schema.write import write_programme as write_programme
    from winchkit.sim.bench import ListedBench as ListedBench
    from winchkit.sim.bench import listed_benches as listed_benches
    from winchkit.sim.clock.simulated_clock import SimulatedClock as SimulatedClock
    from winchkit.sim.live.bench import LiveBench as LiveBench
    from winchkit.sim.record import simulate as simulate
    from winchkit.web.server import serve as serve

_HOME = homes(
    {
        "winchkit.bench.bench": "Bench",
        "winchkit.bench.cells.calls": (
            "cell_health cell_info cell_rate cell_store cell_tare cell_zero"
        ),
        "winchkit.bench.cells.results": "CellInfo CellRate CellTare",
        "winchkit.bench.commissioning.procedure": "commission",
        "winchkit.bench.control.snapshot": "BenchSnapshot",
        "winchkit.bench.drives.calls": (
            "bus_load can_bus config_diff config_load config_restore config_save config_store "
            "drive_info lss_identify lss_list lss_set scan"
        ),
        "winchkit.bench.emergency_stop": "stop_on_bus",
        "winchkit.bench.open": "open_bench",
        "winchkit.bench.programme": "run_programme",
        "winchkit.bench.recording.replay": "open_replay",
        "winchkit.bench.remote.session": "attach",
        "winchkit.calibration.cell.recordings": "CellFindings recorded_cell_health",
        "winchkit.calibration.cell.files": "read_points",
        "winchkit.calibration.cell.fit": "fit_cell",
        "winchkit.calibration.cell.static_effects": "static_effects",
        "winchkit.catalog": "find",
        "winchkit.cli.files.check": "check",
        "winchkit.diagnosis.add": "add remove",
        "winchkit.diagnosis.compare": "compare",
        "winchkit.diagnosis.diagnose": "diagnose",
        "winchkit.diagnosis.new_effect": "new_effect",
        "winchkit.diagnosis.plan": "plan",
        "winchkit.diagnosis.write": "write_addition write_removal",
        "winchkit.drivers.can.tools.decoded_trace": "DecodedTrace decode_trace",
        "winchkit.dynamics.export": "export_model",
        "winchkit.dynamics.forward": "forward",
        "winchkit.effects.catalogue": "load_catalogue",
        "winchkit.effects.effect": "Effect Parameter",
        "winchkit.errors": (
            "ConnectionLost DeviceRefused DriveFault Fault FileError LimitTripped MotionError "
            "NoReply NotPermitted RunError UsageError WinchkitError"
        ),
        "winchkit.estimation.dahl": "DahlEstimator",
        "winchkit.estimation.dahl_identification": "identify_dahl",
        "winchkit.model.sizing.sizing": "sized",
        "winchkit.profile_edit.history": "ledger",
        "winchkit.profile_edit.ledger": "undo",
        "winchkit.profile_edit.naming": "extended_name",
        "winchkit.profile_edit.new_profile": "new_profile",
        "winchkit.runs.export": "export",
        "winchkit.runs.importing.session": "import_runs",
        "winchkit.runs.info": "info_of",
        "winchkit.runs.read": "read_log read_run",
        "winchkit.runs.recover": "recover",
        "winchkit.runs.run": "Run",
        "winchkit.runs.tables": "run_of",
        "winchkit.runs.writer": "open_writer write_run",
        "winchkit.schema.read": (
            "read_bench read_mapping read_profile read_programme read_simbench read_size"
        ),
        "winchkit.schema.write": "write_profile write_programme",
        "winchkit.sim.bench": "ListedBench listed_benches",
        "winchkit.sim.clock.simulated_clock": "SimulatedClock",
        "winchkit.sim.live.bench": "LiveBench",
        "winchkit.sim.record": "simulate",
        "winchkit.version": "__version__",
        "winchkit.web.server": "serve",
    }
)
__all__ = list(_HOME)
__getattr__, __dir__ = lazy(globals(), _HOME)
# This package contains the results and their renderers, which know nothing of each other.
renderers.load_from("winchkit.report.notebook.register")
