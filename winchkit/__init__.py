"""winchkit: winch and load-cell drivers, winch models, and diagnosis of missing physical effects.

The public names are below, described in docs/api.md; each is imported when it is first used, so
that ``import winchkit`` loads no numpy. Robots have theirs in ``winchkit.robot``, fleets in
``winchkit.fleet``. ``winchkit.effects``, ``winchkit.model`` and ``winchkit.testing`` are for those
who extend it.
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
    from winchkit.bench.cells.results import CellInfo, CellRate, CellTare
    from winchkit.bench.commissioning.procedure import commission
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
    from winchkit.calibration.cell.files import read_points
    from winchkit.calibration.cell.fit import fit_cell
    from winchkit.calibration.cell.recordings import CellFindings, recorded_cell_health
    from winchkit.calibration.cell.static_effects import static_effects
    from winchkit.catalog import find
    from winchkit.cli.files.check import check
    from winchkit.diagnosis.add import add, remove
    from winchkit.diagnosis.compare import compare
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.new_effect import new_effect
    from winchkit.diagnosis.plan import plan
    from winchkit.diagnosis.write import write_addition, write_removal
    from winchkit.drivers.can.tools.decoded_trace import DecodedTrace, decode_trace
    from winchkit.dynamics.export import export_model
    from winchkit.dynamics.forward import forward
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
    from winchkit.model.sizing.sizing import sized
    from winchkit.profile_edit.history import ladder
    from winchkit.profile_edit.ledger import undo
    from winchkit.profile_edit.naming import extended_name
    from winchkit.profile_edit.new_profile import new_profile
    from winchkit.runs.export import export
    from winchkit.runs.importing.session import import_runs
    from winchkit.runs.info import info_of
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
        read_simbench,
        read_size,
    )
    from winchkit.sim.bench import ListedBench, listed_benches
    from winchkit.sim.clock.simulated_clock import SimulatedClock
    from winchkit.sim.live.bench import LiveBench
    from winchkit.sim.record import simulate
    from winchkit.web.server import serve

__all__ = [
    "Bench",
    "BenchSnapshot",
    "CellFindings",
    "CellInfo",
    "CellRate",
    "CellTare",
    "ConnectionLost",
    "DahlEstimator",
    "DecodedTrace",
    "DeviceRefused",
    "DriveFault",
    "Effect",
    "Fault",
    "FileError",
    "LimitTripped",
    "ListedBench",
    "LiveBench",
    "MotionError",
    "NoReply",
    "NotPermitted",
    "Parameter",
    "Run",
    "RunError",
    "SimulatedClock",
    "UsageError",
    "WinchkitError",
    "__version__",
    "add",
    "attach",
    "bus_load",
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
    "config_diff",
    "config_load",
    "config_restore",
    "config_save",
    "config_store",
    "decode_trace",
    "diagnose",
    "drive_info",
    "export",
    "export_model",
    "extended_name",
    "find",
    "fit_cell",
    "forward",
    "identify_dahl",
    "import_runs",
    "info_of",
    "ladder",
    "listed_benches",
    "load_catalogue",
    "lss_identify",
    "lss_list",
    "lss_set",
    "new_effect",
    "new_profile",
    "open_bench",
    "open_replay",
    "open_writer",
    "plan",
    "read_bench",
    "read_log",
    "read_mapping",
    "read_points",
    "read_profile",
    "read_programme",
    "read_run",
    "read_simbench",
    "read_size",
    "recorded_cell_health",
    "recover",
    "remove",
    "run_of",
    "run_programme",
    "scan",
    "serve",
    "simulate",
    "sized",
    "static_effects",
    "stop_on_bus",
    "undo",
    "write_addition",
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
    "winchkit.bench.cells.results": ("CellInfo", "CellRate", "CellTare"),
    "winchkit.bench.commissioning.procedure": ("commission",),
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
    "winchkit.catalog": ("find",),
    "winchkit.cli.files.check": ("check",),
    "winchkit.diagnosis.add": ("add", "remove"),
    "winchkit.diagnosis.compare": ("compare",),
    "winchkit.diagnosis.diagnose": ("diagnose",),
    "winchkit.diagnosis.new_effect": ("new_effect",),
    "winchkit.diagnosis.plan": ("plan",),
    "winchkit.diagnosis.write": ("write_addition", "write_removal"),
    "winchkit.drivers.can.tools.decoded_trace": ("DecodedTrace", "decode_trace"),
    "winchkit.dynamics.export": ("export_model",),
    "winchkit.dynamics.forward": ("forward",),
    "winchkit.effects.catalogue": ("load_catalogue",),
    "winchkit.effects.effect": ("Effect", "Parameter"),
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
    "winchkit.model.sizing.sizing": ("sized",),
    "winchkit.profile_edit.history": ("ladder",),
    "winchkit.profile_edit.ledger": ("undo",),
    "winchkit.profile_edit.naming": ("extended_name",),
    "winchkit.profile_edit.new_profile": ("new_profile",),
    "winchkit.runs.export": ("export",),
    "winchkit.runs.importing.session": ("import_runs",),
    "winchkit.runs.info": ("info_of",),
    "winchkit.runs.read": ("read_log", "read_run"),
    "winchkit.runs.recover": ("recover",),
    "winchkit.runs.run": ("Run",),
    "winchkit.runs.tables": ("run_of",),
    "winchkit.runs.writer": ("open_writer", "write_run"),
    "winchkit.schema.programme": ("write_programme",),
    "winchkit.schema.read": (
        "read_bench",
        "read_mapping",
        "read_profile",
        "read_programme",
        "read_simbench",
        "read_size",
    ),
    "winchkit.sim.bench": ("ListedBench", "listed_benches"),
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
