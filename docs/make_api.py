"""Writes docs/api.md from the docstrings of the public names: ``python docs/make_api.py``."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

PAGE = Path(__file__).with_name("api.md")
SECTIONS = {
    "A bench": (
        *("open_bench", "attach", "Bench", "BenchSnapshot", "run_programme", "stop_on_bus"),
        *("commission",),
    ),
    "Instruments": (
        *("cell_info", "cell_rate", "cell_health", "cell_tare", "cell_zero", "cell_store"),
        *("recorded_cell_health", "CellFindings"),
        *("CellInfo", "CellRate", "CellTare", "read_points", "fit_cell", "static_effects"),
    ),
    "Drives": (
        *("can_bus", "scan", "drive_info", "bus_load"),
        *("config_save", "config_diff", "config_load", "config_store", "config_restore"),
        *("lss_list", "lss_identify", "lss_set"),
    ),
    "A simulated bench": (
        "LiveBench",
        "SimulatedClock",
        "simulate",
        "listed_benches",
        "ListedBench",
    ),
    "Files": (
        *("find", "check", "read_profile", "write_profile", "read_size"),
        *("read_bench", "read_programme", "write_programme", "read_simbench", "read_mapping"),
    ),
    "Runs": (
        *("read_run", "import_runs", "write_run", "open_writer", "Run", "run_of", "export"),
        *("read_log", "info_of", "recover", "open_replay"),
        *("decode_trace", "DecodedTrace"),
    ),
    "Diagnosis": (
        *("compare", "diagnose", "plan", "add", "remove", "forward", "export_model"),
        *("write_addition", "write_removal", "extended_name", "undo", "ledger"),
        *("load_catalogue", "new_effect", "new_profile", "Effect", "Parameter", "sized"),
    ),
    "Estimators": ("DahlEstimator", "identify_dahl"),
    "The page": ("serve",),
    "Errors": (
        *("WinchkitError", "UsageError", "FileError", "Fault", "RunError", "ConnectionLost"),
        *("NoReply", "DeviceRefused", "MotionError", "DriveFault", "LimitTripped", "NotPermitted"),
    ),
    "Cable robots: winchkit.robot": (
        *("read_robot", "robot_of", "Robot", "Pose", "RobotCycle", "ForceLimits"),
        *("read_poses", "calibrate", "next_poses", "write_calibrated"),
        *(
            "self_calibrated",
            "ComputationProcess",
            "TrackerReceiver",
            "PoseVolume",
            "SelfCalibration",
        ),
        "ElongationCorrection",
    ),
    "Many winches: winchkit.fleet": (
        *("diagnose_each", "index_library", "diagnose_library"),
        *("library_history", "LibraryHistory"),
        *("library_runs", "library_estimates", "query_library"),
    ),
}
"""Public names by subject, of ``winchkit`` unless the title names another module.

``__version__`` is a text. ``winchkit.robot`` has further names, for control loops."""
_BEGIN = """\
# Public names

Written by `python docs/make_api.py` from the docstrings and `docs/public_names.txt`; do not edit it
by hand. `help(winchkit.open_bench)` shows the same in Python.

```python
from winchkit import diagnose, read_profile, read_run
```

Names of robots are in `winchkit.robot` (with more for control loops than are listed here), those of
many winches in `winchkit.fleet`. For effects of your own there are `winchkit.effects` and
`winchkit.model.stages` besides, for control loops `winchkit.estimation`, for tests
`winchkit.testing`. Types that these functions take and return are in `winchkit.types`,
`winchkit.robot.types` and `winchkit.fleet.types`, for annotations. Paths of other modules may
change with any version; [stability.md](stability.md) says what is promised, and which call each
command is. `import winchkit` loads no other package: a name is imported when it is first used.
`winchkit.__version__` is the version.
"""


SIGNATURES = Path(__file__).with_name("public_names.txt")
_ROLE = re.compile(r":\w+:`~?(?:[\w.]+\.)?([\w]+)`")
_SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}$", re.MULTILINE)


def page() -> str:
    """The page: public names by subject in tables, then signature and docstring of each."""
    parts, details = [_BEGIN], []
    for title, names in SECTIONS.items():
        face = face_of(title)
        signatures = _signatures(face.__name__)
        parts.append(f"## {title}\n\n| name | what |\n|---|---|")
        public = {name: getattr(face, name) for name in names}
        parts += [f"| [`{n}`](#{n.lower()}) | {_summary(one)} |" for n, one in public.items()]
        parts.append("")
        details += [_entry(name, signatures[name], one) for name, one in public.items()]
    return "\n".join([*parts, "## Signatures\n", *details])


def face_of(title: str) -> ModuleType:
    """The module whose names a section has."""
    return import_module(title.partition(": ")[2] or "winchkit")


def _signatures(module: str) -> dict[str, str]:
    """Lines of each public name of a module in the file of signatures."""
    text = SIGNATURES.read_text(encoding="utf-8")
    (own,) = re.findall(rf"^{module}\n((?: .*\n)+)", text, re.MULTILINE)
    found = re.findall(r"^  (?:class )?(\w+)(.*\n(?: {4}.*\n)*)", own, re.MULTILINE)
    return {name: (name + rest).rstrip() for name, rest in found}


def _entry(name: str, signature: str, public: object) -> str:
    """Section of one name."""
    lines = [
        f"### {name}\n",
        "```text",
        re.sub(r"^ {2}", "", signature, flags=re.MULTILINE),
        "```\n",
    ]
    doc = inspect.getdoc(public) or ""
    begin, *sections = _SECTION.split(_plain(doc))
    lines.append(begin.strip() + "\n")
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        lines.append(f"**{title}**\n")
        lines.append(_items(body) if title in _LISTS else body.strip() + "\n")
    return "\n".join(lines)


_LISTS = {"Parameters", "Returns", "Yields", "Raises", "Attributes"}


def _items(body: str) -> str:
    """Entries of a NumPy section as a list: the name with its type, then the description."""
    items = []
    for entry in re.split(r"\n(?=\S)", body.strip("\n")):
        head, _, rest = entry.partition("\n")
        name, _, kind = head.partition(" : ")
        described = " ".join(rest.split())
        items.append(f"- `{name}`{f' ({kind})' if kind else ''}" + (f": {described}" * bool(rest)))
    return "\n".join(items) + "\n"


def _plain(doc: str) -> str:
    """Docstring with Markdown's literals and without roles."""
    return _ROLE.sub(r"`\1`", doc).replace("``", "`")


def _summary(public: object) -> str:
    first = (inspect.getdoc(public) or "").split("\n")[0]
    return first.replace("``", "`").removesuffix(".").replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
