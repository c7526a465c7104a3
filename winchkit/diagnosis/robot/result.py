"""A robot's diagnosis as JSON: effects by their own names, the line of each beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isnan
from typing import Any, ClassVar

from winchkit.diagnosis.result import Diagnosis, Step
from winchkit.effects.placed import HOME

__all__ = ["RobotDiagnosis", "apart", "plain_step"]


@dataclass(frozen=True)
class RobotDiagnosis(Diagnosis):
    """As a winch's; ids of effects at a place are ``EFFECT/LINE`` inside."""

    data: ClassVar[str] = "poses"
    geometry: str = "file"
    """``file`` where the numbers of the profile were taken as they are, ``refitted`` where the
    geometry was let go."""

    @property
    def empirical(self) -> tuple[str, ...]:
        """None: a curve over a pose has no effect of its own."""
        return ()

    def to_json(self) -> dict[str, Any]:
        """As ``winchkit diagnose --json`` prints it for a robot."""
        out = super().to_json()
        out["geometry"] = self.geometry
        out["steps"] = [_step(step) for step in self.steps]
        out["candidates"] = [_placed(candidate) for candidate in out["candidates"]]
        out["detectable"] = _detectable(out["detectable"])
        for run in out["next_runs"]:
            run["separates"] = [apart(name)[0] for name in run["separates"]]
        return out


def apart(placed: str) -> tuple[str, str | None]:
    """An effect's id and the line it was placed on, None for all lines or the platform."""
    effect, _, line = placed.partition("/")
    return effect, line or None


def plain_step(step: Step) -> Step:
    """A step without the home lengths that a rope's law brings along."""
    parameters = {
        effect: {n: e for n, e in values.items() if not n.startswith(HOME)}
        for effect, values in step.parameters.items()
    }
    return replace(step, parameters=parameters)


def _step(step: Step) -> dict[str, Any]:
    """One step; ``lines`` has, for each name of ``effects``, the lines that it may be on."""
    lines: dict[str, list[str | None]] = {}
    for placed in step.effects:
        effect, line = apart(placed)
        lines.setdefault(effect, []).append(line)
    parameters: dict[str, Any] = {}
    for placed, values in step.parameters.items():
        effect, line = apart(placed)
        several = len(lines.get(effect, ())) > 1 and effect in parameters
        key = placed if several else effect
        parameters[key] = {name: vars(estimate) for name, estimate in values.items()}
    return {
        "effects": list(lines),
        "lines": lines,
        "parameters": parameters,
        "heldout_gain": step.heldout_gain,
        "angles": dict(step.angles),
        "whole": step.whole,
    }


def _placed(candidate: Mapping[str, Any]) -> dict[str, Any]:
    effect, line = apart(candidate["effect"])
    return {**candidate, "effect": effect, "line": line}


def _detectable(items: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Per effect and parameter the line on which it would have to be largest to be seen."""
    out: dict[tuple[str, str], dict[str, Any]] = {}
    for item in items:
        effect, line = apart(item["effect"])
        key = effect, item["parameter"]
        worst = out.get(key)
        size = item["smallest"]
        if worst is None or isnan(size) or size > worst["smallest"]:
            out[key] = {**item, "effect": effect, "line": line}
    return list(out.values())
