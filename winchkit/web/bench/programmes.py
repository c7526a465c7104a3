"""Motion programmes of the Bench view: which there are, and what one would do."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from winchkit import wings
from winchkit.bench.programme_plan import plan_programme
from winchkit.catalog import folder as shipped
from winchkit.errors import UsageError
from winchkit.plain_json import significant
from winchkit.schema.bench import BenchSpec
from winchkit.schema.programme import Programme
from winchkit.schema.read import load

_DIGITS = 6
"""Significant digits of lengths on the page: a micrometre of a metre."""
_NO_NAME = re.compile(r"[^\w.-]+")


class Programmes:
    """The programmes that a bench can execute: shipped, beside the page's work, and uploaded."""

    def __init__(self, spec: BenchSpec, folder: Path, work: Path) -> None:
        self.spec, self.folder, self.work = spec, folder, work
        self._kind = "programme" if spec.robot is None else "robot-programme"

    def paths(self) -> dict[str, Path]:
        """Programme files by the name that is shown."""
        found = {}
        for place in (shipped("sim"), self.work, self.folder):
            for path in sorted(place.glob("*.toml")):
                if _kind_of(path) == self._kind:
                    found[path.stem if place == shipped("sim") else path.name] = path
        return found

    def path(self, name: str) -> Path:
        """File of a programme; raises UsageError for a name that is none of :meth:`paths`."""
        known = self.paths()
        if name not in known:
            raise UsageError(f"there is no programme '{name}'; there are {', '.join(known)}")
        return known[name]

    def keep(self, name: str, content: bytes) -> str:
        """Keep a programme of the browser; raises FileError where it is none of this bench."""
        target = self.folder / (_NO_NAME.sub("-", Path(name).stem).lstrip(".-") + ".toml")
        target.write_bytes(content)
        try:
            load(target, self._kind)
        except BaseException:
            target.unlink()
            raise
        return target.name

    def preview(self, name: str, here: Mapping[str, float]) -> dict[str, Any]:
        """Preview of a programme from the present lengths ``here``; compares it with the limits."""
        declared = load(self.path(name), self._kind).value
        if (by_wing := wings.call("preview", declared)) is not None:
            moved: dict[str, Any] = by_wing(declared, self.spec)
            return _about(declared) | moved
        assert isinstance(declared, Programme)
        limits = {winch: item.limits for winch, item in self.spec.winch.items()}
        start = {winch: here.get(winch, np.nan) for winch in limits}
        plan = plan_programme(declared, limits, start)
        curves = {f"winch {winch}": significant(v, _DIGITS) for winch, v in plan.length.items()}
        return _about(declared) | {
            "duration": plan.duration,
            "steps": [step.words for step in declared.step],
            "asks": [list(item) for item in plan.asks],
            "time": significant(plan.time, _DIGITS),
            "curves": curves,
        }


def _about(declared: Any) -> dict[str, Any]:
    return {"name": declared.name, "description": declared.description, "repeats": declared.repeat}


def _kind_of(path: Path) -> str:
    """Kind of a TOML file; empty where it is none."""
    try:
        return str(tomllib.loads(path.read_text(encoding="utf-8")).get("kind", ""))
    except (OSError, ValueError):
        return ""
