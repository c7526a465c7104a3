"""Writes docs/public_names.txt: every public name with its signature.

``python docs/make_signatures.py`` after an intended change; a test compares the file with the code,
so that a signature changes by decision only (docs/stability.md).
"""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator
from enum import Enum
from importlib import import_module
from pathlib import Path
from types import GenericAlias
from typing import Any

import winchkit

FILE = Path(__file__).with_name("public_names.txt")
PACKAGES = (
    "winchkit.effects",
    "winchkit.estimation",
    "winchkit.fleet",
    "winchkit.model.stages",
    "winchkit.robot",
    "winchkit.testing.plugin",
)
"""Modules whose ``__all__`` is public besides that of ``winchkit``."""
RESULTS = {
    "winchkit.bench.remote.client": ("RemoteStation",),
    "winchkit.bench.winch": ("Winch",),
    "winchkit.robot.calibration.calibrate": ("Calibrated", "Options"),
    "winchkit.robot.identification.parameters": ("Estimated",),
    "winchkit.diagnosis.add": ("Addition", "Removal"),
    "winchkit.diagnosis.diagnose": ("Answer", "WinchAnswer"),
    "winchkit.diagnosis.plan": ("Plan", "WinchPlan"),
    "winchkit.diagnosis.residuals.traces": ("OutputTrace", "PoseTrace"),
    "winchkit.diagnosis.residuals.attribution": ("Attribution",),
    "winchkit.diagnosis.results": (
        *("CandidateScore", "Combination", "Comparison", "Detectable", "Diagnosis", "Doubt"),
        *("Estimate", "NextRun", "OutputError", "OutputFit", "RobotDiagnosis", "Step"),
    ),
    "winchkit.fit_statistics": ("Correlation", "FitStatistics", "FittedParameter"),
    "winchkit.runs.run": ("Channel",),
    "winchkit.schema.profiles.axis": ("AxisProfile",),
    "winchkit.schema.profiles.robot": ("RobotProfile",),
    "winchkit.schema.profiles.winch": ("WinchProfile",),
}
"""Types of results and arguments by module; their attributes are public, their paths are not."""
_PLAIN = (bool, int, float, str, type(None))
_QUOTED = re.compile(r"""(: |-> )(?:'([^']*)'|"([^"]*)")""")


def text() -> str:
    """The file: a section per package, a line per name, field, property and method."""
    parts = ["# Written by python docs/make_signatures.py; see docs/stability.md.", "", "winchkit"]
    for name in sorted(set(winchkit.__all__) - {"__version__"}):
        parts += _described(name, getattr(winchkit, name))
    for package in PACKAGES:
        module = import_module(package)
        parts += ["", package]
        for name in sorted(module.__all__):
            parts += _described(name, getattr(module, name))
    parts += ["", "results"]
    for module_name, names in sorted(RESULTS.items()):
        for name in names:
            parts += _described(name, getattr(import_module(module_name), name))
    return "\n".join(parts) + "\n"


def _described(name: str, public: Any) -> Iterator[str]:
    if isinstance(public, type) and not isinstance(public, GenericAlias):
        yield from _class(name, public)
    elif inspect.isroutine(public):
        yield f"  {name}{_signature(public)}"
    else:
        yield f"  {name}"


def _class(name: str, public: type) -> Iterator[str]:
    bases = [base.__name__ for base in public.__bases__ if base is not object]
    yield f"  class {name}({', '.join(bases)})" if bases else f"  class {name}"
    if issubclass(public, Enum):
        yield f"    {', '.join(member.name for member in public)}"
    if dataclasses.is_dataclass(public):
        for field in dataclasses.fields(public):
            if not field.name.startswith("_"):
                has_default = (
                    field.default is not dataclasses.MISSING
                    or field.default_factory is not dataclasses.MISSING
                )
                yield f"    {field.name}: {field.type}" + " = ..." * has_default
    elif "__init__" in vars(public):
        yield f"    __init__{_signature(vars(public)['__init__'])}"
    for attribute in sorted(_own(public)):
        found = inspect.getattr_static(public, attribute)
        if isinstance(found, property):
            result = inspect.signature(found.fget).return_annotation if found.fget else ""
            yield f"    {attribute} -> {result}"
        elif isinstance(found, staticmethod | classmethod):
            yield f"    {attribute}{_signature(found.__func__)}"
        elif callable(found):
            yield f"    {attribute}{_signature(found)}"


def _own(public: type) -> set[str]:
    """Public methods and properties of a class and of its bases in this package."""
    fields = {f.name for f in dataclasses.fields(public)} if _is_data(public) else set()
    return {
        name
        for base in public.__mro__
        if base.__module__.startswith("winchkit")
        for name in vars(base)
        if not name.startswith("_") and name not in fields
    }


def _is_data(public: type) -> bool:
    return dataclasses.is_dataclass(public)


def _signature(function: Any) -> str:
    """Signature with annotations as they are written, and ``...`` for defaults that are objects."""
    signature = inspect.signature(function)
    parameters = [
        p if isinstance(p.default, _PLAIN) or p.default is p.empty else p.replace(default=...)
        for p in signature.parameters.values()
    ]
    shown = str(signature.replace(parameters=parameters)).replace("Ellipsis", "...")
    return _QUOTED.sub(lambda found: found[1] + (found[2] or found[3]), shown)


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
