"""Writes docs/api.md from the docstrings of the public names: ``python docs/make_api.py``."""

from __future__ import annotations

import inspect
from pathlib import Path

import winchkit

PAGE = Path(__file__).with_name("api.md")
SECTIONS = {
    "A bench": (
        *("open_bench", "attach", "Bench", "BenchSnapshot", "run_programme", "stop_on_bus"),
        *("commission",),
    ),
    "Instruments": (
        *("cell_info", "cell_rate", "cell_health", "cell_tare", "cell_zero", "cell_store"),
        *("read_points", "fit_cell", "static_effects"),
    ),
    "Drives": (
        *("can_bus", "scan", "drive_info", "bus_load"),
        *("config_save", "config_diff", "config_load", "config_store", "config_restore"),
        *("lss_list", "lss_identify", "lss_set"),
    ),
    "A simulated bench": ("LiveBench", "SimulatedClock", "simulate", "listed_benches"),
    "Files": (
        *("find", "check", "read_profile", "read_axis", "read_robot", "read_size"),
        *("read_bench", "read_programme", "write_programme", "read_simbench", "read_mapping"),
    ),
    "Runs": (
        *("read_run", "read_poses", "write_run", "open_writer", "Run", "run_of", "export"),
        *("read_log", "info_of", "recover", "open_replay"),
    ),
    "Diagnosis": (
        *("compare", "diagnose", "diagnose_each", "plan", "add", "remove"),
        *("write_addition", "write_removal", "undo", "ladder"),
        *("load_catalogue", "new_effect", "Effect", "Parameter", "sized"),
    ),
    "Cable robots": (
        *("robot_of", "Robot", "Pose", "RobotCycle", "ForceLimits"),
        *("calibrate", "next_poses", "write_calibrated"),
        *("compare_robot", "diagnose_robot", "plan_poses", "add_to_robot", "remove_from_robot"),
    ),
    "Estimators": ("DahlEstimator", "identify_dahl", "ElongationCorrection"),
    "Errors": (
        *("WinchkitError", "UsageError", "FileError", "Fault", "RunError", "ConnectionLost"),
        *("NoReply", "DeviceRefused", "MotionError", "DriveFault", "LimitTripped", "NotPermitted"),
    ),
}
"""Public names by subject; ``__version__`` is a text."""
_BEGIN = """\
# Public names

Written by `python docs/make_api.py` from the docstrings; do not edit it by hand.
`help(winchkit.open_bench)` shows parameters with units, results and errors.

```python
from winchkit import diagnose, read_profile, read_run
```

For effects of your own there are `winchkit.effects` and `winchkit.model.stages` besides, for
control loops `winchkit.model.robot` and `winchkit.estimation`, for tests `winchkit.testing`. Paths
of other modules may change with any version; [stability.md](stability.md) says what is promised,
and which call each command is. `import winchkit` loads no other package: a name is
imported when it is first used. `winchkit.__version__` is the version.
"""


def page() -> str:
    """The page: public names by subject, each with the first line of its docstring."""
    parts = [_BEGIN]
    for title, names in SECTIONS.items():
        parts.append(f"## {title}\n\n| name | what |\n|---|---|")
        parts += [f"| `{name}` | {_summary(name)} |" for name in names]
        parts.append("")
    return "\n".join(parts)


def _summary(name: str) -> str:
    first = (inspect.getdoc(getattr(winchkit, name)) or "").split("\n")[0]
    return first.replace("``", "`").removesuffix(".").replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
