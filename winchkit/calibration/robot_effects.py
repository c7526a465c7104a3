"""Effects that a robot's profile has from an earlier calibration: their values, read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from winchkit.calibration.robot_elongation import LAWS
from winchkit.errors import Fault, FileError, UsageError
from winchkit.schema.robot import RobotProfile
from winchkit.schema.winch import EffectTable
from winchkit.units import dimension_of, parse

__all__ = ["own_effects"]

_HOME = "home-length"


def own_effects(profile: RobotProfile) -> dict[str, dict[str, float]]:
    """Values by effect, SI: parameters of a law, home lengths by line.

    Effects that a calibration does not fit are left out. Raises FileError for a value that cannot
    be read.
    """
    out: dict[str, dict[str, float]] = {}
    faults: list[Fault] = []
    for table in profile.effect:
        if table.id in LAWS and "line" not in table.values:
            units = {p.name: p.unit for p in LAWS[table.id]}
            given: Mapping[str, Any] = table.values
        elif table.id == _HOME:
            units = {line.name: "m" for line in profile.line}
            lengths = table.values.get("length")
            if not isinstance(lengths, Mapping):
                lengths = {str(table.values.get("line")): lengths}
            given = {**dict.fromkeys(units, "0 m"), **lengths}
        else:
            continue
        try:
            found = _values(given, units)
            if before := out.get(table.id):
                found = {name: value + before[name] for name, value in found.items()}
            out[table.id] = found
        except UsageError as error:
            faults.append(_fault(table, str(error)))
    if faults:
        raise FileError(faults)
    return out


def _values(given: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, float]:
    out = {}
    for name, unit in units.items():
        if name in given:
            try:
                out[name] = parse(given[name], dimension_of(unit) or "ratio")
            except UsageError as error:
                raise UsageError(f"{name}: {error}") from error
    return out


def _fault(table: EffectTable, message: str) -> Fault:
    return Fault(message, table.path, table.line, f"effect {table.id}")
